//! A run as one self-contained HTML page: verdict, ledger of the crossings, plots
//! over time and over position, each crossing enlarged, log, faults, parameters.

pub mod axis;
mod band;
mod compare;
mod crossings;
mod decimate;
#[cfg(test)]
pub(crate) mod example;
pub mod mesh;
mod overview;
mod page;
pub mod palette;
mod panel;
mod panels;
pub mod svg;
mod tables;
pub(crate) mod verdict;

use std::path::Path;

use crate::export::{ExportError, write_text};
use crate::record::Recording;

pub use compare::{Difference, compare_html, differences};
pub use overview::overview_svg;

/// The page of `recording`. It needs no other file and no script.
#[must_use]
pub fn html(recording: &Recording) -> String {
    page::html(recording, &[])
}

/// A section of a page beside those that every run has.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Section {
    /// Its heading.
    pub title: &'static str,
    /// What stands in it, as HTML.
    pub body: String,
}

/// Writes the page of `recording` to `path`.
///
/// # Errors
/// [`ExportError::File`] with the reason.
pub fn write_html(recording: &Recording, path: &Path) -> Result<(), ExportError> {
    write_html_with(recording, &[], path)
}

/// The same with these sections more.
///
/// # Errors
/// As [`write_html`].
pub fn write_html_with(
    recording: &Recording,
    more: &[Section],
    path: &Path,
) -> Result<(), ExportError> {
    write_text(path, &page::html(recording, more))
}

#[cfg(test)]
mod tests;
