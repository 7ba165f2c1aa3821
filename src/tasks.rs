//! The asynchronous tasks around the control tick, generic over the board.
//!
//! | task | rate | does |
//! |---|---|---|
//! | [`clock()`] | 1 kHz | wakes sensors and control tick at each whole millisecond |
//! | [`wheel_encoder()`] | 1 kHz | publishes the wheel counter |
//! | [`analog()`] | 1 kHz | publishes the code of preload or compression sensor |
//! | [`arm_angle()`] | 500 Hz | publishes the arm sensor's frame |
//! | [`motors()`] | 1 kHz | the control tick: latest codes in, bridges out |
//! | [`record()`] | 1 kHz | copies the tick for the log, behind it |
//! | [`model()`] | on request | plans the next segment |
//! | [`operator()`] | on command | hands commands to the tick; one task a source |
//! | [`link()`] | on request | reads and replaces the stored parameters |
//! | [`journal()`] | on entry | writes the log, shows the light |
//!
//! They share one [`Exchange`] alone. The tick waits for time only, never for data. The reading of
//! a sensor that hangs ages; a task that hangs stops the feeding of the watchdog, which needs
//! every task's check-in within [`CHECK_IN_TICKS`].

mod background;
mod clock;
mod cycles;
mod exchange;
mod liveness;
mod motors;
mod sensors;

pub use background::{journal, link, model, operator};
pub use clock::{clock, mid_tick_deadline};
pub use cycles::TickCycles;
pub use exchange::{COMMANDS, ENTRIES, Exchange, TickIo};
pub use liveness::{CHECK_IN_TICKS, TaskId};
pub use motors::{TickIoCell, motors, record};
pub use sensors::{SENSOR_TIMEOUT, analog, arm_angle, wheel_encoder};

use embassy_time::Duration;

/// How often a task that waits for something else checks in: well inside
/// [`CHECK_IN_TICKS`], with room for a plan being worked out.
const ROUND: Duration = Duration::from_millis(20);
