//! How a scenario is run: direction, controller, seed, and steps that are not
//! where the step table says.

use documented::DocumentedFields;
use serde::{Deserialize, Serialize};

use super::injection::{Injection, Kind};

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, DocumentedFields)]
#[serde(deny_unknown_fields)]
pub struct RunOptions {
    /// Sense of motion.
    pub direction: Direction,
    /// Preload and speed strategy.
    pub controller: ControllerKind,
    /// Seed of the plant's draw and of the noise; 0 draws the nominal plant.
    pub seed: u64,
    /// Whether the seed draws the mismatch too: as stated, or wide.
    #[serde(default)]
    pub mismatch: MismatchDraw,
    /// Steps that are not where the step table says.
    pub anomalies: Vec<StepAnomaly>,
    /// Faults that come while it runs.
    #[serde(default)]
    pub faults: Vec<Injection>,
}

/// Sense of motion of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Direction {
    /// Outwards, onto the smaller radius.
    #[default]
    Deploy,
    /// Back, dropping off the steps.
    Retract,
}

impl Direction {
    /// Names as written in scenarios and summaries.
    pub(crate) const NAMES: [&str; 2] = ["deploy", "retract"];

    pub const fn name(self) -> &'static str {
        Self::NAMES[self as usize]
    }
}

impl From<Direction> for interstage::units::Direction {
    fn from(direction: Direction) -> Self {
        match direction {
            Direction::Deploy => Self::Deploy,
            Direction::Retract => Self::Retract,
        }
    }
}

/// Preload and speed strategy of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ControllerKind {
    /// Preload raised ahead of each step by the plan.
    #[default]
    Scheduled,
    /// Cruise preload throughout, at the largest speed that it allows.
    Constant,
    /// The preload limit throughout.
    Limit,
    /// Preload raised when the step is detected.
    Reactive,
}

impl ControllerKind {
    /// Names as written in scenarios and summaries.
    pub(crate) const NAMES: [&str; 4] = ["scheduled", "constant", "limit", "reactive"];

    pub const fn name(self) -> &'static str {
        Self::NAMES[self as usize]
    }
}

/// Where the plant's mismatch comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum MismatchDraw {
    #[default]
    Stated,
    /// Drawn by the seed within the wide ranges; what is stated and not neutral stays.
    Wide,
    /// The same, with friction, load and heights of the steps far beyond what the rig is designed
    /// for: to see whether what goes wrong is reported.
    Adversarial,
}

impl MismatchDraw {
    /// Names as written in scenarios.
    pub(crate) const NAMES: [&str; 3] = ["stated", "wide", "adversarial"];
}

/// One step that is not where the step table says. Steps count from 1 on
/// deployment.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase", deny_unknown_fields)]
pub enum StepAnomaly {
    /// The step is nearer to the stow end than the table says.
    Early {
        step: u8,
        /// By how much, mm, positive.
        offset_mm: f64,
    },
    /// The step is farther out than the table says.
    Late {
        step: u8,
        /// By how much, mm, positive.
        offset_mm: f64,
    },
    /// The step is not there.
    Missing { step: u8 },
    /// The step is higher than the table says.
    Higher {
        step: u8,
        /// By how much, mm, positive.
        offset_mm: f64,
    },
    /// A step that the table does not know.
    Extra {
        /// Where it is, mm.
        position_mm: f64,
    },
}

impl StepAnomaly {
    /// Its kind in the catalogue of faults.
    pub(crate) const fn kind(&self) -> Kind {
        match self {
            Self::Early { .. } => Kind::Early,
            Self::Late { .. } => Kind::Late,
            Self::Missing { .. } => Kind::Missing,
            Self::Higher { .. } => Kind::Higher,
            Self::Extra { .. } => Kind::Doubled,
        }
    }

    /// Names as written in scenarios.
    pub(super) const NAMES: [&'static str; 5] = ["early", "late", "missing", "higher", "extra"];

    /// Keys beside `kind` of the anomaly of this name.
    pub(super) fn fields(kind: &str) -> &'static [&'static str] {
        match kind {
            "missing" => &["step"],
            "extra" => &["position_mm"],
            _ => &["step", "offset_mm"],
        }
    }
}

/// The step table `steps`, mm, with the anomalies applied, ascending: position of each, and
/// by how much it is higher than the table says, mm.
pub(super) fn apply(steps: &[f64], anomalies: &[StepAnomaly]) -> Vec<(f64, f64)> {
    let mut found: Vec<Option<(f64, f64)>> = steps.iter().map(|&at| Some((at, 0.0))).collect();
    let mut extra = Vec::new();
    for anomaly in anomalies {
        let (step, change) = match *anomaly {
            StepAnomaly::Early { step, offset_mm } => (step, Some((-offset_mm, 0.0))),
            StepAnomaly::Late { step, offset_mm } => (step, Some((offset_mm, 0.0))),
            StepAnomaly::Higher { step, offset_mm } => (step, Some((0.0, offset_mm))),
            StepAnomaly::Missing { step } => (step, None),
            StepAnomaly::Extra { position_mm } => {
                extra.push((position_mm, 0.0));
                continue;
            }
        };
        if let Some(place) = usize::from(step).checked_sub(1).and_then(|i| found.get_mut(i)) {
            *place = place.zip(change).map(|((at, high), (by, more))| (at + by, high + more));
        }
    }
    let mut all: Vec<(f64, f64)> = found.into_iter().flatten().chain(extra).collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn anomalies_move_remove_and_add_steps() {
        let anomalies = [
            StepAnomaly::Early { step: 1, offset_mm: 1.0 },
            StepAnomaly::Late { step: 3, offset_mm: 2.0 },
            StepAnomaly::Higher { step: 3, offset_mm: 0.5 },
            StepAnomaly::Missing { step: 2 },
            StepAnomaly::Extra { position_mm: 45.0 },
        ];
        let found = apply(&[18.0, 40.0, 62.0], &anomalies);
        assert_eq!(found, [(17.0, 0.0), (45.0, 0.0), (64.0, 0.5)]);
    }

    #[test]
    fn a_missing_step_stays_missing_whatever_else_is_said_of_it() {
        let anomalies =
            [StepAnomaly::Missing { step: 1 }, StepAnomaly::Late { step: 1, offset_mm: 2.0 }];
        assert_eq!(apply(&[18.0, 40.0], &anomalies), [(40.0, 0.0)]);
    }

    #[test]
    fn names_are_those_of_the_serialised_form() {
        use ControllerKind::{Constant, Limit, Reactive, Scheduled};
        for kind in [Scheduled, Constant, Limit, Reactive] {
            assert_eq!(serde_json::to_value(kind).unwrap(), kind.name());
        }
        for direction in [Direction::Deploy, Direction::Retract] {
            assert_eq!(serde_json::to_value(direction).unwrap(), direction.name());
        }
    }
}
