//! `rig montecarlo`, `rig faults`, `rig compare`, `rig envelope`, and the parts of each.

use std::path::Path;
use std::process::Output;

use serde_json::Value;

use super::{
    code, folder, good, good_in, number, object, refused, refused_in, rig, rig_in, stderr, stdout,
};

fn campaign(more: &[&str]) -> Value {
    good(&[&["montecarlo", "--json"], more].concat())
}

#[test]
fn five_rigs_complete_with_every_key() {
    let all = campaign(&["-n", "5"]);
    assert_eq!((&all["runs"], &all["completed"]), (&Value::from(5), &Value::from(5)));
    assert!((1..=5).contains(&all["worst_gap_seed"].as_u64().unwrap()));
    assert!(all["slip_events"].is_u64() && all["faults"].is_array());
    assert_eq!(all["incomplete"], serde_json::json!([]));
    assert!(number(&all["duration_s"], "p50") <= number(&all["duration_s"], "max"));
    assert!(number(&all["moving_s"], "max") < number(&all["duration_s"], "max"));
    assert!(number(&all["gap_over_ref"], "p95") > 0.5);
    assert!(all["lead_time_s"]["seed"].is_u64() && all["slip_margin"]["seed"].is_u64());
}

#[test]
fn one_of_a_kind_is_singular() {
    let one = |arguments: &[&str]| stdout(&rig(arguments)).to_owned();
    let text = one(&["montecarlo", "-n", "1"]);
    assert!(text.starts_with("1 run of deploy, ") && !text.contains("1 runs"), "{text}");
    let text = one(&["faults", "-n", "1", "--only", "stalled"]);
    assert!(text.starts_with("2 faults at 1 instant each: "), "{text}");
    assert!(text.contains("in --table: latency_median_ms, undetected\n"), "{text}");
    assert!(one(&["faults", "--clean", "1"]).starts_with("1 deployment without a fault: 0 false"));
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
    assert!(text.contains("not found: seeds 1, 2\n"), "one line for one fault: {text}");
    assert!(text.contains("What limits it"), "{text}");
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
    // The controller's own sigma bears out where the runs ended.
    assert!((0.02..4.0).contains(&number(&all["end_off_sigmas"], "max")), "{all}");
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
    for key in ["duration_s", "moving_s", "worst_gap_mm", "least_slip_margin"] {
        assert!(entries.iter().all(|entry| number(entry, key) > 0.0), "{key}");
    }
    let table = rig(&["compare", "-n", "1", "--no-oracle"]);
    let text = stdout(&table);
    assert!(text.contains("reactive") && !text.contains("oracle"), "{text}");
    assert!(
        text.contains("mm within 0.2 %") && text.lines().all(|line| line.chars().count() <= 100)
    );
}

#[test]
fn the_envelope_writes_its_picture_and_every_key() {
    let at = &folder();
    let found = object(&good_in(at, &["envelope", "-n", "2x2", "--json"]));
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
    let scheduled = |known: bool, friction: f64, load_n: f64| {
        let at = |cell: &&Value| {
            (number(cell, "friction"), number(cell, "load_n")) == (friction, load_n)
                && (&cell["known"], &cell["controller"]) == (&known.into(), &"scheduled".into())
        };
        grid.iter().find(at).expect("a cell of the grid")
    };
    let is_good = |cell: &Value| cell["completed"] == true && number(cell, "slip_mm") <= 0.05;
    for known in [true, false] {
        // With much friction and no load; 30 N hold on no wheel with so little friction.
        assert!(is_good(scheduled(known, 1.3, 0.0)) && !is_good(scheduled(known, 0.6, 30.0)));
    }
    // Knowing it changes the run.
    let [known, unknown] = [true, false].map(|known| scheduled(known, 1.3, 0.0));
    assert_ne!(known["duration_s"], unknown["duration_s"]);
    for controller in ["scheduled", "constant", "limit", "reactive"] {
        for part in ["known", "unknown"] {
            assert!((0.0..=1.0).contains(&number(&found["area"][controller], part)));
        }
    }
    let missing = found["not_contained"].as_array().unwrap();
    assert_eq!(found["scheduled_contains_all"], missing.is_empty());
    assert_eq!(found["files"], serde_json::json!(["out/envelope/envelope.svg"]));
    let picture = std::fs::read_to_string(at.join("out/envelope/envelope.svg")).unwrap();
    for text in ["scheduled, known", "reactive", "% of the grid; seconds", ">0.6</text>"] {
        assert!(picture.contains(text), "{text}");
    }
}

/// Runs both halves of a campaign into files, and what one machine prints of it.
fn halves(at: &Path, command: &[&str]) -> [Output; 2] {
    let parts = ["1/2", "2/2"].map(|shard| {
        let output = rig_in(at, &[command, &["--json", "--shard", shard]].concat());
        let name = format!("{}.json", &shard[..1]);
        std::fs::write(at.join(&name), &output.stdout).expect("written");
        name
    });
    // In any order, as text and as JSON.
    [&["merge", &parts[1], &parts[0]][..], &["merge", &parts[0], &parts[1], "--json"]]
        .map(|merge| rig_in(at, merge))
}

