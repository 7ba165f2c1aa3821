//! What `rig bench` measures and does not depend on the machine stays within its
//! budget, and the command prints what it is documented to print.

use std::process::{Command, Output};

use hil_sim::bench::budget::Budget;
use hil_sim::bench::default_precision;
use serde_json::Value;

fn rig(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_rig")).args(arguments).output().expect("it starts")
}

#[test]
fn the_default_resolution_keeps_its_budget() {
    let budget = Budget::shipped().unwrap();
    let reached = default_precision().unwrap();
    for line in budget.plant.lines(reached.max_gap_error, reached.max_force_error) {
        assert!(line.holds, "{line:?}");
    }
}

#[test]
fn a_quick_measurement_prints_one_object_with_its_keys() {
    let output = rig(&["bench", "--quick", "--json"]);
    assert!(output.status.success(), "{output:?}");
    let object: Value = serde_json::from_slice(&output.stdout).unwrap();
    for key in ["plant", "peers", "budgets", "machine", "version"] {
        assert!(object.get(key).is_some(), "{key}");
    }
    let meshes = object["plant"]["meshes"].as_array().unwrap();
    let [coarse, usual] = &meshes[..] else { panic!("two resolutions: {meshes:?}") };
    assert_eq!((&coarse["default"], &usual["default"]), (&false.into(), &true.into()));
    let number = |mesh: &Value, key: &str| mesh[key].as_f64().unwrap();
    assert!(number(coarse, "max_gap_error") > number(usual, "max_gap_error"));
    assert!(number(coarse, "crossing_ms") < number(usual, "crossing_ms"));
    assert!(number(&object["plant"]["costs"], "plant_real_time_factor") > 1.0);
    // Left out, and why, in one line.
    assert!(object["peers"].is_null());
    let why = object["peers_left_out"].as_str().unwrap();
    assert!(why.contains("--peers") && !why.contains('\n'), "{why}");
}

#[test]
fn a_quick_measurement_is_neither_written_down_nor_recorded() {
    for option in ["--docs", "--record"] {
        let output = rig(&["bench", "--quick", option]);
        assert_eq!(output.status.code(), Some(2));
        assert_eq!(String::from_utf8_lossy(&output.stderr).lines().count(), 1);
    }
}
