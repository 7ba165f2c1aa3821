//! What cannot be computed.

use thiserror::Error;

use super::beam::BeamError;
use hil_sim::plant::balance::BalanceError;

/// Why a reference gives no result.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ReferenceError {
    /// An argument outside its range.
    #[error("{argument} is {value}, expected {expected}")]
    OutOfRange {
        /// Name of the argument.
        argument: &'static str,
        /// What was given, in the unit of the argument's name.
        value: f64,
        /// What it should have been.
        expected: &'static str,
    },
    /// No height of the wheel carries the preload.
    #[error(transparent)]
    Balance(#[from] BalanceError),
    /// The beam refused.
    #[error(transparent)]
    Beam(#[from] BeamError),
}

/// `ok`, or the error that names the argument.
pub(super) fn require(
    argument: &'static str,
    value: f64,
    ok: bool,
    expected: &'static str,
) -> Result<(), ReferenceError> {
    if ok { Ok(()) } else { Err(ReferenceError::OutOfRange { argument, value, expected }) }
}

/// A finite number above 0, or the error that names the argument.
pub(super) fn positive(argument: &'static str, value: f64) -> Result<(), ReferenceError> {
    require(argument, value, value.is_finite() && value > 0.0, "a finite number above 0")
}
