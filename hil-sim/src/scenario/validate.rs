//! Checks a scenario, after the rig's own checks.

use interstage::rig::{Bound, RigError};

use super::injection::entry;
use super::merge::Provenance;
use super::{Scenario, ScenarioError, StepAnomaly, keys};
use crate::plant::spread::{Field, Section};

/// Largest offset of an early or late step, mm.
const MAX_OFFSET_MM: f64 = 20.0;

/// Most that a step may be higher than the table says, mm.
const MAX_HIGHER_MM: f64 = 4.0;

/// Checks every value against its range and the values against one another.
pub(super) fn check(scenario: &Scenario, from: &Provenance) -> Result<(), ScenarioError> {
    let refused = |message: String| ScenarioError::at(from.of_message(&message), &message);
    scenario.rig.validate().map_err(|error| of_rig(&error, scenario, from))?;
    for (key, value, range) in plant_keys(scenario) {
        in_range(from.of(&key), &key, value, range)?;
    }
    anomalies(scenario, from.of("run.anomalies"))?;
    spacing(scenario, from.of("run.anomalies"))?;
    faults(scenario, from.of("run.faults"))?;
    let checked = scenario.plant().check(scenario.rig.preload.limit_n);
    checked.map_err(|refusal| refused(refusal.to_string()))
}

/// What is wrong with the rig, said of the key that was written, not of another one that does not
/// go with it.
fn of_rig(error: &RigError, scenario: &Scenario, from: &Provenance) -> ScenarioError {
    let text = error.to_string();
    let [first, others @ ..] = error.keys() else { return ScenarioError::at("scenario", text) };
    if from.is_written(first) {
        return ScenarioError::at(from.of(first), text);
    }
    if let Some((key, value, bound)) = error.other_side().filter(|side| from.is_written(side.0)) {
        let expected = match bound {
            Bound::AtLeast(least) => format!("at least {least:.1}"),
            Bound::AtMost(most) => format!("at most {most:.1}"),
        };
        let place = text.split(": ").next().unwrap_or(first);
        return ScenarioError::wrong(from.of(key), key, value, format!("{expected}, as {place}"));
    }
    let table = scenario.table();
    let value = |key: &str| {
        let leaf = keys::leaves(&table).into_iter().find(|(name, _)| name == key)?;
        Some(leaf.1.to_string())
    };
    match others.iter().find(|key| from.is_written(key)) {
        Some(key) => {
            let value = value(key).unwrap_or_default();
            let text = text.replacen(": expected ", ", of which it expects ", 1);
            ScenarioError::at(from.of(key), format!("{key} = {value} does not fit {text}"))
        }
        None => ScenarioError::at(from.of(first), text),
    }
}

fn in_range(
    origin: &str,
    key: &str,
    value: f64,
    (min, max): (f64, f64),
) -> Result<(), ScenarioError> {
    // Not a number is in no range.
    if (min..=max).contains(&value) {
        return Ok(());
    }
    Err(ScenarioError::out_of_range(origin, key, value, (min, max)))
}

/// Every key that is a number with its least and largest value.
pub(super) fn all_ranges(scenario: &Scenario) -> Vec<(String, (f64, f64))> {
    let rig = scenario.rig.bounds().map(|(key, _, min, max)| (key.to_owned(), (min, max)));
    let plant = plant_keys(scenario).into_iter().map(|(key, _, range)| (key, range));
    rig.into_iter().chain(plant).collect()
}

/// Keys of the plant with their value, least and largest value.
fn plant_keys(scenario: &Scenario) -> Vec<(String, f64, (f64, f64))> {
    fn section<T: Section>(name: &str, keys: &T) -> Vec<(String, f64, (f64, f64))> {
        let key = |(field, value): (&Field<T>, f64)| {
            (format!("{name}.{}", field.name), value, field.range)
        };
        keys.values().map(key).collect()
    }
    // TOML has no larger integer.
    let seed = ("run.seed".to_owned(), scenario.run.seed as f64, (0.0, i64::MAX as f64));
    [
        section("spread", &scenario.spread),
        section("noise", &scenario.noise),
        vec![seed],
        section("mismatch", &scenario.mismatch),
    ]
    .concat()
}

fn anomalies(scenario: &Scenario, origin: &str) -> Result<(), ScenarioError> {
    let steps = scenario.rig.rig.step_positions_mm.len() as f64;
    for (index, anomaly) in scenario.run.anomalies.iter().enumerate() {
        let (step, length) = match *anomaly {
            StepAnomaly::Early { step, offset_mm } | StepAnomaly::Late { step, offset_mm } => {
                (Some(step), Some(("offset_mm", offset_mm, MAX_OFFSET_MM)))
            }
            StepAnomaly::Higher { step, offset_mm } => {
                (Some(step), Some(("offset_mm", offset_mm, MAX_HIGHER_MM)))
            }
            StepAnomaly::Missing { step } => (Some(step), None),
            StepAnomaly::Extra { position_mm } => {
                (None, Some(("position_mm", position_mm, scenario.rig.rig.travel_mm)))
            }
        };
        let step = step.map(|n| ("step", f64::from(n), (1.0, steps)));
        let length = length.map(|(name, value, max)| (name, value, (0.0, max)));
        for (name, value, range) in step.into_iter().chain(length) {
            in_range(origin, &format!("run.anomalies[{}].{name}", index + 1), value, range)?;
        }
    }
    Ok(())
}

fn faults(scenario: &Scenario, origin: &str) -> Result<(), ScenarioError> {
    for (index, fault) in scenario.run.faults.iter().enumerate() {
        let measure = entry(fault.target, fault.kind).map_or((0.0, 0.0), |entry| entry.range);
        for (name, value, range) in [
            ("at_s", fault.at_s, (0.0, 3600.0)),
            ("at_mm", fault.at_mm, (-10.0, 1e4)),
            ("duration_s", fault.duration_s, (0.001, 3600.0)),
            ("magnitude", fault.magnitude, measure),
        ] {
            if let Some(value) = value {
                in_range(origin, &format!("run.faults[{}].{name}", index + 1), value, range)?;
            }
        }
    }
    Ok(())
}

/// The wheel finishes one step before it touches the next, with the anomalies too.
fn spacing(scenario: &Scenario, origin: &str) -> Result<(), ScenarioError> {
    if scenario.run.anomalies.is_empty() {
        return Ok(());
    }
    let least = scenario.rig.corner_reach_mm();
    let mut first = 0.0;
    for (second, _) in scenario.true_steps() {
        if second - first < least {
            let what = format!(
                "run.anomalies: steps at {first:.1} and {second:.1} mm, expected at least \
                 {least:.1} mm between them"
            );
            return Err(ScenarioError::at(origin, what));
        }
        first = second;
    }
    Ok(())
}
