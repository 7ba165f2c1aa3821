//! `rig capture`, `rig replay`, `rig report`, `rig live`.

use hil_sim::scenario::Scenario;
use hil_sim::session;
use interstage::log::SCHEMA;
use serde_json::Value;

use crate::record::logs::{data, frames};

use super::{
    Folder, code, ends_with, folder, good_in, json, number, object, refused_in, rig_in, stderr,
    stdout,
};

/// A folder with these frames in `line.bin`.
fn line(frames: &[Vec<u8>]) -> Folder {
    let at = folder();
    std::fs::write(at.join("line.bin"), frames.concat()).expect("written");
    at
}

/// What `rig capture` is asked for there: files in `out`.
const CAPTURE: [&str; 6] = ["capture", "--stream", "line.bin", "--out", "out", "--json"];

#[test]
fn a_recorded_stream_becomes_files_that_give_the_same_bits() {
    let at = &line(&frames(&data("deploy.mcap")));
    let caught = object(&good_in(at, &CAPTURE));
    assert!(number(&caught, "ticks") > 4500.0);
    assert_eq!(number(&caught, "lost_frames"), 0.0);
    for log in ["out/log.mcap", "out/log.csv"] {
        let replayed = object(&good_in(at, &["replay", log, "--json"]));
        assert_eq!(replayed["equal"], true);
        assert_eq!(number(&replayed["logs"][0], "ticks"), number(&caught, "ticks"));
    }
}

#[test]
fn missing_frames_give_exit_code_1_and_a_mark_in_the_log() {
    let mut frames = frames(&data("deploy.mcap"));
    frames.remove(300);
    let at = &line(&frames);
    let caught = object(&ends_with(1, at, &CAPTURE));
    assert_eq!((number(&caught, "lost_frames"), number(&caught, "lost_ticks")), (1.0, 8.0));
    // Ticks behind the gap cannot be run again, and do not count as equal.
    let output = ends_with(1, at, &["replay", "out/log.mcap"]);
    assert!(stdout(&output).contains("1 frame lost"), "{}", stdout(&output));
}

#[test]
fn a_log_that_was_tampered_with_shows_its_first_difference() {
    let at = &line(&frames(&data("deploy.mcap")));
    good_in(at, &CAPTURE);
    let csv = at.join("out/log.csv");
    let table = std::fs::read_to_string(&csv).expect("readable");
    let mut lines: Vec<String> = table.lines().map(str::to_owned).collect();
    let column = lines[0].split(',').position(|name| name == "preload_code").expect("there");
    let mut cells: Vec<String> = lines[3001].split(',').map(str::to_owned).collect();
    let tick = cells[0].clone();
    let code_before: u16 = cells[column].parse().expect("a code");
    cells[column] = (code_before ^ 0x100).to_string();
    lines[3001] = cells.join(",");
    std::fs::write(&csv, lines.join("\n")).expect("written");
    let output = ends_with(1, at, &["replay", "out/log.csv"]);
    let text = stdout(&output);
    assert!(text.contains(&format!("differs at tick {tick} ")), "{text}");
    assert!(text.contains("sensing: preload_n was "), "{text}");
}

#[test]
fn a_log_has_its_report_and_two_logs_their_comparison() {
    let at = &folder();
    for (seed, name) in [("1", "a"), ("2", "b")] {
        good_in(at, &["deploy", "--seed", seed, "--out", name]);
    }
    let a = rig_in(at, &["report", "a/log.mcap", "--out", "page.html", "--json"]);
    assert_eq!(object(&a)["crossings"], json(&at.join("a/summary.json"))["crossings"]);
    let page = |name: &str| std::fs::read_to_string(at.join(name)).expect("a page");
    assert_eq!(page("page.html"), page("a/report.html"), "the page of the deployment itself");
    let shown = rig_in(at, &["report", "a/log.mcap", "b/log.mcap"]);
    let text = stdout(&shown);
    assert!(text.starts_with("A: Deployed ") && text.contains("\nB: Deployed "), "{text}");
    let both = rig_in(at, &["report", "a/log.mcap", "b/log.mcap", "--json"]);
    let differences = object(&both)["differences"].as_array().expect("a list").clone();
    let gap = differences.iter().find(|d| d["index"] == 2 && d["quantity"] == "gap").expect("gap");
    let change = number(gap, "b") - number(gap, "a");
    assert!(change != 0.0 && (number(gap, "change") - change).abs() < 1e-12);
    assert!(page("a/log.compare.html").contains("B - A"));
}

/// A kept log, which is not written again with the fixtures: its page has every crossing, and every
/// tick is run again. A change of what is in a frame changes `LAYOUT` in `src/log/identity.rs`.
#[test]
fn a_kept_log_is_shown_and_run_through_or_refused_by_the_number_of_its_layout() {
    let at = &folder();
    std::fs::copy(data("released/layout-9.mcap"), at.join("kept.mcap")).expect("copied");
    if SCHEMA != 9 {
        return refused_in(at, &["report", "kept.mcap"], &["kept.mcap", "frames of schema 9"]);
    }
    good_in(at, &["report", "kept.mcap"]);
    let page = std::fs::read_to_string(at.join("kept.html")).expect("a page");
    assert_eq!(page.matches("<h3>Crossing ").count(), 3);
    let replayed = &object(&rig_in(at, &["replay", "kept.mcap", "--json"]))["logs"][0];
    // Another controller than that of the log differs somewhere.
    assert!(replayed["equal"] == true || replayed["difference"].is_object(), "{replayed}");
}

