//! How far a power-up has come, kept in a file.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::{Check, Stage};
use crate::files::{FileError, write_text};
use crate::scenario::Scenario;

/// Results so far.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Progress {
    /// The rig as the board's parameters have it.
    pub expected: Scenario,
    /// The same with what was measured.
    pub proposed: Scenario,
    stages: Vec<(Stage, Vec<Check>)>,
}

impl Progress {
    /// Nothing yet, for a rig.
    #[must_use]
    pub fn new(expected: Scenario) -> Self {
        Self { proposed: expected.clone(), expected, stages: Vec::new() }
    }

    /// The progress that a file has for this rig; none if it is not there, or of another rig.
    #[must_use]
    pub fn read(path: &Path, expected: &Scenario) -> Option<Self> {
        let text = std::fs::read_to_string(path).ok()?;
        let progress: Self = serde_json::from_str(&text).ok()?;
        (progress.expected == *expected).then_some(progress)
    }

    /// Keeps it in a file.
    ///
    /// # Errors
    /// [`FileError`] if the file cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), FileError> {
        // Numbers and texts always have a JSON form.
        write_text(path, &serde_json::to_string_pretty(self).unwrap_or_default())
    }

    /// Takes the checks of a stage, in place of those of an earlier attempt.
    pub(super) fn add(&mut self, stage: Stage, checks: Vec<Check>) {
        self.stages.retain(|(known, _)| *known != stage);
        self.stages.push((stage, checks));
    }

    /// Whether a stage has passed.
    #[must_use]
    pub fn is_done(&self, stage: Stage) -> bool {
        self.stages.iter().any(|(known, checks)| {
            *known == stage && !checks.is_empty() && checks.iter().all(|check| check.ok)
        })
    }

    /// Whether every stage has passed.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        Stage::ALL.iter().all(|stage| self.is_done(*stage))
    }

    /// Every check so far.
    pub fn checks(&self) -> impl Iterator<Item = &Check> {
        self.stages.iter().flat_map(|(_, checks)| checks)
    }

    /// The stages so far.
    #[must_use]
    pub fn stages(&self) -> &[(Stage, Vec<Check>)] {
        &self.stages
    }
}
