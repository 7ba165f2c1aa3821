//! The reduced model of a crossing, the same polynomials as the shipping one, in whatever
//! arithmetic: what would it cost and how exact would it be in another? Builds for the
//! host and for the board.
//!
//! Nothing ships from here. The shipping model is `interstage::model::reduced`; its
//! formats are chosen by hand, here they are what the arithmetic gives.

#![no_std]

mod model;
mod number;

pub use model::{
    Answer, CELL, COEFFICIENTS, FAST_CELLS, FELT, FORCE_CELLS, Given, Model, Shared, WAY, Way,
};
pub use number::{Double, Fixed, HalfOctave, Libm, Micro, Number};
