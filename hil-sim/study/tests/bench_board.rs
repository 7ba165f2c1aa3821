//! Cycles of the reduced model and of the control tick on the emulated core stay within
//! their budget.

use rig_study::bench::arithmetic;
use rig_study::bench::budget::{Budget, Line};
use rig_study::bench::skipping;

fn check(lines: impl IntoIterator<Item = Line>) {
    let broken: Vec<Line> = lines.into_iter().filter(Line::broken).collect();
    assert!(broken.is_empty(), "{broken:#?}");
}

#[test]
fn the_reduced_model_keeps_its_budget() {
    let found = arithmetic::measure(true, true).unwrap();
    let lines = Budget::shipped().unwrap().model.lines(&found.variants[0]);
    assert_eq!(lines.len(), 4, "errors and cycles both ways");
    check(lines);
}

#[test]
fn the_control_tick_keeps_its_budget_and_every_cycle_has_a_stage() {
    let account = skipping::measure().unwrap();
    for phase in &account.phases {
        let sum: f64 = phase.stages.iter().sum();
        // A function's cycles over all ticks of a phase are whole; there are at most 200.
        assert!((sum - phase.mean).abs() < 100.0 / phase.ticks as f64 + 1e-6, "{phase:?}");
    }
    check(Budget::shipped().unwrap().tick.lines(&account));
}
