//! A run's files say what the run was, and no run takes another one's place unasked.

use std::path::PathBuf;

use serde_json::Value;

use super::{ends_with, folder, good_in, json, number, object, refused_in, rig_in, stderr, stdout};

/// Where a command wrote the file of this name.
fn wrote(found: &Value, name: &str) -> PathBuf {
    let files = found["files"].as_array().expect("files").iter();
    let mut paths = files.map(|file| PathBuf::from(file.as_str().expect("a path")));
    paths.find(|path| path.ends_with(name)).unwrap_or_else(|| panic!("{name}: {found}"))
}

#[test]
fn folder_banner_and_summary_carry_overrides_draw_and_version() {
    let at = &folder();
    let arguments =
        ["deploy", "--seed", "3", "--set", "tread.tau_s=0.2", "--set", "preload.limit_n=52"];
    let output = good_in(at, &arguments);
    let text = stdout(&output).replace("\n  ", " ");
    assert!(text.contains("seed 3, preload.limit_n = 52, tread.tau_s = 0.2"), "{text}");
    let folder = at.join("out/deploy-prototype-scheduled-3-preload.limit_n=52-tread.tau_s=0.2");
    let summary = json(&folder.join("summary.json"));
    assert_eq!(number(&summary["overrides"], "tread.tau_s"), 0.2);
    assert_eq!(number(&summary["overrides"], "preload.limit_n"), 52.0);
    assert_eq!(summary["overrides"].as_object().unwrap().len(), 2, "{}", summary["overrides"]);
    assert_eq!(summary["version"], env!("CARGO_PKG_VERSION"));
    // The seed's draw is near its nominal value, and not on it.
    let tau = number(&summary["drawn"], "tread.tau_s");
    assert!(tau != 0.2 && (tau / 0.2 - 1.0).abs() < 0.5, "{tau}");
    assert!(number(&summary["drawn"], "plant.mu") > 0.5);
    let page = std::fs::read_to_string(folder.join("report.html")).unwrap();
    assert!(page.contains("tread.tau_s = 0.2"));
}

#[test]
fn another_run_keeps_its_folder() {
    let at = &folder();
    let file = at.join("bench.toml");
    std::fs::write(&file, "[tread]\ntau_s = 0.2\n").unwrap();
    let first = object(&good_in(at, &["deploy", "bench.toml", "--json"]));
    let again = object(&good_in(at, &["deploy", "bench.toml", "--json"]));
    assert_eq!(first["files"], again["files"], "the same run");
    // The same name, another run.
    std::fs::write(&file, "[tread]\ntau_s = 0.21\n").unwrap();
    let other = object(&good_in(at, &["deploy", "bench.toml", "--json"]));
    assert_ne!(wrote(&first, "summary.json"), wrote(&other, "summary.json"));
    let digest =
        |found: &Value| json(&at.join(wrote(found, "summary.json")))["trace_digest"].clone();
    assert_eq!(digest(&first), first["trace_digest"]);
    assert_eq!(digest(&other), other["trace_digest"]);
    // Who names the folder gets it, and is told.
    good_in(at, &["deploy", "--out", "mine"]);
    let output = good_in(at, &["deploy", "--seed", "2", "--out", "mine"]);
    assert!(stderr(&output).contains("mine: replaces"), "{}", stderr(&output));
}

#[test]
fn comparisons_captures_and_identifications_keep_what_is_there() {
    let at = &folder();
    for (seed, name) in [("1", "a"), ("2", "b"), ("3", "c")] {
        good_in(at, &["deploy", "--seed", seed, "--out", name]);
    }
    let compared = |other: &str| {
        let found = object(&good_in(at, &["report", "a/log.mcap", other, "--json"]));
        at.join(found["files"][0].as_str().unwrap())
    };
    let (b, c) = (compared("b/log.mcap"), compared("c/log.mcap"));
    assert_ne!(b, c);
    assert!(std::fs::read_to_string(&b).unwrap().contains("b/log.mcap"));
    assert_eq!(compared("b/log.mcap"), b, "the same page");

    let identified = |log: &str| {
        let found = object(&good_in(at, &["identify", log, "--json"]));
        at.join(wrote(&found, "identified.toml"))
    };
    let (a, b) = (identified("a/log.mcap"), identified("b/log.mcap"));
    assert_ne!(a, b);
    assert!(std::fs::read_to_string(&a).unwrap().contains("a/log.mcap"), "its log is named");
    assert_eq!(identified("a/log.mcap"), a, "the same result");

    let caught = |arguments: &[&str]| {
        let output = good_in(at, &[&["capture", "--json"], arguments].concat());
        at.join(wrote(&object(&output), "log.mcap").parent().unwrap())
    };
    let first = caught(&["--seed", "1"]);
    let bytes = std::fs::read(first.join("log.mcap")).unwrap();
    good_in(at, &["capture", "--seed", "2"]);
    assert!(bytes == std::fs::read(first.join("log.mcap")).unwrap(), "the first capture");
    refused_in(at, &["capture", "--name", "log"], &["log.mcap", "--name"]);
}

