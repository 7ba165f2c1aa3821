//! `rig keys` and the help.

use super::{code, good, number, rig, said};

#[test]
fn keys_are_listed_with_unit_default_and_description() {
    let listed = good(&["keys", "--json", "--rig", "fe"]);
    let keys = listed["keys"].as_array().unwrap();
    let of = |name: &str| keys.iter().find(|key| key["key"] == name).unwrap();
    let limit = of("preload.limit_n");
    assert_eq!((limit["unit"].as_str(), number(limit, "default")), (Some("N"), 150.0));
    assert!(limit["description"].as_str().unwrap().len() > 10);
    assert_eq!(of("run.seed")["default"], 0);
    assert!(of("rig.step_positions_mm")["default"].is_array());
    let output = rig(&["keys"]);
    assert_eq!(code(&output), 0);
    for key in keys {
        assert!(said(&output).contains(key["key"].as_str().unwrap()), "{key}");
    }
}

#[test]
fn help_lists_the_verbs_and_is_no_error() {
    let output = rig(&["--help"]);
    assert_eq!(code(&output), 0);
    for verb in ["modes", "bench", "paper"] {
        assert!(said(&output).contains(&format!("\n  {verb} ")), "{verb}");
    }
    for verb in ["deploy", "crossing", "montecarlo", "keys", "test"] {
        assert!(said(&output).contains(&format!("\n  {verb} ")), "{verb}");
        let help = rig(&[verb, "--help"]);
        assert_eq!(code(&help), 0, "{verb}");
        assert!(said(&help).contains("Usage: cargo rig"), "{verb}");
    }
    let text = said(&rig(&["deploy", "--help"])).to_owned();
    assert!(text.contains("board") && text.contains("probe"), "{text}");
    assert!(said(&rig(&["--version"])).starts_with("rig "));
}
