//! Treads that the controller is not told of.

use hil_sim::record::{Recording, Row};
use hil_sim::session::{Options, run};

use crate::common::overridden;

/// A deployment with these overrides, its reference gap, mm, and whether it completed.
fn deployed(sets: &[&str]) -> (Recording, f64) {
    let recording = run(&overridden("prototype", sets), Options::ROWS).expect("a run");
    assert!(recording.summary.completed, "{sets:?}");
    let reference = recording.summary.gap_ref_mm;
    (recording, reference)
}

#[test]
fn on_a_thick_tread_the_gap_holds_and_is_measured() {
    for thickness in ["5", "8", "12"] {
        let set = format!("tread.thickness_mm={thickness}");
        let (recording, reference) = deployed(&[&set, "mismatch.tread_thickness=1"]);
        let crossings = &recording.summary.crossings;
        assert_eq!(crossings.len(), 3);
        for line in crossings {
            let part = line.gap_mm / reference;
            assert!(line.index == 1 || part <= 1.05, "{set} step {}: {part}", line.index);
            let off = line.gap_measured_mm.expect("measured") / line.gap_mm - 1.0;
            assert!(line.index == 1 || off.abs() <= 0.05, "{set} step {}: {off}", line.index);
        }
    }
}

/// The speed loop's integral part has long carried the corner when this wheel shows it. What is
/// then fed forward must not come on top: the wheel would lift off at more than twice its speed.
#[test]
fn a_slow_wheel_does_not_lunge_where_its_corner_is_detected() {
    let (recording, _) = deployed(&["run.seed=857", "run.mismatch=wide"]);
    for line in &recording.summary.crossings {
        let before = |row: &&Row| (line.lift_s - 0.15..=line.lift_s).contains(&row.controller.t_s);
        let speeds = recording.rows.iter().filter(before);
        let fastest = speeds.map(|row| row.controller.wheel_speed_mm_s).fold(0.0, f64::max);
        assert!((1.0..2.5).contains(&fastest), "step {}: {fastest} mm/s", line.index);
    }
}
