//! What can go wrong with an image.

use std::path::PathBuf;

use crate::core::CoreError;

/// Why an image does not run.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    /// The file could not be read.
    #[error("could not read {path}: {source}")]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// It is no image of the board.
    #[error("not an image of the board: {0}")]
    Form(String),
    /// It lacks a function or another symbol.
    #[error("the image has no function {0}")]
    Missing(String),
    /// The core stopped.
    #[error(transparent)]
    Core(#[from] CoreError),
    /// A call ended where it should not have: it panicked, or did not end at all.
    #[error("{function} ended in {at}")]
    Lost {
        /// What was called.
        function: String,
        /// The function it ended in.
        at: String,
    },
}

impl ImageError {
    /// The file has another form than an image.
    pub(crate) fn form(error: impl ToString) -> Self {
        Self::Form(error.to_string())
    }
}
