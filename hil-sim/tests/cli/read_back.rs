//! What a log gives back: the same by table and by MCAP, what was measured where nothing is
//! known to be true, and how much of it is missing.

use std::collections::BTreeSet;
use std::path::Path;

use serde_json::Value;

use super::{ends_with, folder, good_in, number, object, refused_in, stdout};

/// The parameters that `rig identify` finds in a log: name; value, low and high end.
fn identified(at: &Path, log: &str) -> Vec<(String, [Option<f64>; 3])> {
    let found = object(&good_in(at, &["identify", log, "--json"]));
    let all = found["parameters"].as_array().expect("a list").clone();
    let of = |p: &Value| ["value", "low", "high"].map(|key| p[key].as_f64());
    let name = |p: &Value| p["name"].as_str().expect("a name").to_owned();
    all.iter().map(|p| (name(p), of(p))).collect()
}

#[test]
fn table_and_mcap_of_a_run_identify_the_same_rig() {
    let at = &folder();
    good_in(at, &["deploy", "--rig", "fe", "--seed", "2", "--out", "deployed"]);
    good_in(at, &["capture", "--rig", "fe", "--seed", "2", "--out", "captured"]);
    good_in(at, &["deploy", "--retract", "--out", "back"]);
    for run in ["deployed", "captured", "back"] {
        let [table, mcap] =
            ["csv", "mcap"].map(|ending| identified(at, &format!("{run}/log.{ending}")));
        assert!(table.len() > 15, "{run}");
        assert_eq!(table, mcap, "{run}");
    }
}

#[test]
fn a_table_without_its_parameters_is_refused_until_they_are_given() {
    let at = &folder();
    good_in(at, &["deploy", "--rig", "fe", "--out", "run"]);
    std::fs::copy(at.join("run/log.csv"), at.join("alone.csv")).unwrap();
    refused_in(at, &["identify", "alone.csv"], &["alone.csv", "--rig"]);
    refused_in(at, &["replay", "alone.csv"], &["alone.csv", "--set"]);
    refused_in(at, &["report", "alone.csv"], &["alone.csv", "log.mcap"]);
    let given = object(&good_in(at, &["identify", "alone.csv", "--rig", "fe", "--json"]));
    let known = object(&good_in(at, &["identify", "run/log.mcap", "--json"]));
    assert_eq!(given["parameters"], known["parameters"]);
}

#[test]
fn a_captured_log_reports_what_was_measured_and_calls_nothing_true() {
    let at = &folder();
    good_in(at, &["capture", "--seed", "4", "--out", "."]);
    good_in(at, &["deploy", "--seed", "4", "--out", "real"]);
    let output = good_in(at, &["report", "log.mcap", "--out", "page.html"]);
    let text = stdout(&output).split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(text.contains("worst measured gap 2."), "{text}");
    assert!(text.contains("the reference of 2.663 mm"), "{text}");
    assert!(text.contains("measured slip"), "{text}");
    assert!(!text.contains("gross slip"), "{text}");
    let page = std::fs::read_to_string(at.join("page.html")).unwrap();
    assert!(page.contains("orst measured gap 2."));
    for word in [">true<", ">gap, true<", "true value", "gross slip", "Gross slip"] {
        assert!(!page.contains(word), "{word}");
    }
    let measured = object(&good_in(at, &["report", "log.mcap", "--json"]));
    let truth = object(&good_in(at, &["report", "real/log.mcap", "--json"]));
    assert_eq!((&measured["measured"], &truth["measured"]), (&true.into(), &false.into()));
    assert_eq!(measured["completed"], true);
    let off = number(&measured, "max_gap_mm") / number(&truth, "max_gap_mm") - 1.0;
    assert!(off != 0.0 && off.abs() < 0.05, "{off}");
    let off = number(&measured, "gap_ref_mm") / number(&truth, "gap_ref_mm") - 1.0;
    assert!(off.abs() < 1e-3, "{off}");
}

/// The first tenths of a file.
fn cut(at: &Path, file: &str, tenths: usize, to: &str) {
    let bytes = std::fs::read(at.join(file)).unwrap();
    std::fs::write(at.join(to), &bytes[..bytes.len() * tenths / 10]).unwrap();
}

