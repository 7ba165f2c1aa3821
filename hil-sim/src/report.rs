//! A run as one self-contained HTML page: verdict, ledger of the crossings, plots
//! over time and over position, each crossing enlarged, log, faults, parameters.

pub mod axis;
mod band;
mod compare;
mod crossings;
mod decimate;
pub(crate) mod ledger;
pub mod mesh;
mod overview;
mod page;
pub mod palette;
mod panel;
mod panels;
pub mod svg;
mod tables;
pub(crate) mod verdict;

use crate::record::Recording;

pub use compare::{Difference, compare_html, differences};
pub use overview::overview_svg;

/// A section of a page beside those that every run has.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Section {
    /// Its heading.
    pub title: &'static str,
    /// Its content, as HTML.
    pub body: String,
}

/// The page of `recording` with these sections more. It needs no other file and no script.
#[must_use]
pub fn html(recording: &Recording, more: &[Section]) -> String {
    page::html(recording, more)
}

#[cfg(test)]
mod tests;
#[cfg(test)]
pub(crate) use tests::example;
