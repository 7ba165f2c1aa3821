//! Collision: the force between tread and corner.
//!
//! The study models it as a cone that is pressed into the tread (14-29). What the wheel
//! meets is a straight edge as wide as itself, and at millimetres per second it meets it
//! quasi-statically, so the models that count are those of the ring: [`quasi_static()`],
//! [`dynamic()`] with the inertia of what moves, and [`elastic`], their limit without memory,
//! in closed form.

mod crossing;
mod dynamic;
pub mod elastic;
mod quasi_static;

#[cfg(test)]
mod tests;

pub use crossing::{Crossing, Lift, Sample};
pub use dynamic::dynamic;
pub use quasi_static::quasi_static;
