//! `rig flash`, with other programs in the place of probe-rs.

use std::process::{Command, Output};

use super::{code, said};

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
    let said = said(&output).trim();
    let (arguments, image) = said.rsplit_once(' ').expect("arguments");
    assert_eq!(arguments, "run --chip STM32G474RETx --verify --probe 0483:374b");
    assert!(std::fs::read(image).expect("an image").starts_with(b"\x7fELF"), "{image}");
}

#[test]
fn what_the_probe_says_is_what_it_ends_with() {
    assert_eq!(code(&flash_by("false", &[])), 1);
    let output = flash_by("/no/such/probe-rs", &[]);
    assert_eq!(code(&output), 2);
    let said = String::from_utf8(output.stderr).expect("text");
    assert!(said.contains("/no/such/probe-rs: ") && said.contains("probe-rs-tools"), "{said}");
}
