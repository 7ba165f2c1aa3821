//! The plant on the host: sensor codes come and bridge commands go over the debug probe.
//!
//! The control tick, its tasks and their timing are those of the board; only the last
//! step to the pins is another. The real bridges are commanded off in every tick.
//! Without fresh codes from the host the readings age, and the controller holds as with
//! sensors that have died.

use core::cell::{Cell, RefCell};

use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_time::{Duration, Instant};
use interstage::hal::{AnalogInput, AngleBus, MotorCommand, Motors, WheelEncoder};
use interstage::link::{Gatherer, PlantCodes, PlantCommands, frame};
use interstage::sense::raw::{AdcCode, AngleFrame, BusFault, EncoderCount};
use rtt_target::{ChannelMode, DownChannel, UpChannel};

use super::Bridges;

/// Age beyond which codes count as none.
const STALE: Duration = Duration::from_millis(5);

/// What the host has said last, and when.
static LATEST: Mutex<CriticalSectionRawMutex, Cell<Option<(PlantCodes, Instant)>>> =
    Mutex::new(Cell::new(None));

/// The way from the host.
static FROM_HOST: Mutex<CriticalSectionRawMutex, RefCell<Option<(DownChannel, Gatherer)>>> =
    Mutex::new(RefCell::new(None));

/// Opens the way from the host. Call once, before the tasks start.
pub(crate) fn open(down: DownChannel) {
    FROM_HOST.lock(|way| *way.borrow_mut() = Some((down, Gatherer::new())));
}

/// The latest codes, whatever their age; what has come meanwhile is taken first.
fn latest() -> Option<(PlantCodes, Instant)> {
    FROM_HOST.lock(|way| {
        let mut way = way.borrow_mut();
        let Some((down, gatherer)) = way.as_mut() else { return };
        let mut bytes = [0; 32];
        loop {
            let count = down.read(&mut bytes);
            for byte in bytes.iter().take(count) {
                if let Some(codes) = gatherer.take(*byte) {
                    LATEST.lock(|latest| latest.set(Some((codes, Instant::now()))));
                }
            }
            if count == 0 {
                return;
            }
        }
    });
    LATEST.lock(Cell::get)
}

/// Codes that are fresh.
fn fresh() -> Result<PlantCodes, BusFault> {
    match latest() {
        Some((codes, at)) if at.elapsed() <= STALE => Ok(codes),
        _ => Err(BusFault::Timeout),
    }
}

/// The wheel's counter.
pub(crate) struct PlantWheel;

impl WheelEncoder for PlantWheel {
    fn count(&mut self) -> EncoderCount {
        EncoderCount::new(latest().map_or(0, |(codes, _)| codes.wheel))
    }
}

/// One of the two analogue sensors.
pub(crate) struct PlantAnalog(pub(crate) fn(&PlantCodes) -> u16);

impl AnalogInput for PlantAnalog {
    async fn sample(&mut self) -> Result<AdcCode, BusFault> {
        fresh().map(|codes| AdcCode::new((self.0)(&codes)))
    }
}

/// The arm's angle sensor.
pub(crate) struct PlantArm;

impl AngleBus for PlantArm {
    async fn frame(&mut self) -> Result<AngleFrame, BusFault> {
        fresh().map(|codes| AngleFrame::new(codes.arm))
    }
}

/// Commands to the host; the real bridges off.
pub(crate) struct PlantMotors {
    bridges: Bridges,
    up: UpChannel,
    cut: bool,
}

impl PlantMotors {
    /// Over this channel.
    pub(crate) fn new(bridges: Bridges, up: UpChannel) -> Self {
        Self { bridges, up, cut: false }
    }
}

impl Motors for PlantMotors {
    fn apply(&mut self, drive: MotorCommand, preload: MotorCommand) {
        self.bridges.apply(MotorCommand::OFF, MotorCommand::OFF);
        let commands = PlantCommands {
            number: latest().map_or(0, |(codes, _)| codes.number),
            drive: drive.duty.to_bits(),
            drive_on: drive.enable && !self.cut,
            preload: preload.duty.to_bits(),
            preload_on: preload.enable && !self.cut,
        };
        if let Some(frame) = frame(&commands) {
            // A host that does not read has no plant that could move.
            self.up.set_mode(ChannelMode::NoBlockSkip);
            let _ = self.up.write(&frame);
        }
    }

    fn stopped(&mut self) -> bool {
        self.cut |= latest().is_some_and(|(codes, _)| codes.stopped);
        self.cut
    }

    fn rearm(&mut self) {
        self.cut = latest().is_some_and(|(codes, _)| codes.stopped);
    }
}
