//! `rig sweep`.

use super::{ends_with, folder, good_in, number, object, refused, rig_in, stdout};

#[test]
fn a_grid_of_deployments_has_rows_table_and_picture() {
    let at = &folder();
    let keys = ["--key", "tread.tau_s=0.05..0.2:3", "--key", "run.controller=scheduled,constant"];
    let found = object(&good_in(at, &[&["sweep", "--json"], &keys[..]].concat()));
    let rows = found["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 6);
    // A row is the run that deploy makes there.
    let arguments = "deploy --json --no-files --controller constant --set tread.tau_s=0.125";
    let run = object(&rig_in(at, &arguments.split(' ').collect::<Vec<_>>()));
    let row = &rows[3];
    assert_eq!((number(row, "tread.tau_s"), &row["run.controller"]), (0.125, &"constant".into()));
    for key in ["max_gap_mm", "duration_s", "slip_mm", "completed"] {
        assert_eq!(row[key], run[key], "{key}");
    }
    // A slower tread opens a larger gap, also at the safe speed that gives the reference.
    assert!(number(&rows[4], "max_gap_mm") > number(&rows[0], "max_gap_mm") + 0.02);
    let read = |file: usize| {
        std::fs::read_to_string(at.join(found["files"][file].as_str().unwrap())).unwrap()
    };
    let table = read(0);
    assert_eq!(table.lines().count(), 7);
    assert!(table.starts_with("tread.tau_s,run.controller,completed,max_gap_mm,"), "{table}");
    let picture = read(1);
    for text in ["Worst gap", "Duration", "slip", "tread.tau_s", "run.controller = constant"] {
        assert!(picture.contains(text), "{text}");
    }
    // Other values of the same key leave it alone.
    let other = ["sweep", "--key", "tread.tau_s=0.1,0.2", "--key", "run.controller=limit"];
    let output = rig_in(at, &other);
    let text = stdout(&output);
    assert!(text.contains("-2/: sweep.csv") && text.contains("\n 0.1  "), "{text}");
    assert_eq!(read(0), table);
}

#[test]
fn what_cannot_be_swept_is_refused_before_anything_runs() {
    for (key, names) in [
        ("tread.tau=0.1,0.2", &["did you mean tread.tau_s?"][..]),
        ("tread.tau_s=0.1..0.2", &["--key", "LOW..HIGH:COUNT"]),
        ("tread.tau_s=0.1,0", &["tread.tau_s = 0", "0.001 to 10"]),
        ("run.seed=0..9999:9999", &["run.seed"]),
    ] {
        refused(&["sweep", "--key", key], names);
    }
    refused(&["sweep"], &["--key"]);
    let twice = ["sweep", "--key", "plant.mu=1,2", "--key", "plant.mu=1,2"];
    refused(&twice, &["plant.mu: given twice"]);
}

#[test]
fn a_run_that_does_not_arrive_has_no_duration_and_fails_the_sweep() {
    let arguments = ["sweep", "--no-files", "--json", "--key", "plant.mu=0.7,1.1"];
    let rows = object(&ends_with(1, ".".as_ref(), &arguments));
    let [slips, arrives] = [0, 1].map(|row| &rows["rows"][row]["duration_s"]);
    assert!(slips.is_null() && arrives.is_f64(), "{rows}");
}
