//! What cannot be run as asked: exit code 2, one line that names it, no files.

use super::{folder, refused, refused_in};

/// `scenario/tests.rs` has what is refused, and why.
#[test]
fn parameters_are_checked_before_anything_is_written() {
    for (set, name) in [
        ("plant.my=1", "did you mean plant.mu?"),
        ("tread.tau_s", "--set tread.tau_s"),
        ("rig.step_height_mm=9", "rig.step_height_mm"),
        ("plant.mu=nan", "plant.mu"),
    ] {
        refused(&["deploy", "--set", set], &[name]);
        refused(&["montecarlo", "-n", "2", "--json", "--set", set], &[name]);
    }
}

/// The last seed that two others can follow.
const LAST: &str = "9223372036854775805";

#[test]
fn options_are_checked_by_name() {
    for (arguments, names) in [
        ("deploy --rig moon", &["--rig", "moon", "prototype"][..]),
        ("deploy --controller clever", &["--controller", "scheduled"]),
        ("deploy --seed x", &["--seed", "'x'"]),
        ("deploy --seed -1", &["--seed", "-1", "a whole number, 0 or more"]),
        ("envelope --fault supply.weak@2", &["supply weak", "the board's hardware"]),
        ("deploy --seed 1.5", &["--seed", "1.5", "a whole number, 0 or more"]),
        ("deploy --seed 18446744073709551615", &["--seed", "at most 9223372036854775807"]),
        ("deploy --target moon", &["--target <TARGET>", "moon", "sil, board, probe"]),
        ("deploy --sead 1", &["--sead", "--seed"]),
        ("deploy --out a --no-files", &["--out", "--no-files"]),
        ("deploy missing.toml", &["missing.toml"]),
        ("deploy --scenario missing.toml", &["missing.toml"]),
        ("fly", &["fly"]),
        (
            "crossing --speed-mm-s 5",
            &["error: the following required", " provided: --preload-n <P>"],
        ),
        ("crossing --speed-mm-s 5 --preload-n 33 --method magic", &["--method", "ring, fixed"]),
        ("crossing --speed-mm-s 5 --preload-n 33 --set tread.tau_s=0", &["tread.tau_s"]),
        ("montecarlo -n 0", &["-n"]),
        ("montecarlo -n -3", &["-3"]),
        ("montecarlo -n 4 --shard 5/4", &["--shard", "i/n"]),
        ("keys --rig moon", &["--rig"]),
        ("faults --only preload-senser", &["did you mean \"preload-sensor\"?"]),
        ("faults --only gremlin", &["--only gremlin: no such fault", "preload-sensor stuck"]),
        ("live", &["no terminal"]),
        ("live --headless --listen nowhere", &["--listen nowhere"]),
        ("capture --target moon", &["--target <TARGET>"]),
        ("capture --stream /nowhere/line.bin", &["/nowhere/line.bin"]),
        ("replay /nowhere/log.mcap", &["/nowhere/log.mcap"]),
        ("identify", &["<LOG>"]),
        ("identify missing.mcap", &["missing.mcap: No such file"]),
        ("identify --published notes.csv", &["cannot be used with"]),
        ("identify --published --out a", &["--published", "--out", "cannot be used with"]),
        ("capture --seconds nan", &["--seconds", "nan", "a number above 0"]),
        ("capture --seconds -3", &["--seconds", "-3", "a number above 0"]),
        ("capture --name ../x", &["--name ../x", "without a folder"]),
        ("compare --controller limit", &["--controller limit", "no effect"]),
        ("compare --set run.controller=limit", &["--set run.controller=limit", "no effect"]),
        ("envelope --controller limit", &["--controller limit", "no effect"]),
        ("stress -n 1000000000", &["--cases <CASES>", "1000000000"]),
        ("stress -n -1", &["--cases <CASES>", "'-1'"]),
        ("sweep --key rig.step_positions_mm=18,40", &["--key rig.step_positions_mm", "a list"]),
        ("montecarlo -n 2 --seed 9223372036854775807", &["run.seed = 9223372036854775807", LAST]),
        ("compare -n 2 --seed 9223372036854775807", &["run.seed = 9223372036854775807", LAST]),
        ("faults -n 2 --set run.seed=9223372036854775806", &["run.seed", LAST]),
        ("montecarlo -n 1 --shard 2/2", &["--shard 2/2", "of 1", "none for this one"]),
        ("faults --only tick -n 1 --shard 2/2", &["--shard 2/2"]),
        ("envelope -n 8", &["-n", "8", "8x7"]),
        ("envelope -n 1x7", &["-n", "1x7", "8x7"]),
        ("envelope -n axb", &["-n", "axb", "8x7"]),
        ("faults --clean 1 --shard 2/2", &["--shard 2/2", "none for this one"]),
        ("faults --only preload-sensor --shard 90/100", &["--shard 90/100", "none for this one"]),
    ] {
        refused(&arguments.split(' ').collect::<Vec<_>>(), names);
    }
}

#[test]
fn scenario_files_are_checked() {
    let at = &folder();
    for (text, name) in [("[tread\n", "line 1"), ("[tread]\nstiffness = 4\n", "tread.stiffness")] {
        std::fs::write(at.join("bad.toml"), text).unwrap();
        refused_in(at, &["deploy", "bad.toml"], &["bad.toml", name]);
    }
    std::fs::write(at.join("bytes.toml"), [0xff, 0xfe, 0x00]).unwrap();
    refused_in(at, &["deploy", "bytes.toml"], &["bytes.toml"]);
    refused_in(at, &["deploy", "."], &["cannot be read"]);
    assert!(!at.join("out").exists());
}

#[test]
fn what_is_no_log_is_refused() {
    let at = &folder();
    std::fs::write(at.join("log.mcap"), "hello").unwrap();
    std::fs::write(at.join("notes.csv"), "a,b\n1,2\n").unwrap();
    refused_in(at, &["replay", "log.mcap"], &["no log"]);
    refused_in(at, &["report", "log.mcap"], &["no log"]);
    refused_in(at, &["identify", "notes.csv"], &["notes.csv: it holds no tick"]);
}

#[test]
fn a_directory_that_cannot_be_written_is_reported() {
    let at = &folder();
    std::fs::write(at.join("taken"), "mine").unwrap();
    refused_in(at, &["deploy", "--out", "taken"], &["--out taken"]);
    refused_in(at, &["deploy", "--out", "taken/run"], &["taken/run: cannot make"]);
    assert_eq!(std::fs::read_to_string(at.join("taken")).unwrap(), "mine");
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
}
