//! The verbs on the emulated board, as a user has them.

use crate::common::cli::good;

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
        let out = log.trim_start_matches("log.");
        let found = good(place, &["identify", log, "--out", out, "--json"]);
        found["parameters"].as_array().expect("a list").clone()
    });
    assert!(frames.len() > 15, "{}", frames.len());
    assert_eq!(table, frames);
}
