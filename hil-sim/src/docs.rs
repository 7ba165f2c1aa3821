//! The parts of the documentation that are written by `cargo rig docs`.

pub mod blocks;
pub mod model;
mod modes;
mod safety;

pub use model::{fill_model, model_svg};
pub use modes::modes;
pub use safety::{fill_board, fill_safety};

/// Head of a generated page.
#[must_use]
pub fn head(title: &str) -> String {
    format!("# {title}\n\nWritten by `cargo rig docs`; do not edit.\n")
}
