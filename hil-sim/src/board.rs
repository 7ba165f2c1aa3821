//! The emulated board: the processor core, what its instructions cost, and images that
//! run on it.

pub mod account;
pub mod core;
pub mod image;
pub mod model;
pub mod thumb;
pub mod timing;
