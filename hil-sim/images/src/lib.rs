//! What the host and a measurement image exchange: plain words in one memory, in the
//! order in which they are declared.

#![no_std]

pub mod arith;
pub mod digest;
pub mod model;
pub mod tick;
