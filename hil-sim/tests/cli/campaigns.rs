//! `rig montecarlo`, `rig faults`, `rig compare` and `rig envelope`.

use serde_json::Value;

use super::{code, good, number, object, refused, rig, rig_in, stdout};

fn campaign(more: &[&str]) -> Value {
    good(&[&["montecarlo", "--json"], more].concat())
}

#[test]
fn five_rigs_complete_with_every_key_and_the_shards_are_the_whole() {
    let all = campaign(&["-n", "5"]);
    assert_eq!((&all["runs"], &all["completed"]), (&Value::from(5), &Value::from(5)));
    assert!((1..=5).contains(&all["worst_gap_seed"].as_u64().unwrap()));
    assert!(all["slip_events"].is_u64() && all["faults"].is_array());
    assert_eq!(all["incomplete"], serde_json::json!([]));
    assert!(number(&all["duration_s"], "p50") <= number(&all["duration_s"], "max"));
    assert!(number(&all["moving_s"], "max") < number(&all["duration_s"], "max"));
    assert!(number(&all["gap_over_ref"], "p95") > 0.5);
    assert!(all["lead_time_s"]["seed"].is_u64() && all["slip_margin"]["seed"].is_u64());
    let shards = ["1/2", "2/2"].map(|shard| campaign(&["-n", "5", "--shard", shard]));
    let sum = |key: &str| shards.iter().map(|shard| number(shard, key)).sum::<f64>();
    for key in ["runs", "completed", "slip_events"] {
        assert_eq!(sum(key), number(&all, key), "{key}");
    }
    assert_eq!(number(&shards[0], "runs"), 3.0);
    let worst = shards.iter().map(|shard| number(shard, "worst_gap_mm")).fold(0.0, f64::max);
    assert_eq!(worst, number(&all, "worst_gap_mm"));
}

#[test]
fn the_worst_run_can_be_repeated() {
    let outcome = campaign(&["-n", "2", "--seed", "40"]);
    let seed = outcome["worst_gap_seed"].as_u64().unwrap();
    assert!([41, 42].contains(&seed));
    let run = good(&["deploy", "--json", "--no-files", "--seed", &seed.to_string()]);
    assert_eq!(run["max_gap_mm"], outcome["worst_gap_mm"]);
}

#[test]
fn rigs_that_do_not_complete_are_named() {
    let output = rig(&["montecarlo", "-n", "2", "--set", "plant.mu=0.05"]);
    assert_eq!(code(&output), 1);
    let text = stdout(&output);
    assert!(text.contains("0 completed") && text.contains("incomplete: seeds 1, 2"), "{text}");
    assert!(text.contains("What limits it"), "{text}");
}

#[test]
fn the_parts_of_a_fault_campaign_are_the_whole() {
    let some = ["faults", "--json", "-n", "2", "--only", "runaway", "--only", "tick"];
    let all = good(&some);
    assert_eq!((&all["undetected"], &all["unsafe"]), (&0.into(), &0.into()));
    let lines = |run: &Value| run["matrix"].as_array().expect("lines").clone();
    let [first, second] =
        ["1/2", "2/2"].map(|part| lines(&good(&[&some[..], &["--shard", part]].concat())));
    assert_eq!((first.len(), second.len()), (2, 1));
    assert_eq!([first[0].clone(), second[0].clone(), first[1].clone()].to_vec(), lines(&all));
}

