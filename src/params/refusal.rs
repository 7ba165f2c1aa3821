//! Reasons to refuse a host's request about the parameters.

use serde::{Deserialize, Serialize};

use super::SetError;

/// Reason of a refusal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Refusal {
    /// The drive is not at rest.
    Moving,
    /// There is no draft: `Begin` comes first.
    NoDraft,
    /// The set is too long or incomplete.
    Length,
    /// A piece is not a multiple of eight bytes.
    Piece,
    /// The flash failed.
    Flash,
    /// The set is damaged or not readable.
    Damaged,
    /// The set is of another schema.
    Schema,
    /// The set in force is damaged.
    Lost,
}

impl Refusal {
    /// The reason in words.
    pub const fn sentence(self) -> &'static str {
        match self {
            Self::Moving => "the drive is not at rest",
            Self::NoDraft => "no new set has been begun",
            Self::Length => "the new set is too long or not all there",
            Self::Piece => "a piece of the new set is no multiple of eight bytes",
            Self::Flash => "the flash failed",
            Self::Damaged => "the new set arrived damaged",
            Self::Schema => "the new set is of another schema than the firmware",
            Self::Lost => "the set in force is damaged: restore the image's, or one from a file",
        }
    }
}

impl From<SetError> for Refusal {
    fn from(error: SetError) -> Self {
        match error {
            SetError::Schema { .. } => Self::Schema,
            _ => Self::Damaged,
        }
    }
}
