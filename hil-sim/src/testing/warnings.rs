//! Diagnostics among cargo's messages.

use serde::Deserialize;

#[derive(Deserialize)]
struct Message {
    message: Diagnostic,
}

#[derive(Deserialize)]
struct Diagnostic {
    level: String,
    message: String,
    rendered: Option<String>,
}

/// The warnings and errors in `messages`, one JSON object a line, as the compiler
/// renders them. Closing remarks such as "2 warnings emitted" are left out.
pub(super) fn rendered(messages: &str) -> Vec<String> {
    messages
        .lines()
        .filter_map(|line| serde_json::from_str::<Message>(line).ok())
        .map(|message| message.message)
        .filter(|diagnostic| diagnostic.level == "warning" || diagnostic.level.starts_with("error"))
        .filter(|diagnostic| !diagnostic.message.ends_with(" emitted"))
        .filter_map(|diagnostic| diagnostic.rendered)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn diagnostics_are_picked_out_of_the_messages() {
        let messages = r#"{"reason":"compiler-artifact","target":{"name":"defmt"}}
{"reason":"compiler-message","message":{"level":"warning","message":"unused","rendered":"warning: unused\n"}}
{"reason":"compiler-message","message":{"level":"warning","message":"1 warning emitted","rendered":"\u001b[33mwarning\u001b[0m: 1 warning emitted\n"}}
{"reason":"compiler-message","message":{"level":"note","message":"so","rendered":"note: so\n"}}
{"reason":"compiler-message","message":{"level":"error","message":"no","rendered":"error: no\n"}}
{"reason":"build-finished","success":true}"#;
        assert_eq!(rendered(messages), ["warning: unused\n", "error: no\n"]);
        assert!(rendered("").is_empty());
    }
}
