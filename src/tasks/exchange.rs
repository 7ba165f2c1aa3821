//! Data exchanged by the tasks.

use core::sync::atomic::{AtomicU32, Ordering};

use super::cycles::CycleCount;
use super::liveness::Liveness;
use crate::hal::Light;
use crate::log::Record;
use crate::model::{Plan, PlanRequest};
use crate::params::Refusal;
use crate::params::service::Response;
use crate::restart::MissedCheckIns;
use crate::sense::raw::{Sample, SensorFrame, SensorId};
use crate::supervise::{Command, Mode, ServiceDuties};
use crate::tick::{Entry, Input, Output, Telemetry};
use crate::units::Tick;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex as Raw;
use embassy_sync::channel::Channel;
use embassy_sync::signal::Signal;
use embassy_sync::watch::Watch;

/// Log entries that wait for the journal at most; further ones are dropped and counted.
pub const ENTRIES: usize = 32;

/// Commands that wait for the tick at most; beyond, their source waits.
pub const COMMANDS: usize = 4;

/// Ticks that wait for the journal at most; further ones are missing in the log. The longest
/// delay of the journal is the model's task, less than 2 ms.
const RECORDS: usize = 8;

/// The latest value of something, which nobody waits for.
pub(super) type Latest<T> = Watch<Raw, T, 0>;

/// Room for one value, see [`replace`]. Unlike a `Signal`'s its empty state is all zeros, so that
/// the exchange takes no room in flash.
pub(super) type Slot<T> = Channel<Raw, T, 1>;

/// Input and output of a tick.
#[derive(Default)]
pub struct TickIo {
    pub(super) input: Input,
    pub(super) output: Output,
}

/// Everything the tasks share: one in a `static`, or one per test.
pub struct Exchange {
    pub(super) liveness: Liveness,
    pub(super) cycles: CycleCount,
    /// Wakes each sensor's task: the tick for which it reads. This and what follows by [`SensorId`].
    pub(super) sensor_ticks: [Signal<Raw, Tick>; SensorId::COUNT],
    pub(super) sensor_codes: [Latest<Sample<u16>>; SensorId::COUNT],
    pub(super) tick_started: Signal<Raw, ()>,
    pub(super) tick_ended: Signal<Raw, ()>,
    pub(super) request: Slot<PlanRequest>,
    pub(super) answer: Slot<Plan>,
    pub(super) commands: Channel<Raw, Command, COMMANDS>,
    pub(super) service: Slot<ServiceDuties>,
    pub(super) entries: Channel<Raw, Entry, ENTRIES>,
    pub(super) records: Channel<Raw, Record, RECORDS>,
    /// Plan and request for the log, with their ticks.
    pub(super) logged_plan: Slot<(Tick, Plan)>,
    pub(super) logged_request: Slot<(Tick, PlanRequest)>,
    telemetry: Latest<Telemetry>,
    lost_entries: AtomicU32,
}

impl Exchange {
    /// An exchange with nothing in it.
    pub const fn new() -> Self {
        Self {
            liveness: Liveness::new(),
            cycles: CycleCount::new(),
            sensor_ticks: [const { Signal::new() }; SensorId::COUNT],
            sensor_codes: [const { Watch::new() }; SensorId::COUNT],
            tick_started: Signal::new(),
            tick_ended: Signal::new(),
            request: Channel::new(),
            answer: Channel::new(),
            commands: Channel::new(),
            service: Channel::new(),
            entries: Channel::new(),
            records: Channel::new(),
            logged_plan: Channel::new(),
            logged_request: Channel::new(),
            telemetry: Watch::new(),
            lost_entries: AtomicU32::new(0),
        }
    }

    /// Wakes the sensors that are due in this tick, and the control tick.
    ///
    /// The executor runs tasks woken together from the last to the first: the sensors in the order
    /// of [`SensorId`], then the control tick, which so finds the codes of its own millisecond.
    pub(super) fn start_tick(&self, tick: Tick) {
        self.liveness.start(tick);
        self.tick_started.signal(());
        for (period, sensor) in SensorId::PERIODS.iter().zip(&self.sensor_ticks).rev() {
            if tick.is_multiple_of(*period) {
                sensor.signal(tick);
            }
        }
    }

