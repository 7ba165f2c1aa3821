//! Modes, commands, faults and limits, and the one table of transitions.

mod crosscheck;
mod fault;
mod mode;
mod monitor;
mod transition;

pub use fault::{Fault, Limit};
pub use mode::{Command, Direction, Leg, Mode};
pub use monitor::{Monitor, MonitorState, Observed};
pub use transition::{Trigger, next};
