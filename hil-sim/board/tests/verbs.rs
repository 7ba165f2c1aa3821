//! The verbs on the emulated board, as a user has them.

use std::path::Path;
use std::process::Command;

use serde_json::Value;

/// What a verb prints that must end well.
fn good(place: &Path, arguments: &[&str]) -> Value {
    let output = Command::new(env!("CARGO_BIN_EXE_rig-board"))
        .current_dir(place)
        .args(arguments)
        .output()
        .expect("starts");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {said}");
    serde_json::from_slice(&output.stdout).unwrap_or(Value::Null)
}

#[test]
fn a_run_of_the_board_is_captured_and_shown_live() {
    let directory = tempfile::tempdir().expect("a directory");
    let place = directory.path();
    let caught = good(place, &["capture", "--target", "board", "--out", ".", "--json"]);
    assert!(caught["ticks"].as_u64() > Some(5000), "{caught}");
    assert_eq!((&caught["lost_ticks"], &caught["garbage_bytes"]), (&0.into(), &0.into()));

    let live = ["live", "--target", "board", "--headless", "--fast", "--listen", "127.0.0.1:0"];
    good(place, &live);
}