#[test]
fn a_wide_campaign_names_what_it_drew_and_where_it_ended() {
    let output = rig(&["montecarlo", "-n", "2", "--wide", "--json"]);
    let all: Value = serde_json::from_str(stdout(&output)).expect("one object");
    let drawn = all["drawn"].as_array().expect("what was drawn");
    let friction = drawn.iter().find(|one| one["key"] == "mismatch.friction").expect("friction");
    assert!((0.9..1.1).contains(&number(friction, "least")));
    assert!(number(friction, "least") < number(friction, "most"));
    assert!(all["silent"].is_array() && all["later_gap_over_ref"]["p99"].is_number());
    assert!(all["first_gap_over_ref"]["max"].is_number() && all["end_off_mm"]["max"].is_number());
    let steps = all["steps_found"].as_array().expect("steps");
    assert!(steps.iter().all(|step| step["index"].is_u64() && step["p95"].is_number()));
    // What is stated and not neutral is not drawn; without --wide nothing is.
    let stated = rig(&["montecarlo", "-n", "1", "--set", "mismatch.weight_n=1", "--json"]);
    let stated: Value = serde_json::from_str(stdout(&stated)).expect("one object");
    assert_eq!(stated["drawn"].as_array().expect("one").len(), 1);
    assert_eq!(stated["drawn"][0]["key"], "mismatch.weight_n");
}

#[test]
fn the_comparison_has_every_strategy_and_the_oracle() {
    let compared = good(&["compare", "-n", "1", "--json"]);
    assert_eq!(compared["runs"], 1);
    let entries = compared["entries"].as_array().unwrap();
    let names: Vec<&str> = entries.iter().map(|e| e["controller"].as_str().unwrap()).collect();
    assert_eq!(names, ["scheduled", "constant", "limit", "reactive", "oracle"]);
    for entry in entries {
        assert!(number(entry, "duration_s") > number(entry, "moving_s"), "{entry}");
        assert!(number(entry, "worst_gap_mm") > 1.0 && number(entry, "least_slip_margin") > 0.0);
        assert_eq!((&entry["slip_events"], &entry["incomplete"]), (&0.into(), &0.into()));
    }
    let [scheduled, .., oracle] = &entries[..] else { panic!("{compared}") };
    assert!(number(oracle, "duration_s") < number(scheduled, "duration_s"));
    assert!(number(oracle, "worst_gap_mm") <= number(scheduled, "worst_gap_mm"));
    let table = rig(&["compare", "-n", "1", "--no-oracle"]);
    let text = stdout(&table);
    assert!(text.contains("reactive") && !text.contains("oracle"), "{text}");
    assert!(text.contains("command s") && text.lines().all(|line| line.chars().count() <= 100));
}

#[test]
fn the_envelope_writes_its_picture_and_every_key() {
    let directory = tempfile::tempdir().unwrap();
    let output = rig_in(directory.path(), &["envelope", "-n", "2x2", "--json"]);
    assert_eq!(code(&output), 0);
    let found = object(&output);
    let grid = found["grid"].as_array().unwrap();
    assert_eq!(grid.len(), 2 * 2 * 2 * 4);
    for cell in grid {
        assert!([0.6, 1.3].contains(&number(cell, "friction")), "{cell}");
        assert!([0.0, 30.0].contains(&number(cell, "load_n")), "{cell}");
        assert!(cell["known"].is_boolean() && cell["controller"].is_string());
        let completed = cell["completed"].as_bool().unwrap();
        assert!(number(cell, "slip_mm") >= 0.0);
        assert_eq!(cell["duration_s"].is_number(), completed, "{cell}");
    }
    for controller in ["scheduled", "constant", "limit", "reactive"] {
        for part in ["known", "unknown"] {
            assert!((0.0..=1.0).contains(&number(&found["area"][controller], part)));
        }
    }
    let missing = found["not_contained"].as_array().unwrap();
    assert_eq!(found["scheduled_contains_all"], missing.is_empty());
    assert_eq!(found["files"], serde_json::json!(["out/envelope/envelope.svg"]));
    let picture = directory.path().join("out/envelope/envelope.svg");
    assert!(std::fs::read_to_string(picture).unwrap().contains("scheduled, known"));
}

#[test]
fn a_grid_that_is_none_is_refused() {
    for text in ["8", "1x7", "a x b"] {
        refused(&["envelope", "-n", text], &["-n", text, "8x7"]);
    }
}
