//! Parameters of a rig out of its logs.

pub mod actuator;
pub mod contact;
pub mod coordinates;
pub mod forward;
pub mod least_squares;
pub mod noise;
pub mod plot;
pub mod published;
pub mod read;
pub mod record;
pub mod result;
pub mod traces;

/// Why nothing was identified.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum IdentifyError {
    /// A log cannot be used.
    #[error("{name}: {why}")]
    Log {
        /// The log.
        name: String,
        /// Why.
        why: String,
    },
    /// The fit found nothing.
    #[error("the fit did not settle: {why}")]
    NoFit {
        /// Why.
        why: String,
    },
}
