//! `rig keys`, `rig flash` with other programs in the place of probe-rs, and the help.

use std::process::{Command, Output};

use super::{code, good, number, rig, stderr, stdout};

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
        assert!(stdout(&output).contains(key["key"].as_str().unwrap()), "{key}");
    }
}

#[test]
fn help_lists_the_verbs_and_is_no_error() {
    let output = rig(&["--help"]);
    assert_eq!(code(&output), 0);
    for verb in ["modes", "bench", "paper"] {
        assert!(stdout(&output).contains(&format!("\n  {verb} ")), "{verb}");
    }
    for verb in ["deploy", "crossing", "compare", "envelope", "montecarlo", "keys", "test"] {
        assert!(stdout(&output).contains(&format!("\n  {verb} ")), "{verb}");
        let help = rig(&[verb, "--help"]);
        assert_eq!(code(&help), 0, "{verb}");
        assert!(stdout(&help).contains("Usage: cargo rig"), "{verb}");
    }
    let text = stdout(&rig(&["deploy", "--help"])).to_owned();
    assert!(text.contains("board") && text.contains("probe"), "{text}");
    assert!(stdout(&rig(&["--version"])).starts_with("rig "));
}

fn flash_by(program: &str, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_rig"))
        .env("PROBE_RS", program)
        .arg("flash")
        .args(arguments)
        .output()
        .expect("the command starts")
}

#[test]
fn the_image_is_flashed_and_read_back() {
    let output = flash_by("echo", &["--", "--probe", "0483:374b"]);
    assert_eq!(code(&output), 0);
    let (arguments, image) = stdout(&output).trim().rsplit_once(' ').expect("arguments");
    assert_eq!(arguments, "run --chip STM32G474RETx --verify --probe 0483:374b");
    assert!(std::fs::read(image).expect("an image").starts_with(b"\x7fELF"), "{image}");
}

#[test]
fn the_exit_code_is_that_of_probe_rs() {
    assert_eq!(code(&flash_by("false", &[])), 1);
    let output = flash_by("/no/such/probe-rs", &[]);
    assert_eq!(code(&output), 2);
    let text = stderr(&output);
    assert!(text.contains("/no/such/probe-rs: ") && text.contains("probe-rs-tools"), "{text}");
}
