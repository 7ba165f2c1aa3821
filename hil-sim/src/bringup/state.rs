//! How far a power-up has come, kept in a file.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::{Check, GATES, Stage};
use crate::files::{FileError, write_text};
use crate::scenario::Scenario;

/// The file: scenarios as TOML, stages as they are.
#[derive(Serialize, Deserialize)]
struct Kept {
    expected: String,
    proposed: String,
    stages: Vec<(Stage, Vec<Check>)>,
}

/// Results so far.
#[derive(Clone, Debug, PartialEq)]
pub struct Progress {
    /// The rig as the board's parameters have it.
    pub expected: Scenario,
    /// The same with what was measured.
    pub proposed: Scenario,
    stages: Vec<(Stage, Vec<Check>)>,
}

impl Progress {
    /// Nothing yet, for a rig.
    pub fn new(expected: Scenario) -> Self {
        Self { proposed: expected.clone(), expected, stages: Vec::new() }
    }

    /// The progress that a file has for this rig, as it was or with what was measured; none if it
    /// is not there, or of another rig.
    pub(crate) fn read(path: &Path, expected: &Scenario) -> Option<Self> {
        let kept = Self::open(path)?;
        let is_this = kept.expected == *expected || kept.proposed.rig == expected.rig;
        is_this.then(|| Self { expected: expected.clone(), ..kept })
    }

    /// The progress that a file has, of whichever rig.
    pub(super) fn open(path: &Path) -> Option<Self> {
        let text = std::fs::read_to_string(path).ok()?;
        let kept: Kept = serde_json::from_str(&text).ok()?;
        let scenario = |text: &str| Scenario::parse("kept", text, &[]).ok();
        let (expected, proposed) = (scenario(&kept.expected)?, scenario(&kept.proposed)?);
        Some(Self { expected, proposed, stages: kept.stages })
    }

    /// Keeps it in a file.
    pub(crate) fn write(&self, path: &Path) -> Result<(), FileError> {
        let (expected, proposed) = (self.expected.to_toml(), self.proposed.to_toml());
        let kept = Kept { expected, proposed, stages: self.stages.clone() };
        // Numbers and texts always have a JSON form.
        write_text(path, &serde_json::to_string_pretty(&kept).unwrap_or_default())
    }

    /// Takes the checks of a stage, in place of those of an earlier attempt.
    pub(super) fn add(&mut self, stage: Stage, checks: Vec<Check>) {
        self.forget(stage);
        self.stages.push((stage, checks));
        self.stages.sort_by_key(|(stage, _)| *stage as usize);
    }

    /// A stage has to be passed again.
    pub(super) fn forget(&mut self, stage: Stage) {
        self.stages.retain(|(known, _)| *known != stage);
    }

    /// Whether a stage has passed.
    pub(crate) fn is_done(&self, stage: Stage) -> bool {
        self.stages.iter().any(|(known, checks)| {
            *known == stage && !checks.is_empty() && checks.iter().all(|check| check.ok)
        })
    }

    /// Whether every stage of the first power-up has passed.
    pub fn is_complete(&self) -> bool {
        GATES.iter().all(|gate| gate.is_by_logs() || self.is_done(gate.stage))
    }

    pub fn checks(&self) -> impl Iterator<Item = &Check> {
        self.stages.iter().flat_map(|(_, checks)| checks)
    }

    pub(crate) fn stages(&self) -> &[(Stage, Vec<Check>)] {
        &self.stages
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bringup::row;

    #[test]
    fn progress_goes_on_for_the_same_rig_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bringup.json");
        let mut progress = Progress::new(Scenario::default());
        progress.proposed.rig.drive.no_load_speed_mm_s = 58.7;
        progress.add(Stage::Board, vec![row::FIRMWARE.check(true, "500 ticks".to_owned(), "")]);
        progress.add(Stage::Sensors, vec![row::SELF_TEST.check(false, "boot".to_owned(), "wait")]);
        progress.write(&path).unwrap();
        let back = Progress::read(&path, &Scenario::default()).expect("the same rig");
        assert_eq!(back, progress);
        assert!(back.is_done(Stage::Board) && !back.is_done(Stage::Sensors));
        let mut other = Scenario::default();
        other.rig.drive.stall_force_n += 1.0;
        assert_eq!(Progress::read(&path, &other), None);
    }
}
