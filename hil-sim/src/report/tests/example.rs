//! Runs for the tests of what is shown of a run.

use std::sync::OnceLock;

use crate::record::{Recording, Report};
use crate::scenario::Scenario;
use crate::session::{Options, run};

/// A completed deployment, in which the second gap was not measured.
pub(crate) fn deploy() -> Recording {
    static RUN: OnceLock<Recording> = OnceLock::new();
    let run = RUN.get_or_init(|| {
        let mut recording = run(&Scenario::default(), Options::ROWS).expect("a run");
        recording.summary.crossings[1].gap_measured_mm = None;
        recording.stream.clear();
        recording
    });
    run.clone()
}

/// The same, ended by a fault between the first and the second step.
pub(crate) fn faulted() -> Recording {
    let mut recording = deploy();
    let summary = &mut recording.summary;
    let lift_s = summary.crossings[0].lift_s;
    recording.rows.retain(|row| row.controller.t_s < lift_s + 0.2);
    let last = recording.rows[recording.rows.len() - 1];
    summary.completed = false;
    summary.travel_mm = last.position_mm();
    summary.total_s = last.controller.t_s;
    summary.crossings.truncate(1);
    let report = |after_s, code, text: &str| {
        vec![Report { t_s: lift_s + after_s, code, text: text.to_owned() }]
    };
    summary.faults = report(0.2, 121, "the preload did not reach its reference in time");
    summary.limits = report(0.1, 201, "preload held at its limit & speed lowered");
    recording
}
