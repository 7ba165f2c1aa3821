//! What cannot be run as asked: exit code 2, one line that names it, no files.

use std::path::Path;

use super::{code, is_empty, rig_in};

/// Runs the command and expects it to refuse, naming each of `names`.
fn refused_in(directory: &Path, arguments: &[&str], names: &[&str]) {
    let output = rig_in(directory, arguments);
    let text = String::from_utf8(output.stderr.clone()).unwrap();
    assert_eq!(code(&output), 2, "{arguments:?}: {text}");
    assert!(output.stdout.is_empty(), "{arguments:?}");
    assert!(text.starts_with("error: ") && text.ends_with('\n'), "{text:?}");
    assert_eq!(text.lines().count(), 1, "{text}");
    for name in names {
        assert!(text.contains(name), "{name}: {text}");
    }
}

fn refused(arguments: &[&str], names: &[&str]) {
    let directory = tempfile::tempdir().unwrap();
    refused_in(directory.path(), arguments, names);
    assert!(is_empty(directory.path()), "{arguments:?} left files");
}

#[test]
fn parameters_are_checked_before_anything_is_written() {
    for (set, name) in [
        ("tread.tau=0.1", "tread.tau_s"),
        ("plant.my=1", "plant.my"),
        ("tread.tau_s=0.1s", "tread.tau_s"),
        ("drive.cruise_speed_mm_s=5mm/s", "drive.cruise_speed_mm_s"),
        ("tread.tau_s=abc", "tread.tau_s"),
        ("tread.tau_s", "--set tread.tau_s"),
        ("rig.step_positions_mm=40,18,62", "rig.step_positions_mm"),
        ("preload.limit_n=20", "preload.limit_n"),
        ("rig.step_height_mm=9", "rig.step_height_mm"),
        ("plant.mu=nan", "plant.mu"),
        ("run.controller=clever", "run.controller"),
    ] {
        refused(&["deploy", "--set", set], &[name]);
        refused(&["montecarlo", "-n", "2", "--json", "--set", set], &[name]);
    }
}

#[test]
fn options_are_checked_by_name() {
    refused(&["deploy", "--rig", "moon"], &["--rig", "moon", "prototype"]);
    refused(&["deploy", "--controller", "clever"], &["--controller", "scheduled"]);
    refused(&["deploy", "--seed", "x"], &["--seed", "'x'"]);
    refused(&["deploy", "--seed", "-1"], &["-1"]);
    refused(&["deploy", "--seed", "18446744073709551615"], &["run.seed"]);
    refused(&["deploy", "--target", "moon"], &["--target moon", "available targets: sil, board"]);
    refused(&["deploy", "--sead", "1"], &["--sead"]);
    refused(&["deploy", "--out", "a", "--no-files"], &["--out", "--no-files"]);
    refused(&["fly"], &["fly"]);
}

#[test]
fn scenario_files_are_checked() {
    refused(&["deploy", "missing.toml"], &["missing.toml"]);
    refused(&["deploy", "--scenario", "missing.toml"], &["missing.toml"]);
    let directory = tempfile::tempdir().unwrap();
    for (text, name) in [
        ("[tread\n", "line 1"),
        ("[tread]\nstiffness = 4\n", "tread.stiffness"),
        ("[tread]\ntau_s = 0.1 s\n", "tread.tau_s"),
        ("preset = \"moon\"\n", "moon"),
        ("[rig]\nstep_positions_mm = [40, 18]\n", "rig.step_positions_mm"),
    ] {
        std::fs::write(directory.path().join("bad.toml"), text).unwrap();
        refused_in(directory.path(), &["deploy", "bad.toml"], &["bad.toml", name]);
    }
    std::fs::write(directory.path().join("bytes.toml"), [0xff, 0xfe, 0x00]).unwrap();
    refused_in(directory.path(), &["deploy", "bytes.toml"], &["bytes.toml"]);
    refused_in(directory.path(), &["deploy", "."], &["cannot be read"]);
    assert!(!directory.path().join("out").exists());
}

#[test]
fn a_place_that_cannot_be_written_is_told() {
    let directory = tempfile::tempdir().unwrap();
    std::fs::write(directory.path().join("taken"), "mine").unwrap();
    refused_in(directory.path(), &["deploy", "--out", "taken"], &["--out taken"]);
    refused_in(directory.path(), &["deploy", "--out", "taken/run"], &["taken/run"]);
    assert_eq!(std::fs::read_to_string(directory.path().join("taken")).unwrap(), "mine");
}

#[test]
fn a_crossing_has_a_range_of_speed_and_preload() {
    let crossing = |speed: &str, preload: &str, names: &[&str]| {
        refused(&["crossing", "--speed-mm-s", speed, "--preload-n", preload], names);
    };
    for speed in ["0", "-5", "2001", "nan", "inf", "5mm/s"] {
        crossing(speed, "33", &["--speed-mm-s"]);
    }
    for preload in ["0", "-1", "1001", "nan", "33N"] {
        crossing("5", preload, &["--preload-n"]);
    }
    refused(&["crossing", "--speed-mm-s", "5"], &["--preload-n"]);
    refused(
        &["crossing", "--speed-mm-s", "5", "--preload-n", "33", "--method", "magic"],
        &["--method", "ring, reduced, fixed"],
    );
    refused(
        &["crossing", "--speed-mm-s", "5", "--preload-n", "33", "--set", "tread.tau_s=0"],
        &["tread.tau_s"],
    );
}

#[test]
fn the_other_verbs_name_what_they_refuse_too() {
    for shard in ["0/4", "5/4", "1/0", "a/b", "1"] {
        refused(&["montecarlo", "-n", "4", "--shard", shard], &["--shard", "i/n"]);
    }
    refused(&["montecarlo", "-n", "0"], &["-n"]);
    refused(&["montecarlo", "-n", "-3"], &["-3"]);
    refused(&["keys", "--rig", "moon"], &["--rig"]);
}
