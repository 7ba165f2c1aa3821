//! Modes and their transition table, self-test, and the monitors that find faults.

pub mod codes;
mod crosscheck;
mod mode;
mod monitor;
mod motor;
mod readback;
pub mod service;
pub mod startup;
mod transition;

pub use mode::{Command, Leg, Mode};
pub use monitor::{Monitor, MonitorState, Observed};
pub use readback::{BAND, BAND_SHIFT, LAG_TICKS, Lag, OFF_TICKS, Readback};
pub use service::ServiceDuties;
pub use transition::{Trigger, next};
