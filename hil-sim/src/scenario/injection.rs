//! One fault of a scenario: target, kind, onset, duration, magnitude.

mod catalogue;
mod kinds;

use serde::{Deserialize, Serialize};

pub use catalogue::{CATALOGUE, Entry, HARDWARE, entry};
pub use kinds::{Kind, Target};

/// When a fault begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Onset {
    /// Time since boot, s.
    Time(f64),
    /// True axial position that the wheel comes to, mm.
    Position(f64),
    /// The touch of this crossing's corner, counted from 1 over the run.
    Crossing(u8),
}

/// A fault of a run.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Injection {
    /// What breaks.
    pub target: Target,
    /// How.
    pub kind: Kind,
    /// Onset: time since boot, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at_s: Option<f64>,
    /// Onset: true position, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at_mm: Option<f64>,
    /// Onset: touch of this crossing, counted from 1 over the run.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at_crossing: Option<u8>,
    /// Duration, s; permanent if absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub duration_s: Option<f64>,
    /// Magnitude in the unit of the catalogue, which has the default.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub magnitude: Option<f64>,
}

impl Injection {
    /// A permanent fault from `at_s` on.
    pub const fn at(target: Target, kind: Kind, at_s: f64, magnitude: f64) -> Self {
        Self {
            target,
            kind,
            at_s: Some(at_s),
            at_mm: None,
            at_crossing: None,
            duration_s: None,
            magnitude: Some(magnitude),
        }
    }

    /// Whether it resets the board, at once or by the watchdog.
    pub const fn resets_board(&self) -> bool {
        self.target.resets_board(self.kind)
    }

    /// The onset; time 0 if there is none.
    pub fn from(&self) -> Onset {
        match (self.at_s, self.at_mm, self.at_crossing) {
            (_, Some(mm), _) => Onset::Position(mm),
            (_, _, Some(crossing)) => Onset::Crossing(crossing),
            (at_s, ..) => Onset::Time(at_s.unwrap_or(0.0)),
        }
    }

    /// Magnitude; by default that of the catalogue.
    pub fn magnitude(&self) -> f64 {
        let usual = entry(self.target, self.kind).map_or(0.0, |entry| entry.magnitude);
        self.magnitude.unwrap_or(usual)
    }
}

impl std::fmt::Display for Injection {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} {}", self.target.name(), self.kind.name())?;
        if let Some(entry) = entry(self.target, self.kind)
            && !entry.unit.is_empty()
        {
            write!(f, " ({} {})", self.magnitude(), entry.unit)?;
        }
        match self.from() {
            Onset::Time(s) => write!(f, " from {s} s")?,
            Onset::Position(mm) => write!(f, " from {mm} mm")?,
            Onset::Crossing(n) => write!(f, " from crossing {n}")?,
        }
        match self.duration_s {
            Some(s) => write!(f, " for {s} s"),
            None => Ok(()),
        }
    }
}