#[test]
fn no_command_writes_over_what_it_reads() {
    let at = &folder();
    good_in(at, &["deploy", "--out", "run"]);
    std::fs::copy(at.join("run/log.mcap"), at.join("other.mcap")).unwrap();
    let log = std::fs::read(at.join("other.mcap")).unwrap();
    for arguments in [
        "report other.mcap --out other.mcap",
        "report run/log.mcap other.mcap --out other.mcap",
        "report run/log.mcap other.mcap --out page.html --picture ./other.mcap",
    ] {
        let arguments: Vec<&str> = arguments.split(' ').collect();
        refused_in(at, &arguments, &["other.mcap", "is read by this command"]);
        assert!(log == std::fs::read(at.join("other.mcap")).unwrap(), "{arguments:?}");
    }
    good_in(at, &["params", "restore", "--file", "set.bin"]);
    let set = std::fs::read(at.join("set.bin")).unwrap();
    refused_in(at, &["params", "save", "set.bin", "--file", "set.bin"], &["save set.bin"]);
    for key in ["mismatch.friction=0.9", "spread.mu_rel=0.1", "run.seed=3"] {
        refused_in(at, &["params", "set", key, "--file", "set.bin"], &[key, "what a board holds"]);
    }
    assert_eq!(set, std::fs::read(at.join("set.bin")).unwrap());
    let known = "identified.toml";
    std::fs::write(at.join(known), "[plant]\nmu = 0.9\n").unwrap();
    for file in [known, "other.mcap"] {
        let before = std::fs::read(at.join(file)).unwrap();
        refused_in(at, &["params", "restore", known, "--file", file], &[file, "set"]);
        assert!(before == std::fs::read(at.join(file)).unwrap(), "{file}");
    }
    let again = ["identify", "other.mcap", "--scenario", known, "--out", "."];
    refused_in(at, &again, &[known, "is read by this command"]);
    // A page does not replace what is no page, nor a scenario what is no scenario.
    refused_in(at, &["report", "run", "--out", "run/summary.json"], &["run/summary.json", ".html"]);
    refused_in(at, &["params", "save", "other.mcap", "--file", "set.bin"], &["save other.mcap"]);
    assert!(log == std::fs::read(at.join("other.mcap")).unwrap());
    // A folder stands for the log in it.
    let page = good_in(at, &["report", "run", "--json"]);
    assert!(at.join("run/log.html").is_file(), "{}", stdout(&page));
    refused_in(at, &["report", "."], &["./log.mcap: No such file"]);
}

#[test]
fn a_run_without_a_crossing_has_no_gap() {
    let at = &folder();
    // The first step is a wall to a wheel without grip: the run does not complete.
    let ice = ["deploy", "--set", "plant.mu=0.05", "--out", "ice"];
    let output = ends_with(1, at, &ice);
    let text = stdout(&output);
    assert!(text.contains("no crossing, so no gap"), "{text}");
    assert!(!text.contains("below the reference"), "{text}");
    let summary = json(&at.join("ice/summary.json"));
    assert_eq!(summary["completed"], false);
    assert_eq!(summary["max_gap_mm"], Value::Null);
    assert_eq!(summary["crossings"], Value::Array(vec![]));
    // The log gives the same back.
    let read = object(&rig_in(at, &["report", "ice/log.mcap", "--json"]));
    assert_eq!(read["trace_digest"], summary["trace_digest"]);
    assert!(read["max_gap_mm"].is_null());
}
