//! What is known of the axial position.

use crate::sense::Zeros;
use crate::units::Millimetres;

/// Position of the wheel, and what its sensors showed unloaded, by the record of the run before.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// Axial position, mm.
    pub position: Millimetres,
    /// The bridges were off when the record ends, and the start followed at once: the wheel
    /// has coasted at most. If not, the drive ran unobserved, or the supply was away.
    pub sure: bool,
    /// Zeros of the analogue sensors.
    pub zeros: Zeros,
}

/// How far a position can be trusted after a restart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PositionConfidence {
    /// Not at all: the place on the wall is assumed.
    Guess,
    /// It comes from a record which may be off, and no step has confirmed it.
    Unsure,
    /// It counts from the stow end, or from a step.
    Sure,
}

/// What is known of the position.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Position {
    /// Nothing: the odometry has no origin.
    #[default]
    Unknown,
    /// A record has it; the arm has not been compared with it yet.
    Recorded(Place),
    /// Taken from a record or from a corner under the wheel. The next run first finds out
    /// whether the wheel is on a corner.
    Restored {
        /// As [`Place::sure`].
        sure: bool,
    },
    /// From a record which may be off; no step has confirmed it.
    Unconfirmed {
        /// The next step found sets the position; if not, no step lies ahead.
        searching: bool,
    },
    /// Assumed: the next step found sets it, and until then the drive goes as if the step
    /// came at once.
    Searching,
    /// Counted from the stow end, or from a step.
    Located,
}

impl Position {
    /// Whether the odometry has an origin.
    pub const fn is_located(self) -> bool {
        !matches!(self, Self::Unknown | Self::Recorded(_))
    }

    /// Whether the next step found sets the position.
    pub const fn is_searching(self) -> bool {
        use Position::{Restored, Searching, Unconfirmed};
        matches!(self, Searching | Unconfirmed { searching: true } | Restored { sure: false })
    }

    /// Whether it is that of a record which may be off.
    pub const fn is_unsure(self) -> bool {
        match self {
            Self::Recorded(place) => !place.sure,
            Self::Restored { sure } => !sure,
            Self::Unconfirmed { .. } => true,
            _ => false,
        }
    }

    /// The run after a restart begins; whether the wheel has to be looked for on a corner.
    pub fn begin_run(&mut self) -> bool {
        let Self::Restored { sure } = *self else { return false };
        *self = if sure { Self::Located } else { Self::Unconfirmed { searching: true } };
        true
    }

    /// No step lies ahead that could set the position.
    pub fn stop_searching(&mut self) {
        *self = Self::Unconfirmed { searching: false };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_from_a_doubtful_position_searches_for_its_step() {
        for (sure, after) in
            [(true, Position::Located), (false, Position::Unconfirmed { searching: true })]
        {
            let mut position = Position::Restored { sure };
            assert_eq!(position.is_unsure(), !sure);
            assert!(position.begin_run(), "the wheel is looked for on a corner");
            assert_eq!((position, position.is_searching()), (after, !sure));
            assert!(!position.begin_run(), "once alone");
        }
        let mut position = Position::Unconfirmed { searching: true };
        position.stop_searching();
        assert_eq!(position, Position::Unconfirmed { searching: false });
    }
}
