//! What `rig bench` measures and does not depend on the machine stays within its
//! budget, and the command prints what it is documented to print.

use std::process::{Command, Output};

use hil_sim::plant::precision::{Setting, work_precision};
use interstage::rig::Rig;
use rig_study::bench::budget::Budget;
use serde_json::Value;

fn rig(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_rig")).args(arguments).output().expect("it starts")
}

#[test]
fn the_default_resolution_keeps_its_budget() {
    let budget = Budget::shipped().unwrap();
    let reached = work_precision(&Rig::prototype(), &[Setting::usual()], 1, || ()).unwrap();
    for line in budget.plant.lines(reached[0].gap_error, reached[0].force_error) {
        assert!(line.holds, "{line:?}");
    }
}

#[test]
fn a_quick_measurement_prints_one_object_with_its_keys() {
    let output = rig(&["bench", "--quick", "--host", "--json"]);
    assert!(output.status.success(), "{output:?}");
    let object: Value = serde_json::from_slice(&output.stdout).unwrap();
    for key in ["variants", "plant", "peers", "budgets", "machine", "version"] {
        assert!(object.get(key).is_some(), "{key}");
    }
    let variants = object["variants"].as_array().unwrap();
    assert_eq!(variants.len(), 5);
    for variant in variants {
        let number = |key: &str| variant[key].as_f64().unwrap();
        assert!(number("max_rel_error") >= number("rms_rel_error") && number("host_ns") > 0.0);
        assert!(variant["name"].is_string() && variant["cycles"].is_null(), "{variant}");
    }
    let settings = object["plant"]["settings"].as_array().unwrap();
    let [coarse, usual] = &settings[..] else { panic!("two resolutions: {settings:?}") };
    assert_eq!(usual["elements"], object["plant"]["default"]["elements"]);
    let number = |point: &Value, key: &str| point[key].as_f64().unwrap();
    assert!(number(coarse, "gap_error") > number(usual, "gap_error"));
    assert!(number(coarse, "wall_ns") < number(usual, "wall_ns"));
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
