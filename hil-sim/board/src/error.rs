//! What can go wrong with an image and with a run.

use hil_sim::firmware::FirmwareError;
use hil_sim::plant::rig::PlantError;
use interstage::params::CompileError;
use interstage::rig::RigError;

use crate::core::CoreError;

/// Why an image does not run.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    #[error("not an image of the board: {0}")]
    Form(String),
    #[error("the image has no function {0}")]
    Missing(String),
    #[error(transparent)]
    Core(#[from] CoreError),
    /// A call panicked or did not return.
    #[error("{function} ended in {at}")]
    Lost {
        function: String,
        /// The function in which it ended, and how.
        at: String,
    },
}

impl ImageError {
    /// The file has another form than an image.
    pub(crate) fn form(error: impl ToString) -> Self {
        Self::Form(error.to_string())
    }
}

/// Why a run on the board cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum BoardError {
    #[error(transparent)]
    Image(#[from] ImageError),
    #[error(transparent)]
    Plant(#[from] PlantError),
    #[error(transparent)]
    Firmware(#[from] FirmwareError),
    #[error("the firmware schedules: --controller {0} runs in software alone")]
    Controller(String),
    #[error(transparent)]
    Rig(#[from] RigError),
    /// The rig cannot be put into the board's flash.
    #[error(transparent)]
    Parameters(#[from] CompileError),
}

impl From<CoreError> for BoardError {
    fn from(error: CoreError) -> Self {
        Self::Image(error.into())
    }
}
