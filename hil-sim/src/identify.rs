//! Identifies the parameters of a rig from its logs.

use std::ops::RangeInclusive;

pub mod accept;
pub(crate) mod actuator;
mod agree;
pub(crate) mod contact;
pub(crate) mod coordinates;
pub(crate) mod forward;
pub(crate) mod least_squares;
pub(crate) mod plot;
pub mod published;
pub mod record;
pub mod result;
pub(crate) mod traces;

/// Seeds of the hidden rigs that set constants of identification, by which nothing is judged: the
/// widening of intervals, what the ring is off by, and what the pre-tightener's model is.
pub const CALIBRATION: [RangeInclusive<u64>; 3] = [1..=10, 50_001..=50_016, 7_300_001..=7_600_020];

/// Why nothing was identified.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum IdentifyError {
    /// The log of this name cannot be used, and why.
    #[error("{0}: {1}")]
    Log(String, String),
    /// The log of this name is of another rig than the rest, and by how many deviations a
    /// coordinate it disagrees.
    #[error("{0}: not of the rig of the other logs: by {1:.0} deviations it disagrees with them")]
    Several(String, f64),
    /// The fit found nothing, and why.
    #[error("the fit did not settle: {0}")]
    NoFit(String),
}
