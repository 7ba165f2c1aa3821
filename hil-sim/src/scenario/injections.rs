//! `[[run.faults]]`: what each entry must and may have.

use toml::{Table, Value};

use super::injection::{CATALOGUE, Entry, HARDWARE, entry};
use super::keys::Kind as KeyKind;
use super::merge::{Provenance, checked as checked_value, wrong_type};
use super::{Origin, Scenario, ScenarioError};

/// What an entry may say beside target and kind.
const MAY: [&str; 5] = ["at_s", "at_mm", "at_crossing", "duration_s", "magnitude"];
/// When a fault comes: one of these.
const WHEN: &str = "one of at_s, at_mm and at_crossing";

/// One fault, in the form that it has in a scenario.
pub(super) fn checked(origin: &Origin, at: &str, value: &Value) -> Result<Value, ScenarioError> {
    let Value::Table(given) = value else {
        return Err(wrong_type(origin, at, KeyKind::Faults, value));
    };
    let wrong = |name: &str, found: String, expected: String| ScenarioError::WrongType {
        origin: origin.clone(),
        key: format!("{at}.{name}"),
        found,
        expected,
    };
    let mut found = Table::new();
    for (name, known) in [("target", targets()), ("kind", kinds(given))] {
        let expected = || known.iter().map(|w| format!("\"{w}\"")).collect::<Vec<_>>().join(" or ");
        match given.get(name) {
            Some(Value::String(word)) if known.contains(word) => {
                found.insert(name.to_owned(), Value::String(word.clone()));
            }
            Some(other) => return Err(wrong(name, other.to_string(), expected())),
            None => return Err(wrong(name, "nothing".to_owned(), expected())),
        }
    }
    for (name, value) in
        given.iter().filter(|(name, _)| !["target", "kind"].contains(&name.as_str()))
    {
        if !MAY.contains(&name.as_str()) {
            return Err(ScenarioError::UnknownKey {
                origin: origin.clone(),
                key: format!("{at}.{name}"),
                hint: format!("; a fault takes target, kind, {}", MAY.join(", ")),
            });
        }
        let kind = if name == "at_crossing" { KeyKind::Whole } else { KeyKind::Number };
        let value = checked_value(origin, &format!("{at}.{name}"), kind, value)?;
        found.insert(name.clone(), value);
    }
    let whens: Vec<&str> =
        MAY.into_iter().take(3).filter(|name| given.contains_key(*name)).collect();
    match whens.as_slice() {
        [_] => Ok(Value::Table(found)),
        [] => Err(wrong("at_s", "nothing".to_owned(), WHEN.to_owned())),
        several => Err(wrong("at_s", several.join(" and "), WHEN.to_owned())),
    }
}

/// Everything that can break, in software and on the board.
fn all() -> impl Iterator<Item = &'static Entry> {
    CATALOGUE.iter().chain(HARDWARE)
}

/// Names of everything that can break.
fn targets() -> Vec<String> {
    let mut names: Vec<String> = all().map(|entry| entry.target.name()).collect();
    names.dedup();
    names
}

/// How the target of this entry can break.
fn kinds(given: &Table) -> Vec<String> {
    let target = given.get("target").and_then(Value::as_str).unwrap_or_default();
    let of = all().filter(|entry| entry.target.name() == target);
    of.map(|entry| entry.kind.name()).collect()
}

/// Ranges of times, places and magnitudes.
pub(super) fn check(scenario: &Scenario, from: &Provenance) -> Result<(), ScenarioError> {
    for (index, fault) in scenario.run.faults.iter().enumerate() {
        let measure = entry(fault.target, fault.kind).map_or((0.0, 0.0), |entry| entry.range);
        let ranges = [
            ("at_s", fault.at_s, (0.0, 3600.0)),
            ("at_mm", fault.at_mm, (-10.0, 1e4)),
            ("at_crossing", fault.at_crossing.map(f64::from), (1.0, 250.0)),
            ("duration_s", fault.duration_s, (0.001, 3600.0)),
            ("magnitude", fault.magnitude, measure),
        ];
        for (name, value, (min, max)) in ranges {
            // Written so that a NaN fails.
            if let Some(value) = value
                && !(value >= min && value <= max)
            {
                return Err(ScenarioError::OutOfRange {
                    origin: from.of("run.faults"),
                    key: format!("run.faults[{}].{name}", index + 1),
                    value,
                    min,
                    max,
                });
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::injection::{Injection, Kind, Target};

    fn parse(text: &str) -> Result<Scenario, String> {
        Scenario::parse("bench.toml", text, &[]).map_err(|error| error.to_string())
    }

    #[test]
    fn faults_are_read_and_written_back() {
        let text = "[[run.faults]]\ntarget = \"load-cell\"\nkind = \"gain\"\nat_mm = 20\n\
                    magnitude = 1.1\n[[run.faults]]\ntarget = \"drive\"\nkind = \"runaway\"\n\
                    at_crossing = 2\nduration_s = 0.5\n";
        let scenario = parse(text).unwrap();
        let [first, second] = scenario.run.faults.as_slice() else { panic!("two") };
        let gain = Injection::at(Target::LoadCell, Kind::Gain, 0.0, 1.1);
        assert_eq!(*first, Injection { at_s: None, at_mm: Some(20.0), ..gain });
        assert_eq!((second.at_crossing, second.duration_s), (Some(2), Some(0.5)));
        assert_eq!(second.magnitude(), 1.0, "as the catalogue has it");
        assert_eq!(parse(&scenario.to_toml()).unwrap(), scenario);
    }

    #[test]
    fn every_mistake_is_named() {
        let fault = |rest: &str| parse(&format!("[[run.faults]]\n{rest}")).unwrap_err();
        for (rest, told) in [
            ("kind = \"off\"\nat_s = 1", "run.faults[1].target = nothing: expected \"encoder\""),
            (
                "target = \"angel\"\nkind = \"off\"\nat_s = 1",
                "run.faults[1].target = \"angel\": expected \"encoder\"",
            ),
            (
                "target = \"model\"\nkind = \"off\"\nat_s = 1",
                "run.faults[1].kind = \"off\": expected \"hung\"",
            ),
            (
                "target = \"model\"\nkind = \"hung\"",
                "run.faults[1].at_s = nothing: expected one of at_s, at_mm and at_crossing",
            ),
            (
                "target = \"model\"\nkind = \"hung\"\nat_s = 1\nat_mm = 2",
                "run.faults[1].at_s = at_s and at_mm: expected one of",
            ),
            (
                "target = \"model\"\nkind = \"hung\"\nat = 1",
                "run.faults[1].at: no such key; a fault takes target, kind, at_s",
            ),
            (
                "target = \"model\"\nkind = \"hung\"\nat_s = \"1 s\"",
                "run.faults[1].at_s = 1 s: expected a bare number in s",
            ),
            (
                "target = \"model\"\nkind = \"hung\"\nat_s = 1\nmagnitude = 2",
                "run.faults[1].magnitude = 2: expected a value from 0 to 0",
            ),
            (
                "target = \"drive\"\nkind = \"weak\"\nat_s = -1",
                "run.faults[1].at_s = -1: expected a value from 0 to 3600",
            ),
        ] {
            let error = fault(rest);
            assert!(error.starts_with("bench.toml: ") && error.contains(told), "{error}");
        }
    }
}
