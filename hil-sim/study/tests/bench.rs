//! What `rig bench` measures keeps its promises, and the command prints its keys.

use std::process::Command;

use hil_sim::plant::balance::Axial;
use hil_sim::plant::crossing::{CrossingCase, cross};
use hil_sim::plant::precision::{FINER, Setting};
use interstage::rig::Rig;
use rig_study::bench::{cycles, rollout};
use serde_json::Value;

#[test]
fn a_quick_measurement_prints_one_object_with_its_keys() {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rig-study"));
    let output = command.args(["bench", "--quick", "--host", "--json"]).output().unwrap();
    assert!(output.status.success(), "{output:?}");
    let object: Value = serde_json::from_slice(&output.stdout).unwrap();
    for key in ["variants", "tick", "plant", "peers"] {
        assert!(object.get(key).is_some(), "{key}");
    }
    let variants = object["variants"].as_array().unwrap();
    assert!(variants.len() == 1 && variants[0]["name"] == "rollout", "{variants:?}");
    let number = |key: &str| variants[0][key].as_f64().unwrap();
    assert!(number("max_rel_error") >= number("rms_rel_error") && number("host_ns") > 0.0);
    assert!(variants[0]["cycles"].is_null(), "{variants:?}");
    let settings = object["plant"]["settings"].as_array().unwrap();
    let [coarse, usual] = &settings[..] else { panic!("two resolutions: {settings:?}") };
    let number = |point: &Value, key: &str| point[key].as_f64().unwrap();
    assert!(number(coarse, "gap_error") > number(usual, "gap_error"));
    assert_eq!(object["peers"]["least_seconds"][0][0], "ring");
}

#[test]
fn a_rollout_answers_on_the_core_as_on_the_host() {
    if !super::long() {
        return;
    }
    let (calls, _) = cycles::run(&rollout::inputs().unwrap()).unwrap();
    let mut variants = rollout::measure().unwrap();
    rollout::fill(&calls, &mut variants).unwrap();
    assert!(variants[0].cycles.unwrap() > 10_000, "{variants:?}");
}

/// The ring of today gives the crossing that SciPy's solvers found.
#[test]
fn an_independent_solver_gives_the_rings_crossing() {
    let (rig, mesh) = (Rig::fe(), Setting::usual().finer(FINER));
    let of = (5.0, 100.0, Axial::Pushed);
    let found = cross(&CrossingCase::of(&rig, mesh.both(), of)).unwrap();
    let peers: Value = serde_json::from_str(include_str!("../peers/results.json")).unwrap();
    let solved = peers["settings"].as_array().unwrap().iter().filter(|s| s["tolerance"].is_f64());
    let error = solved.map(|solved| {
        let off = |name: &str, ours: f64| (solved[name].as_f64().unwrap() / ours - 1.0).abs();
        off("gap_mm", found.gap_mm).max(off("corner_force_n", found.corner_force_n))
    });
    let least = error.fold(f64::INFINITY, f64::min);
    assert!(least < 1e-3, "{least}");
}
