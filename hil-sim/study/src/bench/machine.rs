//! What the times were measured on.

use std::fs;

use serde::{Deserialize, Serialize};

/// The host, as far as it matters to a time.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Machine {
    /// Processor, as the system names it.
    pub processor: String,
    /// Threads that it runs at a time.
    pub threads: usize,
    /// Architecture and system.
    pub system: String,
    /// Whether this binary was optimised.
    pub optimised: bool,
}

impl Machine {
    /// This one.
    #[must_use]
    pub fn here() -> Self {
        let named = fs::read_to_string("/proc/cpuinfo").ok().and_then(|text| model(&text));
        Self {
            processor: named.unwrap_or_else(|| "unknown".to_owned()),
            threads: std::thread::available_parallelism().map_or(1, usize::from),
            system: format!("{} {}", std::env::consts::ARCH, std::env::consts::OS),
            optimised: !cfg!(debug_assertions),
        }
    }
}

/// The processor's name in `/proc/cpuinfo`.
fn model(text: &str) -> Option<String> {
    let line = text.lines().find(|line| line.starts_with("model name"))?;
    let name = line.split_once(':')?.1.trim();
    (!name.is_empty()).then(|| name.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_processor_is_read_from_the_system() {
        let text = "processor\t: 0\nmodel name\t: Some Processor @ 2 GHz\nflags\t: fpu\n";
        assert_eq!(model(text).as_deref(), Some("Some Processor @ 2 GHz"));
        assert_eq!(model("processor: 0\n"), None);
        assert!(Machine::here().threads >= 1);
    }
}
