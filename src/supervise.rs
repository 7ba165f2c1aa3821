//! Modes, commands, faults and limits, and the one table of transitions.

#[cfg(not(target_os = "none"))]
mod account;
pub mod codes;
mod crosscheck;
mod fault;
mod mode;
mod monitor;
mod readback;
mod transition;

#[cfg(not(target_os = "none"))]
pub use account::Account;
pub use fault::{Fault, Limit};
pub use mode::{Command, Direction, Leg, Mode};
pub use monitor::{Monitor, MonitorState, Observed};
pub use readback::{BAND, BAND_SHIFT, LAG_TICKS, Lag, OFF_TICKS, Readback};
pub use transition::{Trigger, next};