/// A capture with resets of the board in it: every start has its own clock and its own page.
#[test]
fn a_log_with_resets_is_shown_start_by_start() {
    let at = &folder();
    std::fs::copy(data("resets-1.mcap"), at.join("log.mcap")).expect("copied");
    let found = object(&rig_in(at, &["report", "log.mcap", "--json"]));
    let starts = found["starts"].as_array().unwrap_or_else(|| panic!("{found}"));
    assert_eq!(starts.len(), 10);
    let crossings = |of: &Value| of["crossings"].as_array().expect("a list").clone();
    assert_eq!(starts.iter().map(|start| crossings(start).len()).sum::<usize>(), 7);
    for start in starts {
        let end = number(start, "total_s");
        let mut before = 0.0;
        for line in crossings(start) {
            let [touch, lift] = ["touch_s", "lift_s"].map(|key| number(&line, key));
            let first = touch.min(lift);
            assert!(before < first && touch.max(lift) < end, "{line} in a start of {end} s");
            assert!((touch - lift).abs() < 4.0, "{line}");
            before = touch.max(lift);
        }
    }
    let page = std::fs::read_to_string(at.join("log.html")).expect("a page");
    assert!(page.contains("10 starts of the controller"));
    let ends = ["Restarted after ", "; then a restart: ", "Ended by a restart: "];
    let said: usize = ends.iter().map(|text| page.matches(text).count()).sum();
    assert!(said == 9 && !page.contains(" - mm"), "{said}");
    assert!(page.contains("<h2>Start 10 of 10</h2>"));
    // The cause is the target's own word.
    let cause = starts[0]["restart"].as_str().expect("a cause");
    assert!(cause.contains("before: "), "{cause}");
    assert!(starts[9]["restart"].is_null());
    refused_in(at, &["report", "log.mcap", "log.mcap"], &["log.mcap: 10 starts"]);
    // An arrival that the log's lines alone still have, and a step whose figures never came.
    assert_eq!(starts[1]["completed"], true, "{}", starts[1]);
    let missing = starts[0]["missing"].to_string();
    assert!(starts[0]["completed"] == false && missing.contains("figures of 1 crossing"));
}

/// The log's line of a crossing and the ledger's have one lead.
#[test]
fn a_lead_has_one_meaning_on_a_page() {
    let at = &folder();
    let output = rig_in(at, &["deploy", "--out", "run", "--log", "--json"]);
    let (found, log) = (object(&output), stderr(&output));
    let mut logged = log.lines().filter(|line| line.contains("] crossing "));
    for line in found["crossings"].as_array().expect("a list") {
        let logged = logged.next().expect("a line of the crossing");
        let lead = format!("lead {:.2} s", number(line, "lead_time_s"));
        assert!(logged.contains(&lead), "{lead}: {logged}");
    }
}

#[test]
fn a_view_records_what_it_shows() {
    let at = &folder();
    let view = ["live", "--headless", "--fast", "--listen", "127.0.0.1:0", "--record", "kept"];
    let output = good_in(at, &[&view[..], &["--set", "tread.tau_s=0.11"]].concat());
    assert!(stdout(&output).contains("wrote kept/: log.mcap"), "{}", stdout(&output));
    let replayed = rig_in(at, &["replay", "kept/log.mcap", "kept/log.csv", "--json"]);
    let replayed = object(&replayed);
    assert_eq!(replayed["equal"], true, "{replayed}");
    assert!(number(&replayed["logs"][0], "ticks") > 4500.0);
}

#[test]
fn a_log_of_other_parameters_than_those_given_has_none_and_says_so() {
    let set = ["--set", "drive.cruise_speed_mm_s=20"];
    let scenario = Scenario::default().with(&[set[1].to_owned()]).expect("a scenario");
    let stream = session::run(&scenario, session::Options::ROWS).expect("a run").stream;
    let at = &line(&[stream]);
    let output = good_in(at, &["capture", "--stream", "line.bin", "--out", "without"]);
    assert!(stderr(&output).contains("runs with parameters"), "{}", stderr(&output));
    assert_eq!(code(&rig_in(at, &["replay", "without/log.mcap"])), 2);
    let given = ["capture", "--stream", "line.bin", "--out", "with", set[0], set[1]];
    let output = rig_in(at, &given);
    assert!(!stderr(&output).contains("runs with parameters"), "{}", stderr(&output));
    for log in ["with/log.mcap", "with/log.csv"] {
        good_in(at, &["replay", log]);
    }
}

#[test]
fn a_log_of_other_parameters_is_refused_until_they_are_given() {
    let at = &folder();
    let set = ["--set", "tread.tau_s=0.11"];
    good_in(at, &["capture", "--bare", "--out", ".", set[0], set[1]]);
    // A log that contains its parameters can be run again as it is.
    good_in(at, &["replay", "log.mcap"]);
    // The stream contains nothing but their hash.
    std::fs::write(at.join("line.bin"), frames(&at.join("log.mcap")).concat()).expect("written");
    refused_in(at, &["replay", "line.bin"], &["made with parameters"]);
    good_in(at, &["replay", "line.bin", set[0], set[1]]);
}
