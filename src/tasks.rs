//! The asynchronous tasks around the control tick, generic over the board.
//!
//! | task | rate | does |
//! |---|---|---|
//! | [`speed()`] | 1 kHz | publishes the wheel counter |
//! | [`pressure()`] | 1 kHz | publishes the load cell's code |
//! | [`displacement()`] | 1 kHz | publishes the tread sensor's code |
//! | [`angle()`] | 500 Hz | publishes the arm sensor's frame |
//! | [`motors()`] | 1 kHz | the control tick: latest codes in, bridges out |
//! | [`tape()`] | 1 kHz | takes the tick down for the log, behind it |
//! | [`model()`] | on request | plans the next segment |
//! | [`operator()`] | on command | hands commands to the tick; one task a source |
//! | [`link()`] | on request | reads and replaces the stored parameters |
//! | [`journal()`] | on entry | writes the log, shows the light |
//!
//! They share one [`Exchange`] and nothing else. Whatever the tick reads is there
//! already or is taken as absent: it waits for time only. A sensor that hangs makes
//! its reading age; a task that hangs starves the watchdog, which is fed only while
//! every task has checked in within [`CHECK_IN_TICKS`].

mod beat;
mod exchange;
mod journal;
mod link;
mod model;
mod motors;
mod operator;
mod sensors;
mod tape;

pub use exchange::{CHECK_IN_TICKS, COMMANDS, ENTRIES, Exchange, TaskId};
pub use journal::journal;
pub use link::link;
pub use model::model;
pub use motors::motors;
pub use operator::operator;
pub use sensors::{SENSOR_TIMEOUT, angle, displacement, pressure, speed};
pub use tape::{Latest, tape};

use embassy_time::Duration;

/// How often a task that waits for something else checks in: well inside
/// [`CHECK_IN_TICKS`], with room for a plan being worked out.
const ROUND: Duration = Duration::from_millis(20);