    /// Input of the tick at `now`; takes the oldest command and the plan out. The motors' task
    /// adds bridge codes and emergency stop.
    pub fn input(&self, now: Tick, overrun: bool) -> Input {
        Input {
            now,
            sensors: self.sensors(),
            command: self.commands.try_receive().ok(),
            service: self.service.try_receive().ok(),
            plan: self.answer.try_receive().ok(),
            overrun,
            emergency_stop: false,
        }
    }

    /// Passes on the output of a tick, except the motors' part.
    pub fn publish(&self, output: &Output) {
        if let Some(request) = output.request {
            self.request_plan(request);
        }
        for &entry in &output.events {
            self.log(entry);
        }
        self.telemetry.sender().send(output.telemetry);
    }

    /// Puts a tick in the journal's queue.
    #[inline(never)]
    pub(super) fn record(&self, TickIo { input, output }: &TickIo) {
        if let Some(plan) = input.plan {
            replace(&self.logged_plan, (input.now, plan));
        }
        if let Some(request) = output.request {
            replace(&self.logged_request, (input.now, request));
        }
        // A reader notices a missing tick by its number.
        let _ = self.records.try_send(Record::of(input, output));
    }

    /// Asks the model task for a plan; replaces a request not yet begun.
    pub fn request_plan(&self, request: PlanRequest) {
        replace(&self.request, request);
    }

    /// Puts an entry in the log's queue, or counts it as lost.
    pub fn log(&self, entry: Entry) {
        if self.entries.try_send(entry).is_err() {
            self.lost_entries.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// The latest code of each sensor, without the bridges'.
    pub fn sensors(&self) -> SensorFrame {
        SensorFrame { samples: self.sensor_codes.each_ref().map(Watch::try_get), bridges: None }
    }

    /// The row of the latest tick; none before the first.
    pub fn telemetry(&self) -> Option<Telemetry> {
        self.telemetry.try_get()
    }

    /// What the light shows, as of the latest tick.
    pub fn light(&self) -> Light {
        match self.telemetry().map(|row| row.mode) {
            Some(Mode::FaultHold(_)) => Light::Alarm,
            Some(mode) if !mode.is_at_rest() => Light::On,
            _ => Light::Off,
        }
    }

    /// Whether nothing is driven, as of the latest tick.
    pub fn at_rest(&self) -> bool {
        self.telemetry().is_none_or(|row| row.mode.is_at_rest())
    }

    /// Passes duties of the service mode to the tick, which has the last word.
    pub(super) fn serve(&self, duties: ServiceDuties) -> Response {
        let mode = self.telemetry().map(|row| row.mode);
        match mode {
            _ if !duties.is_allowed() => Response::Refused(Refusal::Duty),
            Some(Mode::Idle) if !duties.is_rest() => Response::Refused(Refusal::NotService),
            Some(Mode::Idle | Mode::Service) => {
                replace(&self.service, duties);
                Response::Done
            }
            _ => Response::Refused(Refusal::NotService),
        }
    }

    /// Passes the host's reset to the tick.
    pub(super) fn reset(&self) -> Response {
        let sent = self.commands.try_send(Command::Reset);
        sent.map_or(Response::Refused(Refusal::Busy), |()| Response::Done)
    }

    /// Log entries dropped since boot because the journal did not keep up.
    pub fn lost_entries(&self) -> u32 {
        self.lost_entries.load(Ordering::Relaxed)
    }

    /// Why the watchdog is not fed: tasks that are late, or the one that blocks the control tick.
    pub fn unfed(&self, now: Tick) -> MissedCheckIns {
        self.liveness.unfed(now)
    }
}

impl Default for Exchange {
    fn default() -> Self {
        Self::new()
    }
}

/// Puts a value in the slot, replacing the one that may be there. For one writer.
pub(super) fn replace<T>(slot: &Slot<T>, value: T) {
    slot.clear();
    // With one writer there is room.
    let _ = slot.try_send(value);
}
