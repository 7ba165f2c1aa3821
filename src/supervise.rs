//! Modes, commands, faults and limits, and the one table of transitions.

mod fault;
mod mode;

pub use fault::{Fault, Limit};
pub use mode::{Command, Direction, Leg, Mode};
