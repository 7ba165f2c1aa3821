//! Collision: the force between tread and corner.
//!
//! The study models it as a cone that is pressed into the tread (14-29). What the wheel
//! meets is a straight edge as wide as itself, and at millimetres per second it meets it
//! quasi-statically, so the models that count are those of the ring: [`quasi_static()`],
//! [`dynamic()`] with the inertia of what moves, and [`elastic`], their limit without memory,
//! in closed form. The study's own laws in their corrected form stand beside them:
//! [`hereditary`] (15, 16, 29), [`hunt_crossley`] (14), and, to show what it does,
//! [`as_printed`] (17, 28).

pub mod as_printed;
mod crossing;
mod dynamic;
pub mod elastic;
pub mod hereditary;
pub mod hunt_crossley;
mod quasi_static;

#[cfg(test)]
mod tests;

use super::case::{Case, ReferenceError};

pub use crossing::{Crossing, Lift, Sample};
pub use dynamic::dynamic;
pub use quasi_static::quasi_static;

/// Time, s, from the touch of the corner on, and the collision force, N: what the
/// contact presses against the motion, with the inertia of what moves.
///
/// # Errors
/// [`ReferenceError`] if an argument is out of range or the preload cannot be carried.
pub fn history(case: &Case) -> Result<Vec<(f64, f64)>, ReferenceError> {
    let crossing = dynamic(case)?;
    Ok(crossing.samples.iter().map(|sample| (sample.t_s, sample.axial_n)).collect())
}
