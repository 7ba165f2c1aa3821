//! The asynchronous tasks around the control tick, generic over the board.
//!
//! | task | rate | does |
//! |---|---|---|
//! | [`clock()`] | 1 kHz | wakes sensors and control tick at each whole millisecond |
//! | [`wheel_encoder()`] | 1 kHz | publishes the wheel counter |
//! | [`preload_sensor()`] | 1 kHz | publishes the preload sensor's code |
//! | [`compression_sensor()`] | 1 kHz | publishes the compression sensor's code |
//! | [`arm_angle()`] | 500 Hz | publishes the arm sensor's frame |
//! | [`motors()`] | 1 kHz | the control tick: latest codes in, bridges out |
//! | [`record()`] | 1 kHz | copies the tick for the log, behind it |
//! | [`model()`] | on request | plans the next segment |
//! | [`operator()`] | on command | hands commands to the tick; one task a source |
//! | [`link()`] | on request | reads and replaces the stored parameters |
//! | [`journal()`] | on entry | writes the log, shows the light |
//!
//! They share one [`Exchange`] and nothing else. The tick waits for time only: what it
//! reads is there already or is taken as absent. A sensor that hangs makes
//! its reading age; a task that hangs starves the watchdog, which is fed only while
//! every task has checked in within [`CHECK_IN_TICKS`].

mod clock;
mod exchange;
mod journal;
mod link;
mod liveness;
mod model;
mod motors;
mod operator;
mod sensors;

pub use clock::{clock, mid_tick_deadline};
pub use exchange::{COMMANDS, ENTRIES, Exchange, TickIo};
pub use journal::journal;
pub use link::link;
pub use liveness::{CHECK_IN_TICKS, TaskId};
pub use model::model;
pub use motors::{TickIoCell, motors, record};
pub use operator::operator;
pub use sensors::{SENSOR_TIMEOUT, arm_angle, compression_sensor, preload_sensor, wheel_encoder};

use embassy_time::Duration;

/// How often a task that waits for something else checks in: well inside
/// [`CHECK_IN_TICKS`], with room for a plan being worked out.
const ROUND: Duration = Duration::from_millis(20);
