//! The control tick: sensors, estimate, phase, schedule, loops, actuators.

pub mod preload_loop;
pub mod profile;
pub mod rise;
pub mod saturate;
pub mod schedule;
pub mod speed_loop;
mod start;
mod step;

pub use step::{Controller, EVENTS_PER_TICK, Input, Output, State};
