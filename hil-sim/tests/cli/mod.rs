//! The `rig` command as a user meets it: arguments, JSON, exit codes, files.

mod campaigns;
mod crossing;
mod deploy;
mod input;
mod kept;
mod logs;
mod others;
mod read_back;
mod sweep;

use std::ops::Deref;
use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

/// A temporary folder to run commands in.
pub(crate) struct Folder(tempfile::TempDir);

impl Deref for Folder {
    type Target = Path;

    fn deref(&self) -> &Path {
        self.0.path()
    }
}

pub(crate) fn folder() -> Folder {
    Folder(tempfile::tempdir().expect("a temporary directory"))
}

/// Runs the command in `directory`.
pub(crate) fn rig_in(directory: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_rig"))
        .current_dir(directory)
        .args(arguments)
        .output()
        .expect("the command starts")
}

/// Runs the command where it leaves nothing behind.
fn rig(arguments: &[&str]) -> Output {
    rig_in(&folder(), arguments)
}

/// The object in a file.
pub(crate) fn json(path: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(path).expect("a file")).expect("JSON")
}

pub(crate) fn code(output: &Output) -> i32 {
    output.status.code().expect("the command was not killed")
}

fn stdout(output: &Output) -> &str {
    std::str::from_utf8(&output.stdout).expect("text")
}

pub(crate) fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// The one JSON object on standard output.
pub(crate) fn object(output: &Output) -> Value {
    let value: Value = serde_json::from_slice(&output.stdout)
        .unwrap_or_else(|error| panic!("no JSON: {error}; {}", stderr(output)));
    assert!(value.is_object(), "{value}");
    value
}

/// Runs the command in `directory`, where it must end with this code.
pub(crate) fn ends_with(expected: i32, directory: &Path, arguments: &[&str]) -> Output {
    let output = rig_in(directory, arguments);
    assert_eq!(code(&output), expected, "{arguments:?}: {}", stderr(&output));
    output
}

/// Runs the command in `directory`, where it must end well.
pub(crate) fn good_in(directory: &Path, arguments: &[&str]) -> Output {
    ends_with(0, directory, arguments)
}

/// The object of a command that must end well and leaves nothing behind.
fn good(arguments: &[&str]) -> Value {
    object(&good_in(&folder(), arguments))
}

fn number(value: &Value, key: &str) -> f64 {
    value[key].as_f64().unwrap_or_else(|| panic!("{key} is no number in {value}"))
}

/// Runs the command in `directory` and expects it to refuse in one line that names each of `names`.
pub(crate) fn refused_in(directory: &Path, arguments: &[&str], names: &[&str]) {
    let output = rig_in(directory, arguments);
    let text = stderr(&output);
    assert_eq!(code(&output), 2, "{arguments:?}: {text}");
    assert!(output.stdout.is_empty(), "{arguments:?}");
    assert!(text.starts_with("error: ") && text.ends_with('\n'), "{text:?}");
    assert!(text.lines().count() == 1 && !text.contains("Usage"), "{text}");
    for name in names {
        assert!(text.contains(name), "{name}: {text}");
    }
}

/// The same where no file may be left.
fn refused(arguments: &[&str], names: &[&str]) {
    let at = &folder();
    refused_in(at, arguments, names);
    assert!(is_empty(at), "{arguments:?} left files");
}

fn is_empty(directory: &Path) -> bool {
    std::fs::read_dir(directory).expect("a directory").next().is_none()
}
