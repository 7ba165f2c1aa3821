//! What `rig bench` measures keeps its promises, and the command prints its keys.

use std::process::{Command, Output};

use hil_sim::plant::precision::{Setting, work_precision};
use interstage::rig::Rig;
use rig_study::bench::{cycles, model, peers};
use serde_json::Value;

fn rig(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_rig-study")).args(arguments).output().expect("it starts")
}

#[test]
fn the_default_resolution_is_within_half_a_per_cent() {
    let reached = work_precision(&Rig::prototype(), &[Setting::usual()], 1, || ()).unwrap();
    assert!(reached[0].gap_error <= 0.005 && reached[0].force_error <= 0.005, "{reached:?}");
}

#[test]
fn a_quick_measurement_prints_one_object_with_its_keys() {
    let output = rig(&["bench", "--quick", "--host", "--json"]);
    assert!(output.status.success(), "{output:?}");
    let object: Value = serde_json::from_slice(&output.stdout).unwrap();
    for key in ["variants", "tick", "plant", "peers"] {
        assert!(object.get(key).is_some(), "{key}");
    }
    for (variant, name) in
        object["variants"].as_array().unwrap().iter().zip(["fixed", "f32", "f64"])
    {
        assert_eq!(variant["name"], name);
        let number = |key: &str| variant[key].as_f64().unwrap();
        assert!(number("max_rel_error") >= number("rms_rel_error") && number("host_ns") > 0.0);
        assert!(variant["cycles"].is_null(), "{variant}");
    }
    let settings = object["plant"]["settings"].as_array().unwrap();
    let [coarse, usual] = &settings[..] else { panic!("two resolutions: {settings:?}") };
    let number = |point: &Value, key: &str| point[key].as_f64().unwrap();
    assert!(number(coarse, "gap_error") > number(usual, "gap_error"));
    // Left out, and why, in one line.
    let why = object["peers_left_out"].as_str().unwrap();
    assert!(why.contains("--peers") && !why.contains('\n'), "{why}");
}

#[test]
fn the_shipping_model_costs_less_than_550_cycles_and_answers_as_on_the_host() {
    if !super::long() {
        return;
    }
    let (calls, _) = cycles::run().unwrap();
    let mut variants = model::measure().unwrap();
    cycles::fill(&calls, &mut variants).unwrap();
    let fixed = &variants[0];
    assert!(fixed.forward.cycles.unwrap() <= 550 && fixed.inverse.cycles.unwrap() <= 350);
}

#[test]
fn an_independent_solver_gives_the_rings_crossing() {
    if !super::long() {
        return;
    }
    let peers = peers::compare(&|_| ()).unwrap();
    let least = peers.agreement().unwrap();
    assert!(least < 5e-4, "{least}");
}