#[test]
fn a_truncated_log_says_how_much_is_missing_and_ends_with_one() {
    let at = &folder();
    good_in(at, &["deploy", "--out", "run"]);
    good_in(at, &["capture", "--out", "caught"]);
    let ticks = Value::from(
        1000.0 * number(&object(&good_in(at, &["report", "run/log.mcap", "--json"])), "total_s"),
    );
    for (log, to) in [("run/log.mcap", "run.mcap"), ("caught/log.mcap", "caught.mcap")] {
        cut(at, log, 6, to);
        for verb in ["replay", "report"] {
            let output = ends_with(1, at, &[verb, to]);
            let text = stdout(&output);
            assert!(text.contains("cut off"), "{verb} {to}: {text}");
        }
        let replayed = object(&ends_with(1, at, &["replay", to, "--json"]));
        let log = &replayed["logs"][0];
        assert_eq!(log["equal"], false, "{log}");
        assert!(log["cut"]["at_s"].as_f64().unwrap() > 0.5, "{log}");
    }
    // A deployment states its number of ticks at the beginning of its log.
    let replayed = object(&ends_with(1, at, &["replay", "run.mcap", "--json"]));
    let log = &replayed["logs"][0];
    let (ran, missing) = (number(log, "ticks"), log["cut"]["missing_ticks"].as_f64().unwrap());
    assert!((ran + missing - ticks.as_f64().unwrap()).abs() < 1.5, "{log} of {ticks}");
    // A table ends within a row, or its metadata state more rows than it has.
    let table = std::fs::read_to_string(at.join("run/log.csv")).unwrap();
    for rows in [2000, 4001] {
        let rest: Vec<&str> = table.lines().take(rows).collect();
        std::fs::write(at.join("run/log.csv"), rest.join("\n") + "\n").unwrap();
        let output = ends_with(1, at, &["replay", "run/log.csv"]);
        assert!(stdout(&output).contains("cut off"), "{}", stdout(&output));
    }
}

#[test]
fn columns_have_no_sentinels_and_modes_and_stages_their_names() {
    let at = &folder();
    good_in(at, &["deploy", "--out", "."]);
    let mut table = csv::Reader::from_path(at.join("log.csv")).unwrap();
    let head = table.headers().unwrap().clone();
    let rows: Vec<csv::StringRecord> = table.records().map(Result::unwrap).collect();
    let column = |name: &str| {
        let place = head.iter().position(|other| other == name).unwrap_or_else(|| panic!("{name}"));
        rows.iter().map(move |row| row[place].to_owned())
    };
    let modes: BTreeSet<String> = column("mode").collect();
    for mode in ["idle", "cruise", "crossing", "complete"] {
        assert!(modes.contains(mode), "{mode} in {modes:?}");
    }
    let stages: BTreeSet<String> = column("stage").collect();
    for stage in ["static friction", "sliding", "rolling", "continuous"] {
        assert!(stages.contains(stage), "{stage} in {stages:?}");
    }
    let known = column("distance_mm").map(|text| text.parse::<f64>().unwrap_or(f64::NAN));
    let (most, nan) = known.fold((0.0_f64, 0), |(most, nan), value| {
        if value.is_nan() { (most, nan + 1) } else { (most.max(value), nan) }
    });
    assert!(most < 100.0 && nan > 10, "{most} mm, {nan} unknown");
    // 14 bits, and continuous: no jump by the parity bit.
    let codes: Vec<i32> = column("arm_angle_code").filter_map(|text| text.parse().ok()).collect();
    assert!(codes.len() > 3000 && codes.iter().all(|code| (0..1 << 14).contains(code)));
    assert!(codes.windows(2).all(|pair| (pair[0] - pair[1]).abs() < 100));
    good_in(at, &["replay", "log.csv", "log.mcap"]);

    let bytes = std::fs::read(at.join("log.mcap")).unwrap();
    let mut topics = BTreeSet::new();
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        let message = message.unwrap();
        let channel = message.channel;
        let schema = channel.schema.as_ref().unwrap_or_else(|| panic!("{}", channel.topic));
        let viewable = matches!(
            (&*channel.message_encoding, &*schema.encoding),
            ("json", "jsonschema") | ("protobuf", "protobuf")
        );
        assert!(viewable, "{}", channel.topic);
        if channel.topic == "/tick" && topics.insert(channel.topic.clone()) {
            let described: Value = serde_json::from_slice(&schema.data).unwrap();
            let body: Value = serde_json::from_slice(&message.data).unwrap();
            for (name, some) in [("mode", "crossing"), ("stage", "rolling")] {
                let names = described["properties"][name]["enum"].as_array().unwrap();
                assert!(names.contains(&some.into()) && names.contains(&body[name]), "{names:?}");
            }
        }
    }
    assert!(topics.contains("/tick"));
}
