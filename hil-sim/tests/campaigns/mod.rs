//! Faults, holds and the stress of plant and controller.

mod accepted;
mod envelope;
mod faults;
mod holds;
mod hostile;
mod refine;
mod settle;
mod stress;

use hil_sim::scenario::{Scenario, ScenarioError};

/// A number of a scenario: its value, and what `rig keys` states as its least and largest.
fn number(base: &Scenario, key: &str) -> (f64, f64, f64) {
    let info = base.keys().into_iter().find(|info| info.key == key).expect("a key");
    let (least, most) = info.range.expect("a number");
    (info.value.to_string().parse().expect("a number"), least, most)
}

fn set(base: &Scenario, key: &str, value: f64) -> Result<Scenario, ScenarioError> {
    base.clone().with(&[format!("{key}={value}")])
}

/// The rig with this key at this end of its range, or as near to it as the rest of the rig takes;
/// then why the end is refused, too.
fn at_end(base: &Scenario, key: &str, end: f64) -> (Scenario, Option<ScenarioError>) {
    let refusal = match set(base, key, end) {
        Ok(scenario) => return (scenario, None),
        Err(refusal) => refusal,
    };
    let (mut good, mut bad) = (number(base, key).0, end);
    for _ in 0..10 {
        let middle = 0.5 * (good + bad);
        let kept = set(base, key, middle).is_ok();
        *(if kept { &mut good } else { &mut bad }) = middle;
    }
    (set(base, key, good).expect("accepted"), Some(refusal))
}
