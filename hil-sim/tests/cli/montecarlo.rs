//! `rig montecarlo`.

use serde_json::Value;

use super::{code, good, number, rig, said};

fn campaign(more: &[&str]) -> Value {
    good(&[&["montecarlo", "--json"], more].concat())
}

#[test]
fn four_rigs_complete_with_every_key() {
    let outcome = campaign(&["-n", "4"]);
    assert_eq!((&outcome["runs"], &outcome["completed"]), (&Value::from(4), &Value::from(4)));
    assert!((1..=4).contains(&outcome["worst_gap_seed"].as_u64().unwrap()));
    assert!(outcome["slip_events"].is_u64() && outcome["faults"].is_array());
    assert_eq!(outcome["incomplete"], serde_json::json!([]));
    assert!(number(&outcome["duration_s"], "p50") <= number(&outcome["duration_s"], "max"));
    assert!(number(&outcome["gap_over_ref"], "p95") > 0.5);
    assert!(outcome["lead_time_s"]["seed"].is_u64() && outcome["slip_margin"]["seed"].is_u64());
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
fn the_shards_are_the_whole() {
    let whole = campaign(&["-n", "5"]);
    let shards =
        [campaign(&["-n", "5", "--shard", "1/2"]), campaign(&["-n", "5", "--shard", "2/2"])];
    let sum = |key: &str| shards.iter().map(|shard| number(shard, key)).sum::<f64>();
    for key in ["runs", "completed", "slip_events"] {
        assert_eq!(sum(key), number(&whole, key), "{key}");
    }
    assert_eq!(number(&shards[0], "runs"), 3.0);
    let worst = shards.iter().map(|shard| number(shard, "worst_gap_mm")).fold(0.0, f64::max);
    assert_eq!(worst, number(&whole, "worst_gap_mm"));
}

#[test]
fn rigs_that_do_not_complete_are_named() {
    let output = rig(&["montecarlo", "-n", "2", "--set", "plant.mu=0.05"]);
    assert_eq!(code(&output), 1);
    let text = said(&output);
    assert!(text.contains("0 completed") && text.contains("incomplete: seeds 1, 2"), "{text}");
    assert!(text.contains("What limits it"), "{text}");
}
