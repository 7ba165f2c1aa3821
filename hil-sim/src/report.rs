//! A run as one self-contained HTML page: verdict, ledger of the crossings, the
//! wheel at the steps as an animation, plots over time and over position, each crossing enlarged, log, faults, parameters.

mod animated;
mod animation;
pub mod axis;
mod band;
mod compare;
mod crossings;
mod decimate;
mod page;
pub mod palette;
pub mod panel;
mod panels;
mod scene;
pub(crate) mod svg;
mod tables;
pub(crate) mod verdict;

pub(crate) use animated::animated_svg;
pub(crate) use compare::{Difference, beside_svg, compare_html, differences, table as compared};
pub(crate) use page::capital;
pub use page::{Section, html, log_html, page_of};
pub(crate) use panels::overview_svg;
pub(crate) use scene::Geometry;
pub(crate) use tables::{COLUMNS, slowed_by, table};

#[cfg(test)]
mod tests;
#[cfg(test)]
pub(crate) use tests::example;
