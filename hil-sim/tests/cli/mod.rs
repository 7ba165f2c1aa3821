//! The `rig` command as a user meets it: arguments, JSON, exit codes, files.

mod crossing;
mod deploy;
mod faults;
mod flash;
mod input;
mod logs;
mod montecarlo;
mod others;

use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

/// Runs the command in `directory`.
fn rig_in(directory: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_rig"))
        .current_dir(directory)
        .args(arguments)
        .output()
        .expect("the command starts")
}

/// Runs the command where it leaves nothing behind.
fn rig(arguments: &[&str]) -> Output {
    let directory = tempfile::tempdir().expect("a temporary directory");
    rig_in(directory.path(), arguments)
}

/// The exit code.
fn code(output: &Output) -> i32 {
    output.status.code().expect("the command was not killed")
}

/// Standard output as text.
fn said(output: &Output) -> &str {
    std::str::from_utf8(&output.stdout).expect("text")
}

/// The one JSON object on standard output.
fn object(output: &Output) -> Value {
    let stderr = String::from_utf8_lossy(&output.stderr);
    let value: Value = serde_json::from_slice(&output.stdout)
        .unwrap_or_else(|error| panic!("no JSON: {error}; {stderr}"));
    assert!(value.is_object(), "{value}");
    value
}

/// The object of a command that must end well.
fn good(arguments: &[&str]) -> Value {
    let output = rig(arguments);
    assert_eq!(code(&output), 0, "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    object(&output)
}

/// The number at `key`.
fn number(value: &Value, key: &str) -> f64 {
    value[key].as_f64().unwrap_or_else(|| panic!("{key} is no number in {value}"))
}

/// Whether `directory` is empty.
fn is_empty(directory: &Path) -> bool {
    std::fs::read_dir(directory).expect("a directory").next().is_none()
}
