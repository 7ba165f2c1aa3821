//! What is done with a log, from the emulated board to the page and the parameters, as a
//! user has it.

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
fn a_log_of_the_board_goes_through_every_verb() {
    let directory = tempfile::tempdir().expect("a directory");
    let place = directory.path();
    let caught = good(place, &["capture", "--target", "board", "--out", ".", "--json"]);
    assert!(caught["ticks"].as_u64() > Some(6000), "{caught}");
    assert_eq!((&caught["lost_ticks"], &caught["garbage_bytes"]), (&0.into(), &0.into()));

    let again = good(place, &["replay", "log.mcap", "--json"]);
    assert_eq!(again["equal"], true, "{again}");

    let page = good(place, &["report", "log.mcap", "--out", "page.html", "--json"]);
    assert_eq!((&page["completed"], &page["rig"]), (&true.into(), &"prototype".into()));
    assert!(place.join("page.html").is_file());

    let found = good(place, &["identify", "log.mcap", "--out", "found", "--json"]);
    let parameters = found["parameters"].as_array().expect("a list");
    // The plant of seed 0 is the nominal one.
    for (name, truth) in
        [("tread.k_inf_pa_per_m", 0.6044e9), ("tread.stiffening", 4.2235), ("tread.tau_s", 0.1059)]
    {
        let parameter = parameters.iter().find(|p| p["name"] == name).expect(name);
        let value = parameter["value"].as_f64().expect("a number");
        assert!((value / truth - 1.0).abs() < 0.05, "{name}: {value}");
    }
    assert!(place.join("found").join("identified.toml").is_file());

    let live = ["live", "--target", "board", "--headless", "--fast", "--listen", "127.0.0.1:0"];
    good(place, &[&live[..], &["--picture", "view.svg"]].concat());
    assert!(std::fs::read_to_string(place.join("view.svg")).is_ok_and(|svg| svg.contains("<svg")));
}
