//! The board as the tasks see it: one trait, each method with unit, freshness
//! and failure. `src/board` implements it on the STM32G474, the tests with
//! mocks, the virtual rig with its plant.

pub mod hil;

use crate::estimate::Place;
use crate::log::Identity;
use crate::restart::DriveSnapshot;
use crate::sense::raw::{AdcCode, AngleFrame, BridgeCodes, BusFault, EncoderCount};
use crate::supervise::Command;
use crate::tick::Entry;
use crate::units::MotorCommand;

/// The wheel encoder's counter.
pub trait WheelEncoder {
    /// The counter as it stands now; positive counts in the direction of
    /// deployment. Cannot fail: a lost line shows as a counter that stands still.
    fn count(&mut self) -> EncoderCount;
}

/// One analogue sensor behind its converter.
pub trait AnalogInput {
    /// Converts and returns one oversampled code, at most 0.2 ms old on return.
    ///
    /// # Errors
    /// [`BusFault`] if the conversion or its transfer failed; the next call
    /// starts afresh.
    async fn sample(&mut self) -> Result<AdcCode, BusFault>;
}

/// The arm's angle sensor on its bus.
pub trait AngleBus {
    /// Reads one frame, undecoded; the angle in it was latched at most 0.2 ms ago.
    ///
    /// # Errors
    /// [`BusFault`] if the transfer failed. Parity and the sensor's own error
    /// flag are judged by the caller.
    async fn frame(&mut self) -> Result<AngleFrame, BusFault>;
}

/// Both motors' bridges.
pub trait Motors {
    /// Sets both bridges; takes effect at the next PWM period (at most 50 us).
    /// Never blocks and cannot fail.
    fn apply(&mut self, drive: MotorCommand, preload: MotorCommand);

    /// What the bridges have put out since this was last asked, each through a low-pass of
    /// [`LAG_TICKS`](crate::supervise::LAG_TICKS), taken at some moment since the last
    /// tick; none if nothing has been converted. Never waits.
    fn readback(&mut self) -> Option<BridgeCodes>;

    /// Whether the emergency stop has cut a bridge since the last [`Motors::rearm`].
    /// While it has, bridges stay without power whatever is applied.
    fn stopped(&mut self) -> bool;

    /// Gives the bridges back their power after an emergency stop, if its contact is
    /// closed again. Called only with both bridges commanded off.
    fn rearm(&mut self);
}

/// The independent watchdog.
pub trait Watchdog {
    /// Restarts the time-out (100 ms on the board).
    fn feed(&mut self);

    /// Keeps what the drive does in this tick where a restart finds it. A board without
    /// such a place keeps nothing.
    fn keep(&mut self, snapshot: &DriveSnapshot);

    /// Where the wheel stands by what was kept before this start, if that tells.
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
    /// Reads what has come, at most what fits; none if nothing has. Never waits.
    fn read(&mut self, bytes: &mut [u8]) -> usize;

    /// Writes all of it or nothing; whether it was taken. Never waits.
    fn write(&mut self, bytes: &[u8]) -> bool;

    /// Starts the board anew. The bridges are off from then on.
    fn restart(&mut self);
}

/// Where log entries go.
pub trait Journal {
    /// Writes one entry without blocking; what does not fit is dropped and
    /// counted by the transport.
    fn write(&mut self, entry: &Entry);

    /// Takes a frame of the binary log, whole or not at all, without blocking; says
    /// whether it did. A journal without a channel for them takes none.
    fn send(&mut self, frame: &[u8]) -> bool {
        let _ = frame;
        false
    }

    /// Who speaks, for the head of the binary log.
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

/// A board: one implementation of each part.
pub trait Board {
    /// Wheel encoder.
    type Wheel: WheelEncoder;
    /// Preload sensor.
    type PreloadSensor: AnalogInput;
    /// Compression sensor.
    type CompressionSensor: AnalogInput;
    /// Arm angle sensor.
    type Arm: AngleBus;
    /// Motor bridges.
    type Motors: Motors;
    /// Watchdog.
    type Watchdog: Watchdog;
    /// Board button.
    type Button: CommandSource;
    /// Command input on the log channel.
    type Console: CommandSource;
    /// Log output.
    type Journal: Journal;
    /// Light.
    type Light: Indicator;
}

/// A board taken apart, so that each task owns what it uses and nothing else.
pub struct Parts<B: Board> {
    /// For the speed task.
    pub wheel_encoder: B::Wheel,
    /// For the pressure task.
    pub preload_sensor: B::PreloadSensor,
    /// For the displacement task.
    pub compression_sensor: B::CompressionSensor,
    /// For the angle task.
    pub arm_angle: B::Arm,
    /// For the motor task.
    pub motors: B::Motors,
    /// For the motor task, which feeds it when all tasks have checked in.
    pub watchdog: B::Watchdog,
    /// For the first operator task.
    pub button: B::Button,
    /// For the second operator task.
    pub console: B::Console,
    /// For the logging task.
    pub journal: B::Journal,
    /// For the logging task.
    pub light: B::Light,
}
