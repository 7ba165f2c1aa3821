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

fn flash_by(program: &std::path::Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_rig"))
        .env("PROBE_RS", program)
        .arg("flash")
        .args(arguments)
        .output()
        .expect("the command starts")
}

/// A program in the place of probe-rs: its version, and what it does with its arguments.
#[cfg(unix)]
fn stand_in(version: &str, run: &str) -> std::path::PathBuf {
    use std::os::unix::fs::PermissionsExt;

    let name = format!("probe-rs-{}-{}", std::process::id(), version.replace(' ', "-"));
    let path = std::env::temp_dir().join(name);
    let script = format!("#!/bin/sh\ncase $1 in --version) echo '{version}';; *) {run};; esac\n");
    std::fs::write(&path, script).expect("a file");
    let mode = std::fs::Permissions::from_mode(0o755);
    std::fs::set_permissions(&path, mode).expect("a program");
    path
}

#[cfg(unix)]
#[test]
fn the_image_is_flashed_and_read_back_and_only_the_text_log_is_shown() {
    let probe_rs = stand_in("probe-rs 0.32.0 (git commit: none)", "echo \"$@\"");
    let output = flash_by(&probe_rs, &["--", "--probe", "0483:374b"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let (arguments, image) = stdout(&output).trim().rsplit_once(' ').expect("arguments");
    let expected = "run --chip STM32G474RETx --verify --no-catch-reset --no-catch-hardfault \
                    --rtt-up-channels 0 --rtt-channel-mode no-block-skip --probe 0483:374b";
    assert_eq!(arguments, expected);
    assert!(std::fs::read(image).expect("an image").starts_with(b"\x7fELF"), "{image}");
    let _ = std::fs::remove_file(probe_rs);
}

#[cfg(unix)]
#[test]
fn the_exit_code_is_that_of_probe_rs() {
    let probe_rs = stand_in("probe-rs 1.0.0", "exit 1");
    assert_eq!(code(&flash_by(&probe_rs, &[])), 1);
    let _ = std::fs::remove_file(probe_rs);
}

#[cfg(unix)]
#[test]
fn probe_rs_has_to_be_there_and_new_enough() {
    let output = flash_by("/no/such/probe-rs".as_ref(), &[]);
    assert_eq!(code(&output), 2);
    let text = stderr(&output);
    assert!(text.contains("/no/such/probe-rs: ") && text.contains("probe-rs-tools"), "{text}");
    let old = stand_in("probe-rs 0.31.0", "echo it ran");
    let output = flash_by(&old, &[]);
    assert_eq!((code(&output), stdout(&output)), (2, ""));
    let text = stderr(&output);
    assert!(text.contains("probe-rs 0.31.0") && text.contains("0.32"), "{text}");
    let _ = std::fs::remove_file(old);
}
