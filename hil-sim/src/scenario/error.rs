//! What can be wrong with a scenario.

use std::fmt::Display;

use super::keys;

/// A scenario that cannot be used. Displays as one line: where the value was written, its
/// key, and what was expected.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct ScenarioError(pub(super) String);

impl ScenarioError {
    /// Something is wrong with what `origin` says.
    pub(super) fn at(origin: &str, what: impl Display) -> Self {
        Self(format!("{origin}: {what}"))
    }

    /// There is no such key; `hint` is the second half of the sentence.
    pub(super) fn unknown_key(origin: &str, key: &str, hint: &str) -> Self {
        Self::at(origin, format!("{key}: no such key{hint}"))
    }

    /// The value is not what the key takes.
    pub(super) fn wrong(
        origin: &str,
        key: &str,
        found: impl Display,
        expected: impl Display,
    ) -> Self {
        Self::at(origin, format!("{key} = {found}: expected {expected}"))
    }

    /// The value is outside its range.
    pub(super) fn out_of_range(
        origin: &str,
        key: &str,
        value: f64,
        (min, max): (f64, f64),
    ) -> Self {
        Self::wrong(origin, key, value, format!("a value from {min} to {max}"))
    }

    /// A number with a unit behind it.
    pub(super) fn unit_in_value(origin: &str, key: &str, found: &str) -> Self {
        let unit = keys::in_unit(key);
        let why = if unit.is_empty() { "" } else { ": that is part of the key's name" };
        Self::wrong(origin, key, found, format!("a bare number{unit}, without the unit{why}"))
    }
}
