//! What the tasks hand to one another.

use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use crate::control::{Input, Output};
use crate::hal::Light;
use crate::log::{Entry, Telemetry};
use crate::model::{Plan, PlanRequest};
use crate::sense::freshness::age;
use crate::sense::raw::{AdcCode, AngleFrame, EncoderCount, Sample, SensorFrame};
use crate::supervise::{Command, Mode};
use crate::units::Tick;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embassy_sync::signal::Signal;
use embassy_sync::watch::Watch;

/// Log entries that wait for the journal at most; beyond, new ones are dropped and
/// counted.
pub const ENTRIES: usize = 64;

/// Commands that wait for the tick at most; beyond, their source waits.
pub const COMMANDS: usize = 4;

/// Longest time without a check-in of a healthy task, ticks.
pub const CHECK_IN_TICKS: u32 = 50;

/// Most operator tasks.
const OPERATORS: usize = 4;

/// The latest value of something: written by one task, polled by the tick.
type Slot<T> = Watch<CriticalSectionRawMutex, T, 0>;

/// A task that checks in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Station {
    /// [`speed`](super::speed()).
    Speed,
    /// [`pressure`](super::pressure()).
    Pressure,
    /// [`displacement`](super::displacement()).
    Displacement,
    /// [`angle`](super::angle()).
    Angle,
    /// [`model`](super::model()).
    Model,
    /// [`journal`](super::journal()).
    Journal,
    /// [`operator`](super::operator()), numbered in the order of starting.
    Operator(u8),
}

impl Station {
    /// Stations that must always be manned.
    const FIXED: usize = 6;

    const fn index(self) -> usize {
        match self {
            Self::Speed => 0,
            Self::Pressure => 1,
            Self::Displacement => 2,
            Self::Angle => 3,
            Self::Model => 4,
            Self::Journal => 5,
            Self::Operator(number) => Self::FIXED + number as usize,
        }
    }
}

/// Everything the tasks share: one in a `static`, or one per test.
pub struct Exchange {
    pub(super) wheel: Slot<Sample<EncoderCount>>,
    pub(super) load_cell: Slot<Sample<AdcCode>>,
    pub(super) tread: Slot<Sample<AdcCode>>,
    pub(super) arm: Slot<Sample<AngleFrame>>,
    pub(super) request: Signal<CriticalSectionRawMutex, PlanRequest>,
    pub(super) answer: Signal<CriticalSectionRawMutex, Plan>,
    pub(super) commands: Channel<CriticalSectionRawMutex, Command, COMMANDS>,
    pub(super) entries: Channel<CriticalSectionRawMutex, Entry, ENTRIES>,
    telemetry: Slot<Telemetry>,
    light: Slot<Light>,
    /// Nothing is driven.
    at_rest: AtomicBool,
    lost_entries: AtomicU32,
    bus_faults: [AtomicU32; 4],
    check_ins: [AtomicU32; Station::FIXED + OPERATORS],
    operators: AtomicU32,
}

