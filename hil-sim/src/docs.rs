//! The parts of the documentation that are written by `cargo rig docs`.

mod modes;

pub use modes::modes;

/// Head of a generated page.
#[must_use]
pub fn head(title: &str) -> String {
    format!("# {title}\n\nWritten by `cargo rig docs`; do not edit.\n")
}
