//! `rig modes`, `rig keys` and the help.

use serde_json::Value;

use super::{code, good, number, rig, said};

fn numbers(value: &Value, key: &str) -> Vec<f64> {
    value[key].as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

#[test]
fn modes_are_the_classical_ones() {
    for (ends, classical) in [
        ("clamped-free", [1.875_104_069, 4.694_091_133]),
        ("pinned-free", [3.926_602_312, 7.068_582_746]),
        ("free-free", [4.730_040_745, 7.853_204_624]),
    ] {
        let modes = good(&["modes", "--json", "--ends", ends, "--count", "2"]);
        let beta_l = numbers(&modes, "beta_l");
        assert_eq!(beta_l.len(), 2);
        for (found, expected) in beta_l.iter().zip(classical) {
            assert!((found - expected).abs() < 1e-8, "{ends}: {found}");
        }
        let hz = numbers(&modes, "frequencies_hz");
        let scale = (beta_l[1] / beta_l[0]).powi(2);
        assert!((hz[1] / hz[0] / scale - 1.0).abs() < 1e-9);
    }
}

#[test]
fn a_tip_mass_lowers_the_frequencies() {
    let first =
        |mass| numbers(&good(&["modes", "--json", "--tip-mass-kg", mass]), "frequencies_hz")[0];
    assert!((first("0.0629") / 276.0 - 1.0).abs() < 1e-3);
    assert!(first("0") > first("0.01"));
}

#[test]
fn keys_are_listed_with_unit_default_and_description() {
    let listed = good(&["keys", "--json", "--rig", "fe"]);
    let keys = listed["keys"].as_array().unwrap();
    let of = |name: &str| keys.iter().find(|key| key["key"] == name).unwrap();
    let limit = of("preload.limit_n");
    assert_eq!((limit["unit"].as_str(), number(limit, "default")), (Some("N"), 150.0));
    assert!(limit["description"].as_str().unwrap().len() > 10);
    assert_eq!(of("run.seed")["default"], 0);
    assert!(of("rig.step_positions_mm")["default"].is_array());
    let output = rig(&["keys"]);
    assert_eq!(code(&output), 0);
    for key in keys {
        assert!(said(&output).contains(key["key"].as_str().unwrap()), "{key}");
    }
}

#[test]
fn help_lists_the_verbs_and_is_no_error() {
    let output = rig(&["--help"]);
    assert_eq!(code(&output), 0);
    for verb in ["deploy", "crossing", "modes", "montecarlo", "keys", "size", "constants", "test"] {
        assert!(said(&output).contains(&format!("\n  {verb} ")), "{verb}");
        let help = rig(&[verb, "--help"]);
        assert_eq!(code(&help), 0, "{verb}");
        assert!(said(&help).contains("Usage: cargo rig"), "{verb}");
    }
    let text = said(&rig(&["deploy", "--help"])).to_owned();
    assert!(text.contains("board") && text.contains("probe"), "{text}");
    assert!(said(&rig(&["--version"])).starts_with("rig "));
}