#[test]
fn merged_parts_are_what_one_machine_prints_to_the_bit() {
    for command in [
        "montecarlo -n 8 --seed 7 --wide",
        "faults -n 2 --only runaway --only tick",
        "faults --clean 3",
        "stress --cases 16",
        "envelope -n 2x2 --no-files",
        "sweep --no-files --key drive.cruise_speed_mm_s=20,25,30",
        "compare -n 1 --no-oracle",
    ] {
        let at = &folder();
        let command: Vec<&str> = command.split(' ').collect();
        let [text, json] = halves(at, &command);
        let whole = rig_in(at, &command);
        assert_eq!(stdout(&text), stdout(&whole), "{command:?}: {}", stderr(&text));
        assert_eq!(code(&text), code(&whole), "{command:?}");
        let whole = rig_in(at, &[&command[..], &["--json"]].concat());
        assert_eq!(stdout(&json), stdout(&whole), "{command:?}");
        // The keys of a part are those of the whole, and its lines.
        let part = super::json(&at.join("1.json"));
        for key in object(&whole).as_object().unwrap().keys() {
            assert!(part.get(key).is_some(), "{command:?}: {key}");
        }
    }
}

#[test]
fn parts_that_do_not_fit_are_refused_and_a_missing_one_is_told() {
    let at = &folder();
    let run = ["montecarlo", "-n", "3", "--json", "--shard"];
    for (name, more) in
        [("a", &["1/3"][..]), ("b", &["2/3"]), ("other", &["2/3", "--set", "plant.mu=1.2"])]
    {
        let output = rig_in(at, &[&run[..], more].concat());
        std::fs::write(at.join(name), &output.stdout).unwrap();
    }
    std::fs::write(at.join("none"), "{}").unwrap();
    refused_in(at, &["merge", "a", "other"], &["other: ", "plant.mu=1.2", "montecarlo -n 3"]);
    refused_in(at, &["merge", "a", "a"], &["a: case 0", "another part"]);
    refused_in(at, &["merge", "none"], &["none: no part of a campaign"]);
    refused_in(at, &["merge", "nowhere"], &["nowhere: "]);
    let output = rig_in(at, &["merge", "a", "b"]);
    assert_eq!(code(&output), 1);
    assert!(stdout(&output).starts_with("Partial: 2 of 3 cases"), "{}", stdout(&output));
    let output = rig_in(at, &["merge", "a", "b", "--json"]);
    assert_eq!(object(&output)["partial"], serde_json::json!({ "done": 2, "of": 3 }));
}

#[test]
fn the_rows_of_a_campaign_are_written_as_a_table() {
    let at = &folder();
    let tables = ["--table", "runs.csv", "--table", "runs.html"];
    let output = rig_in(at, &[&["montecarlo", "-n", "2"][..], &tables].concat());
    assert!(
        stdout(&output).ends_with("wrote runs.csv\n  wrote runs.html\n"),
        "{}",
        stdout(&output)
    );
    let csv = std::fs::read_to_string(at.join("runs.csv")).unwrap();
    assert!(csv.starts_with("seed,completed,duration_s,") && csv.lines().count() == 3, "{csv}");
    let page = std::fs::read_to_string(at.join("runs.html")).unwrap();
    assert!(page.contains("<th>worst gap, mm</th>") && page.contains("<td>yes</td>"));
    refused(&["montecarlo", "-n", "2", "--table", "runs.txt"], &["--table", ".csv or .html"]);
}

/// Ends a campaign by Ctrl-C once it has begun, as a terminal does.
#[cfg(unix)]
fn interrupted(arguments: &[&str], after_s: u64) -> std::process::Output {
    let child = std::process::Command::new(env!("CARGO_BIN_EXE_rig"))
        .args(arguments)
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .expect("the command starts");
    std::thread::sleep(std::time::Duration::from_secs(after_s));
    let id = child.id().to_string();
    let interrupted = std::process::Command::new("kill").args(["-INT", &id]).status();
    assert!(interrupted.expect("kill").success());
    child.wait_with_output().expect("it ends")
}

#[cfg(unix)]
#[test]
fn ctrl_c_keeps_what_is_done_and_says_that_it_is_partial() {
    let output = interrupted(&["montecarlo", "-n", "1000000", "--json"], 4);
    assert_eq!(code(&output), 1, "{}", stderr(&output));
    let found = object(&output);
    let done = number(&found["partial"], "done");
    assert!((1.0..1e6).contains(&done) && number(&found["partial"], "of") == 1e6);
    assert_eq!(number(&found, "runs"), done);
    assert_eq!(found["campaign"]["lines"].as_array().expect("lines").len() as f64, done);
    // A comparison gives up the strategies under way: each has a thousand rigs.
    let output = interrupted(&["compare", "-n", "1000", "--json"], 1);
    assert_eq!(code(&output), 1);
    assert!(stderr(&output).contains("interrupted before the first of 4 cases"));
}
