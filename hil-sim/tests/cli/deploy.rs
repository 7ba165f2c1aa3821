//! `rig deploy`.

use std::path::Path;

use serde_json::Value;

use super::{folder, good_in, is_empty, json, number, object, stdout};

/// Keys of the summary that others rely on.
const KEYS: &str = "completed target controller seed duration_s moving_s travel_mm max_gap_mm \
    slip_mm faults real_time_factor trace_digest crossings";

/// The same of each crossing.
const CROSSING_KEYS: &str = "index speed_mm_s preload_n gap_mm gap_predicted_mm gap_measured_mm \
    corner_force_n lead_time_s limited_by slip_mm";

const FILES: &str = "report.html log.mcap log.csv log.csv-metadata.json summary.json overview.svg";

fn assert_keys(value: &Value, keys: &str) {
    for key in keys.split_whitespace() {
        assert!(value.get(key).is_some(), "{key} is missing in {value}");
    }
}

#[test]
fn writes_its_files_and_prints_every_key() {
    let at = &folder();
    let summary = object(&good_in(at, &["deploy", "--json"]));
    assert_keys(&summary, KEYS);
    assert_eq!(summary["completed"], true);
    assert_eq!((&summary["target"], &summary["seed"]), (&Value::from("sil"), &Value::from(0)));
    let crossings = summary["crossings"].as_array().unwrap();
    assert_eq!(crossings.len(), 3);
    assert!(number(&summary, "duration_s") > number(&summary, "moving_s"));
    for crossing in crossings {
        assert_keys(crossing, CROSSING_KEYS);
    }
    let files = summary["files"].as_array().unwrap();
    assert_eq!(files.len(), 6);
    let run = Path::new("out/deploy-prototype-scheduled-0");
    for name in FILES.split(' ') {
        let file = run.join(name);
        assert!(files.contains(&Value::from(file.to_str().unwrap())), "{name}");
        assert!(at.join(&file).metadata().unwrap().len() > 100, "{name}");
    }
    let written = json(&at.join(run).join("summary.json"));
    assert_eq!(written["trace_digest"], summary["trace_digest"]);
}

#[test]
fn files_go_to_the_given_directory_and_a_table_is_printed() {
    let at = &folder();
    let output = good_in(at, &["deploy", "--out", "mine/run"]);
    let text = stdout(&output);
    assert!(text.starts_with("Deployed ") && text.contains("  good: every gap "), "{text}");
    assert!(text.contains("  wrote mine/run/:\n    report.html, log.csv, "), "{text}");
    assert!(text.lines().all(|line| line.chars().count() <= 80), "{text}");
    assert!(at.join("mine/run/log.csv").is_file());
    assert!(!at.join("out").exists());
}

#[test]
fn a_retraction_without_files_completes_and_writes_nothing() {
    let at = &folder();
    let summary = object(&good_in(at, &["deploy", "--retract", "--no-files", "--json"]));
    assert_keys(&summary, KEYS);
    assert_eq!((&summary["direction"], &summary["completed"]), (&"retract".into(), &true.into()));
    assert_eq!(summary["files"], serde_json::json!([]));
    let steps = summary["crossings"].as_array().unwrap().iter().map(|c| c["index"].as_i64());
    assert_eq!(steps.collect::<Vec<_>>(), [Some(3), Some(2), Some(1)]);
    assert!(is_empty(at));
}

#[test]
fn a_scenario_file_is_taken_in_either_place() {
    let at = &folder();
    let path = at.join("bench.toml");
    std::fs::write(&path, "[run]\nseed = 5\ncontroller = \"limit\"\n").unwrap();
    let run =
        |arguments: &[&str]| object(&good_in(at, &[&["deploy", "--json"], arguments].concat()));
    let named = run(&["--scenario", "bench.toml", "--no-files"]);
    assert_eq!((&named["seed"], &named["controller"]), (&Value::from(5), &Value::from("limit")));
    let plain = run(&["bench.toml"]);
    assert_eq!(plain["trace_digest"], named["trace_digest"]);
    assert!(at.join("out/deploy-bench-limit-5/report.html").is_file());
}
