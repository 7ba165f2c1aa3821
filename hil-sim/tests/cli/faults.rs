//! `rig faults`.

use super::{code, good, rig};

/// What it said of an error.
fn complaint(arguments: &[&str]) -> String {
    let output = rig(arguments);
    assert_eq!(code(&output), 2, "{output:?}");
    String::from_utf8(output.stderr).expect("text")
}

#[test]
fn a_campaign_has_its_keys_and_goes_on_where_it_was_broken_off() {
    let directory = tempfile::tempdir().expect("a directory");
    let file = directory.path().join("kept.jsonl");
    let file = file.to_str().expect("a path");
    let some = ["faults", "--json", "-n", "2", "--only", "runaway", "--only", "tick"];
    let whole = good(&some);
    assert_eq!((&whole["undetected"], &whole["unsafe"]), (&0.into(), &0.into()));
    assert_eq!(whole["matrix"].as_array().expect("lines").len(), 3);
    good(&["faults", "--json", "-n", "2", "--only", "tick", "--keep", file]);
    assert_eq!(good(&[&some[..], &["--keep", file]].concat()), whole);
    let text = std::fs::read_to_string(file).expect("a file");
    assert_eq!(text.lines().count(), 4);
    // A campaign of another number of instants does not go on from it, nor change it.
    let other = complaint(&["faults", "-n", "3", "--only", "tick", "--keep", file]);
    assert!(other.contains("kept.jsonl: is of a campaign with another -n"), "{other}");
    assert_eq!(std::fs::read_to_string(file).expect("a file"), text);
}

#[test]
fn what_cannot_be_asked_for_is_refused_in_words() {
    let no = complaint(&["faults", "--only", "gremlin"]);
    assert!(no.contains("--only gremlin: no such fault") && no.contains("load-cell stuck"), "{no}");
    // A part of the campaign is no table of all of it.
    let part = complaint(&["faults", "--only", "tick", "--write-docs"]);
    assert!(part.contains("--write-docs") && part.contains("--only"), "{part}");
}
