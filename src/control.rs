//! The control tick: sensors, estimate, phase, schedule, loops, actuators.

mod step;

pub use step::{Controller, EVENTS_PER_TICK, Input, Output, State};