impl Exchange {
    /// An exchange with nothing in it.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            wheel: Slot::new(),
            load_cell: Slot::new(),
            tread: Slot::new(),
            arm: Slot::new(),
            request: Signal::new(),
            answer: Signal::new(),
            commands: Channel::new(),
            entries: Channel::new(),
            telemetry: Slot::new(),
            light: Slot::new(),
            at_rest: AtomicBool::new(true),
            lost_entries: AtomicU32::new(0),
            bus_faults: [const { AtomicU32::new(0) }; 4],
            check_ins: [const { AtomicU32::new(0) }; Station::FIXED + OPERATORS],
            operators: AtomicU32::new(0),
        }
    }

    /// What a tick at `now` is given; takes the oldest command and the plan out.
    pub fn input(&self, now: Tick, overrun: bool) -> Input {
        Input {
            now,
            sensors: self.sensors(),
            command: self.commands.try_receive().ok(),
            plan: self.answer.try_take(),
            overrun,
            emergency_stop: false,
        }
    }

    /// Passes on what a tick gave, except the motors' part.
    pub fn publish(&self, output: &Output) {
        if let Some(request) = output.request {
            self.request_plan(request);
        }
        for &entry in &output.events {
            self.log(entry);
        }
        self.telemetry.sender().send(output.telemetry);
        let mode = output.telemetry.mode;
        self.at_rest.store(mode.is_at_rest(), Ordering::Relaxed);
        self.show(light_of(mode));
    }

    /// Asks the model task for a plan; replaces a request not yet begun.
    pub fn request_plan(&self, request: PlanRequest) {
        self.request.signal(request);
    }

    /// Puts an entry in the log's queue, or counts it as lost.
    pub fn log(&self, entry: Entry) {
        if self.entries.try_send(entry).is_err() {
            self.lost_entries.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Sets what the light is to show.
    pub fn show(&self, light: Light) {
        self.light.sender().send(light);
    }

    /// The latest code of each sensor.
    #[must_use]
    pub fn sensors(&self) -> SensorFrame {
        SensorFrame {
            wheel: self.wheel.anon_receiver().try_get(),
            load_cell: self.load_cell.anon_receiver().try_get(),
            tread: self.tread.anon_receiver().try_get(),
            arm: self.arm.anon_receiver().try_get(),
        }
    }

    /// The row of the latest tick; none before the first.
    #[must_use]
    pub fn telemetry(&self) -> Option<Telemetry> {
        self.telemetry.anon_receiver().try_get()
    }

    /// What the light is to show.
    #[must_use]
    pub fn light(&self) -> Light {
        self.light.anon_receiver().try_get().unwrap_or_default()
    }

    /// Whether nothing is driven, as of the latest tick.
    #[must_use]
    pub fn at_rest(&self) -> bool {
        self.at_rest.load(Ordering::Relaxed)
    }

    /// Log entries dropped since boot because the journal did not keep up.
    #[must_use]
    pub fn lost_entries(&self) -> u32 {
        self.lost_entries.load(Ordering::Relaxed)
    }

    /// Readings that a sensor failed to give since boot; 0 for other stations.
    #[must_use]
    pub fn bus_faults(&self, sensor: Station) -> u32 {
        self.bus_faults.get(sensor.index()).map_or(0, |count| count.load(Ordering::Relaxed))
    }

    /// Whether every task has checked in within [`CHECK_IN_TICKS`]. One that never
    /// started counts as last seen at boot.
    #[must_use]
    pub fn all_checked_in(&self, now: Tick) -> bool {
        let manned = Station::FIXED + self.operators.load(Ordering::Relaxed) as usize;
        self.check_ins
            .iter()
            .take(manned)
            .all(|seen| age(now, seen.load(Ordering::Relaxed)) <= CHECK_IN_TICKS)
    }

    /// A task says that it is alive.
    pub(super) fn check_in(&self, station: Station, now: Tick) {
        if let Some(seen) = self.check_ins.get(station.index()) {
            seen.store(now, Ordering::Relaxed);
        }
    }

    /// The station of a further operator task; the last one is shared if there are
    /// more than four.
    pub(super) fn enrol_operator(&self) -> Station {
        let number = (self.operators.load(Ordering::Relaxed) as usize).min(OPERATORS - 1);
        self.operators.store(number as u32 + 1, Ordering::Relaxed);
        Station::Operator(number as u8)
    }

    /// A sensor gave no reading.
    pub(super) fn count_bus_fault(&self, sensor: Station) {
        if let Some(count) = self.bus_faults.get(sensor.index()) {
            count.fetch_add(1, Ordering::Relaxed);
        }
    }
}

impl Default for Exchange {
    fn default() -> Self {
        Self::new()
    }
}

/// What the light shows in a mode.
const fn light_of(mode: Mode) -> Light {
    match mode {
        Mode::Boot | Mode::SelfTest | Mode::Zero | Mode::Idle | Mode::Complete(_) => Light::Off,
        Mode::Preload(_) | Mode::Run(..) | Mode::Stopping(_) => Light::On,
        Mode::FaultHold(_) => Light::Alarm,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::Event;
    use crate::supervise::{Direction, Fault};

    const ALWAYS: [Station; 6] = [
        Station::Speed,
        Station::Pressure,
        Station::Displacement,
        Station::Angle,
        Station::Model,
        Station::Journal,
    ];

    #[test]
    fn one_silent_task_is_enough() {
        let exchange = Exchange::new();
        assert!(exchange.all_checked_in(CHECK_IN_TICKS), "since boot");
        assert!(!exchange.all_checked_in(CHECK_IN_TICKS + 1));
        let operators = [exchange.enrol_operator(), exchange.enrol_operator()];
        let all: Vec<_> = ALWAYS.into_iter().chain(operators).collect();
        for silent in &all {
            for station in &all {
                exchange.check_in(*station, if station == silent { 1000 } else { 1030 });
            }
            assert!(exchange.all_checked_in(1050), "{silent:?}");
            assert!(!exchange.all_checked_in(1051), "{silent:?}");
        }
    }

    #[test]
    fn operators_beyond_the_last_seat_share_it() {
        let exchange = Exchange::new();
        let seats: Vec<_> = (0..6).map(|_| exchange.enrol_operator()).collect();
        assert_eq!(seats[3], Station::Operator(3));
        assert_eq!(seats[5], Station::Operator(3));
        for station in ALWAYS.into_iter().chain(seats) {
            exchange.check_in(station, 500);
        }
        assert!(exchange.all_checked_in(500));
    }

    #[test]
    fn entries_beyond_the_queue_are_counted() {
        let exchange = Exchange::new();
        for at in 0..ENTRIES as u32 + 7 {
            exchange.log(Entry { at, event: Event::Command(Command::Stop) });
        }
        assert_eq!(exchange.lost_entries(), 7);
        assert_eq!(exchange.entries.try_receive().map(|entry| entry.at), Ok(0));
    }

    #[test]
    fn the_light_follows_the_mode() {
        assert_eq!(light_of(Mode::Idle), Light::Off);
        assert_eq!(light_of(Mode::Preload(Direction::Deploy)), Light::On);
        assert_eq!(light_of(Mode::FaultHold(Fault::SelfTest)), Light::Alarm);
    }
}
