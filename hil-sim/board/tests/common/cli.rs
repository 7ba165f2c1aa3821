//! The verbs on the emulated board, as a user has them.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use serde_json::Value;

/// What a verb printed as JSON, and what it said.
pub(crate) struct Said {
    pub(crate) code: Option<i32>,
    /// Null if it printed something else.
    pub(crate) printed: Value,
    pub(crate) text: String,
}

/// `rig` or `rig-board`, whichever has this verb; a build of the workspace has both side by side.
fn program(arguments: &[&str]) -> PathBuf {
    let board = Path::new(env!("CARGO_BIN_EXE_rig-board"));
    if arguments.contains(&"board") {
        return board.to_owned();
    }
    let rig = board.with_file_name(format!("rig{}", std::env::consts::EXE_SUFFIX));
    assert!(rig.is_file(), "{}: these tests take cargo's --workspace", rig.display());
    rig
}

/// Runs a verb in a folder, whose `probe-rs` flashes a board; standard input is closed.
pub(crate) fn rig(place: &Path, arguments: &[&str]) -> Said {
    let output = Command::new(program(arguments))
        .current_dir(place)
        .env("PROBE_RS", place.join("probe-rs"))
        .args(arguments)
        .stdin(Stdio::null())
        .output()
        .expect("starts");
    Said {
        code: output.status.code(),
        printed: serde_json::from_slice(&output.stdout).unwrap_or(Value::Null),
        text: String::from_utf8_lossy(&output.stderr).into_owned(),
    }
}

/// What a verb prints that must end well.
pub(crate) fn good(place: &Path, arguments: &[&str]) -> Value {
    let said = rig(place, arguments);
    assert_eq!(said.code, Some(0), "{arguments:?}: {}{}", said.text, said.printed);
    said.printed
}
