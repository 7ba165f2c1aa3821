//! The verbs on the emulated board, as a user has them.

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

/// `rig` or `rig-board`, whichever has this verb; a build of the workspace has both side by side.
pub(crate) fn program(arguments: &[&str]) -> PathBuf {
    let board = Path::new(env!("CARGO_BIN_EXE_rig-board"));
    if arguments.contains(&"board") {
        return board.to_owned();
    }
    let rig = board.with_file_name(format!("rig{}", std::env::consts::EXE_SUFFIX));
    assert!(rig.is_file(), "{}: these tests take cargo's --workspace", rig.display());
    rig
}

/// What a verb prints that must end well.
fn good(place: &Path, arguments: &[&str]) -> Value {
    let output = Command::new(program(arguments))
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
    assert!(caught["ticks"].as_u64() > Some(4500), "{caught}");
    assert_eq!((&caught["lost_ticks"], &caught["garbage_bytes"]), (&0.into(), &0.into()));

    let live = ["live", "--target", "board", "--headless", "--fast", "--listen", "127.0.0.1:0"];
    good(place, &live);

    // Its table identifies the same rig as its frames.
    let [table, frames] = ["log.csv", "log.mcap"].map(|log| {
        let found =
            good(place, &["identify", log, "--out", log.trim_start_matches("log."), "--json"]);
        found["parameters"].as_array().expect("a list").clone()
    });
    assert!(frames.len() > 15, "{}", frames.len());
    assert_eq!(table, frames);
}
