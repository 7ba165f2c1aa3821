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

pub use crosscheck::off_reference_mm;
pub use mode::{Command, Leg, Mode};
pub use monitor::{Monitor, MonitorState, OVERPRESSURE_TICKS, Observed};
pub use readback::{BAND, BAND_SHIFT, LAG_TICKS, Lag, OFF_TICKS, Readback};
pub use service::ServiceDuties;
pub use transition::{Trigger, next};
