//! The board as the tasks see it: one trait a part, each method with unit, freshness and
//! failure. `src/board` implements them on the STM32G474, the tests with mocks.

pub mod hil;

use crate::estimate::Place;
use crate::log::{Identity, Record};
use crate::restart::DriveSnapshot;
use crate::sense::raw::{AdcCode, AngleFrame, BridgeCodes, BusFault, EncoderCount};
use crate::supervise::Command;
use crate::tasks::TickCycles;
use crate::tick::Entry;
use crate::units::{MotorCommand, Tick};

/// The wheel encoder's counter.
pub trait WheelEncoder {
    /// The present count, positive in the direction of deployment. Cannot fail: a lost line
    /// shows as a count that does not change.
    fn count(&mut self) -> EncoderCount;
}

/// One analogue sensor behind its converter.
pub trait AnalogInput {
    /// Converts and returns one oversampled code, at most 0.2 ms old on return.
    ///
    /// # Errors
    /// [`BusFault`] if the conversion or its transfer failed; the next call starts again.
    async fn sample(&mut self) -> Result<AdcCode, BusFault>;
}

/// The arm's angle sensor on its bus.
pub trait AngleBus {
    /// Reads one frame, undecoded; the angle in it was latched at most 0.2 ms ago.
    ///
    /// # Errors
    /// [`BusFault`] if the transfer failed. The caller judges parity and error flag.
    async fn frame(&mut self) -> Result<AngleFrame, BusFault>;
}

/// Both motors' bridges.
pub trait Motors {
    /// Sets both bridges; takes effect at the next PWM period (at most 50 us).
    /// Never blocks and cannot fail.
    fn apply(&mut self, drive: MotorCommand, preload: MotorCommand);

    /// Output of the bridges since the last call, each through a low-pass of
    /// [`LAG_TICKS`](crate::supervise::LAG_TICKS); none if nothing has been converted. Never
    /// waits.
    fn readback(&mut self) -> Option<BridgeCodes>;

    /// Whether the emergency stop has cut a bridge since the last [`Motors::rearm`].
    /// While it has, bridges stay without power whatever is applied.
    fn stopped(&mut self) -> bool;

    /// Re-enables the bridges after an emergency stop, if its contact is closed again. Called
    /// only with both bridges commanded off.
    fn rearm(&mut self);
}

/// The independent watchdog.
pub trait Watchdog {
    /// Restarts the time-out (100 ms on the board).
    fn feed(&mut self);

    /// Keeps the snapshot of this tick where a restart finds it, if the board can.
    fn keep(&mut self, snapshot: &DriveSnapshot);

    /// The core's counter of cycles, which wraps; 0 without one.
    fn cycles(&self) -> u32 {
        0
    }

    /// Position of the wheel by the record of the run before, if there is one.
    fn place(&self) -> Option<Place> {
        None
    }
}

/// A source of operator commands: the board button or the log channel.
pub trait CommandSource {
    /// Waits for the next command. Malformed input is dropped by the source.
    async fn next(&mut self) -> Command;
}

/// The binary line to the host.
pub trait Line {
    /// Reads what has arrived, at most what fits; returns its length. Never waits.
    fn read(&mut self, bytes: &mut [u8]) -> usize;

    /// Writes all of it or nothing, and returns which. Never waits.
    fn write(&mut self, bytes: &[u8]) -> bool;

    /// Restarts the board. The bridges are off from then on.
    fn restart(&mut self);
}

/// Where log entries go.
pub trait Journal {
    /// Writes one entry without blocking; the transport counts what it has to drop.
    fn write(&mut self, entry: &Entry);

    /// Writes a frame of the log completely or not at all, and returns which. Never blocks.
    fn send(&mut self, _frame: &[u8]) -> bool {
        false
    }

    /// Writes what the control tick took since the last such line, as [`Journal::write`] does.
    fn write_cycles(&mut self, _at: Tick, _cycles: TickCycles) {}

    /// Sees every tick's record before it is sent.
    fn see(&mut self, _record: &Record) {}

    /// Identity for the head of the binary log.
    fn identity(&self) -> Identity {
        Identity::default()
    }
}

/// What the board's light shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Light {
    /// Idle, complete or starting: off.
    #[default]
    Off,
    /// Moving or building preload: on.
    On,
    /// Fault held: blinking, 4 Hz.
    Alarm,
}

/// The board's light.
pub trait Indicator {
    /// Sets the light.
    fn show(&mut self, light: Light);
}
