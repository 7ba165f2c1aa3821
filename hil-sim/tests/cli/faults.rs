//! `rig faults`.

use super::{code, good, rig};
use serde_json::Value;

/// What it said of an error.
fn complaint(arguments: &[&str]) -> String {
    let output = rig(arguments);
    assert_eq!(code(&output), 2, "{output:?}");
    String::from_utf8(output.stderr).expect("text")
}

#[test]
fn a_campaign_has_its_keys_and_its_parts_are_the_whole() {
    let some = ["faults", "--json", "-n", "2", "--only", "runaway", "--only", "tick"];
    let whole = good(&some);
    assert_eq!((&whole["undetected"], &whole["unsafe"]), (&0.into(), &0.into()));
    let lines = |run: &Value| run["matrix"].as_array().expect("lines").clone();
    let [first, second] =
        ["1/2", "2/2"].map(|part| lines(&good(&[&some[..], &["--shard", part]].concat())));
    assert_eq!((first.len(), second.len()), (2, 1));
    assert_eq!([first[0].clone(), second[0].clone(), first[1].clone()].to_vec(), lines(&whole));
}

#[test]
fn what_cannot_be_asked_for_is_refused_in_words() {
    let no = complaint(&["faults", "--only", "gremlin"]);
    assert!(
        no.contains("--only gremlin: no such fault") && no.contains("preload-sensor stuck"),
        "{no}"
    );
}
