//! `docs/MODEL.md` names tests that exist, and its figures are what the models give.

use std::path::Path;

use rig_study::model_figures::{self, ModelFigures};
use serde_json::Value;

use super::doc;

/// All sources of the references, tests included.
fn sources(folder: &Path) -> String {
    let mut text = String::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        text +=
            &if path.is_dir() { sources(&path) } else { std::fs::read_to_string(path).unwrap() };
    }
    text
}

#[test]
fn every_test_that_the_page_names_is_there() {
    let page = doc("MODEL.md");
    let sources = sources(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src/reference"));
    let quoted = page.split('`').skip(1).step_by(2);
    let names: Vec<&str> = quoted
        .filter(|name| name.matches('_').count() >= 3 && !name.contains(['/', ' ', ':']))
        .collect();
    assert!(names.len() > 15, "{names:?}");
    for name in names {
        assert!(sources.contains(&format!("fn {name}(")), "no test `{name}`");
    }
}

/// Every number by its place.
fn numbers(value: &Value, place: &str, all: &mut Vec<(String, f64)>) {
    match value {
        Value::Number(number) => all.push((place.to_owned(), number.as_f64().unwrap())),
        Value::Array(list) => {
            list.iter().enumerate().for_each(|(i, v)| numbers(v, &format!("{place}/{i}"), all));
        }
        Value::Object(map) => {
            map.iter().for_each(|(k, v)| numbers(v, &format!("{place}/{k}"), all))
        }
        _ => {}
    }
}

#[test]
fn the_figures_are_what_the_models_give() {
    let made: ModelFigures = model_figures::compute().unwrap();
    let (mut now, mut then) = (Vec::new(), Vec::new());
    numbers(&serde_json::to_value(&made).unwrap(), "", &mut now);
    numbers(&serde_json::from_str(&doc("figures/model.json")).unwrap(), "", &mut then);
    assert_eq!(now.len(), then.len(), "run `rig-study figures`");
    for ((place, a), (_, b)) in now.iter().zip(&then) {
        assert!((a / b - 1.0).abs() < 0.01, "{place}: {a}, recorded {b}; run `rig-study figures`");
    }

    // What the page says in words.
    let [first, pressed, fast] = &made.cases[..] else { panic!("three cases") };
    // The study's gap falls with preload, and so does ours; its force falls, ours rises.
    assert!(pressed.gap_mm < first.gap_mm && pressed.published_gap_mm < first.published_gap_mm);
    assert!(pressed.force_n > 1.1 * first.force_n);
    assert!(pressed.published_force_n < first.published_force_n);
    assert!(fast.stress_pa > first.stress_pa && pressed.stress_pa > first.stress_pa);
    for case in &made.cases {
        assert!(case.inertia_n < 0.5 && case.inertia_n < 0.1 * case.inertia_bound_n, "{case:?}");
        assert!(case.vibration_mm < 1e-3 && case.jump_pa < 1e-2 * case.stress_pa, "{case:?}");
    }
    assert!(made.rubbers.iter().all(|r| r.slow_ms < 0.15 && r.front_ms <= r.slow_ms));
    assert!((made.arm_hz[0] / made.published_hz[0] - 1.0).abs() < 1e-3);
}
