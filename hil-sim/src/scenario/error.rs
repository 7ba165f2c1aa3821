//! What can be wrong with a scenario, each in one line that names the key.

use std::path::PathBuf;

/// Where a value was written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Origin {
    /// In the preset of this name.
    Preset(String),
    /// In this file.
    File(PathBuf),
    /// On the command line.
    Set,
}

impl std::fmt::Display for Origin {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Preset(name) => write!(f, "preset {name}"),
            Self::File(path) => write!(f, "{}", path.display()),
            Self::Set => f.write_str("command line"),
        }
    }
}

/// A scenario that cannot be used. Each displays as one line.
#[derive(Debug, thiserror::Error)]
pub enum ScenarioError {
    /// The file cannot be read.
    #[error("{}: cannot be read: {source}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The file is not TOML.
    #[error("{}, line {line}: not valid TOML: {message}", path.display())]
    NotToml {
        /// The file.
        path: PathBuf,
        /// Line of the mistake, from 1.
        line: usize,
        /// What the parser says.
        message: String,
    },
    /// There is no preset of this name.
    #[error("{origin}: preset = {name:?}: expected \"prototype\" or \"fe\"")]
    UnknownPreset {
        /// Where it was asked for.
        origin: Origin,
        /// The name found.
        name: String,
    },
    /// No such key.
    #[error("{origin}: {key}: no such key{hint}")]
    UnknownKey {
        /// Where it was written.
        origin: Origin,
        /// Dotted path.
        key: String,
        /// The nearest known key as a half-sentence, or where to find the list.
        hint: String,
    },
    /// The value is of another kind than the key takes.
    #[error("{origin}: {key} = {found}: expected {expected}")]
    WrongType {
        /// Where it was written.
        origin: Origin,
        /// Dotted path.
        key: String,
        /// What was written.
        found: String,
        /// What the key takes.
        expected: String,
    },
    /// A number with a unit behind it.
    #[error(
        "{origin}: {key} = {found}: expected a bare number{}, without the unit{}",
        in_unit(unit),
        if unit.is_empty() { "" } else { ": that is part of the key's name" }
    )]
    UnitInValue {
        /// Where it was written.
        origin: Origin,
        /// Dotted path.
        key: String,
        /// What was written.
        found: String,
        /// Unit of the key.
        unit: &'static str,
    },
    /// An override that is not `key=value`.
    #[error("--set {text}: expected key=value, as in --set tread.tau_s=0.12")]
    NotAnAssignment {
        /// What was written.
        text: String,
    },
    /// A value outside its range.
    #[error("{origin}: {key} = {value}: expected a value from {min} to {max}")]
    OutOfRange {
        /// Where it was written.
        origin: Origin,
        /// Dotted path.
        key: String,
        /// The value found.
        value: f64,
        /// Least value allowed.
        min: f64,
        /// Largest value allowed.
        max: f64,
    },
    /// Steps that the anomalies bring too close together.
    #[error(
        "{origin}: run.anomalies: steps at {first_mm:.1} and {second_mm:.1} mm, expected at least {least_mm:.1} mm between them"
    )]
    StepsTooClose {
        /// Where the anomalies were written.
        origin: Origin,
        /// The nearer step, mm.
        first_mm: f64,
        /// The farther step, mm.
        second_mm: f64,
        /// Least distance, mm.
        least_mm: f64,
    },
    /// Values that are each possible and together make no plant.
    #[error("{origin}: {refusal}")]
    Refused {
        /// Where the offending value was written.
        origin: Origin,
        /// What is wrong with them.
        refusal: crate::plant::limits::Refusal,
    },
    /// The rig's own checks failed.
    #[error("{origin}: {error}")]
    Rig {
        /// Where the offending value was written.
        origin: Origin,
        /// What is wrong with it.
        error: interstage::rig::RigError,
    },
}

fn in_unit(unit: &str) -> String {
    if unit.is_empty() { String::new() } else { format!(" in {unit}") }
}
