//! What the tasks hand to one another.

use core::cell::Cell;
use core::sync::atomic::{AtomicBool, AtomicU8, AtomicU32, Ordering};

use super::beat::{CLOCKS, PERIODS, Pulse, Turn};
use crate::control::{Input, Output};
use crate::hal::Light;
use crate::log::{Entry, Tape, Telemetry};
use crate::model::{Plan, PlanRequest};
use crate::restart::MissedCheckIns;
use crate::sense::freshness::age;
use crate::sense::raw::{AdcCode, AngleFrame, EncoderCount, Sample, SensorFrame};
use crate::supervise::{Command, Mode};
use crate::units::Tick;
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embassy_time::{Duration, Instant};

/// Log entries that wait for the journal at most; beyond, new ones are dropped and
/// counted.
pub const ENTRIES: usize = 32;

/// Commands that wait for the tick at most; beyond, their source waits.
pub const COMMANDS: usize = 4;

/// Longest time without a check-in of a healthy task, ticks.
pub const CHECK_IN_TICKS: u32 = 50;

/// Most operator tasks.
const OPERATORS: usize = 4;

/// The latest value of something: written by one task, polled by the tick. Nobody waits
/// for it, so that it is a `Watch` without the wakers.
pub(super) struct Slot<T>(Mutex<CriticalSectionRawMutex, Cell<Option<T>>>);

impl<T: Copy> Slot<T> {
    const fn new() -> Self {
        Self(Mutex::new(Cell::new(None)))
    }

    /// Puts a value in the place of the one before.
    pub(super) fn put(&self, value: T) {
        self.0.lock(|place| place.set(Some(value)));
    }

    fn get(&self) -> Option<T> {
        self.0.lock(Cell::get)
    }
}

/// A task that checks in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TaskId {
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

impl TaskId {
    /// Stations that must always be manned.
    const FIXED: usize = 6;

    pub(super) const fn index(self) -> usize {
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
    pub(super) pulse: Pulse,
    pub(super) wheel: Slot<Sample<EncoderCount>>,
    pub(super) load_cell: Slot<Sample<AdcCode>>,
    pub(super) tread: Slot<Sample<AdcCode>>,
    pub(super) arm: Slot<Sample<AngleFrame>>,
    pub(super) request: Channel<CriticalSectionRawMutex, PlanRequest, 1>,
    pub(super) answer: Channel<CriticalSectionRawMutex, Plan, 1>,
    pub(super) commands: Channel<CriticalSectionRawMutex, Command, COMMANDS>,
    pub(super) entries: Channel<CriticalSectionRawMutex, Entry, ENTRIES>,
    pub(super) tape: Tape,
    light: AtomicU8,
    /// Something is driven. Like everything here it begins as zero, so that none of it
    /// takes room in flash.
    driven: AtomicBool,
    lost_entries: AtomicU32,
    bus_faults: [AtomicU32; 4],
    check_ins: [AtomicU32; TaskId::FIXED + OPERATORS],
    operators: AtomicU32,
    /// TaskId whose turn it last was of those that wait for other things than time.
    awake: AtomicU8,
}

impl Exchange {
    /// An exchange with nothing in it.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            pulse: Pulse::new(),
            wheel: Slot::new(),
            load_cell: Slot::new(),
            tread: Slot::new(),
            arm: Slot::new(),
            request: Channel::new(),
            answer: Channel::new(),
            commands: Channel::new(),
            entries: Channel::new(),
            tape: Tape::new(),
            light: AtomicU8::new(Light::Off as u8),
            driven: AtomicBool::new(false),
            lost_entries: AtomicU32::new(0),
            bus_faults: [const { AtomicU32::new(0) }; 4],
            check_ins: [const { AtomicU32::new(0) }; TaskId::FIXED + OPERATORS],
            operators: AtomicU32::new(0),
            awake: AtomicU8::new(0),
        }
    }

    /// An interrupt calls [`Exchange::beat`] from now on. For before the control tick's task
    /// begins.
    pub fn expect_beat(&self) {
        self.pulse.expect();
    }

    /// A whole millisecond has come. For an interrupt that preempts the executor of control
    /// tick and sensors, after [`Exchange::expect_beat`]. Tells whether the arm's angle is
    /// read with it, after the other sensors.
    #[inline]
    pub fn beat(&self) -> bool {
        self.pulse.strike()
    }

    /// The present tick, for tasks outside the control rate: that of the clock, without a
    /// long division.
    #[must_use]
    pub fn uptime(&self) -> Tick {
        let led = self.pulse.led();
        led.wrapping_add(since(led, Instant::now()) / CLOCKS)
    }

    /// When a task below the control rate that waits for nothing but time goes on: in so
    /// long, by half a millisecond more or less, in the middle between two ticks. So neither
    /// its timer nor what it does with interrupts shut out delays the beginning of one.
    #[must_use]
    pub fn aside(&self, wait: Duration) -> Instant {
        let led = self.pulse.led();
        let now = Instant::now();
        let phase = since(led, now) % CLOCKS;
        let at = now + wait + Duration::from_ticks((CLOCKS / 2).into());
        Instant::from_ticks(at.as_ticks().saturating_sub(phase.into()))
    }

    /// What a tick at `now` is given; takes the oldest command and the plan out.
    #[must_use]
    pub fn input(&self, now: Tick, overrun: bool) -> Input {
        let mut input = Input::default();
        self.input_into(now, overrun, &mut input);
        input
    }

    /// The same into a place.
    pub fn input_into(&self, now: Tick, overrun: bool, input: &mut Input) {
        *input = Input {
            now,
            sensors: self.sensors(),
            command: self.commands.try_receive().ok(),
            plan: self.answer.try_receive().ok(),
            overrun,
            emergency_stop: false,
        };
    }

    /// Passes on what a tick gave, except the motors' part.
    pub fn publish(&self, output: &Output) {
        if let Some(request) = output.request {
            self.request_plan(request);
        }
        for &entry in &output.events {
            self.log(entry);
        }
        let mode = output.telemetry.mode;
        self.driven.store(!mode.is_at_rest(), Ordering::Relaxed);
        self.show(light_of(mode));
    }

    /// Asks the model task for a plan; replaces a request not yet begun.
    pub fn request_plan(&self, request: PlanRequest) {
        latest(&self.request, request);
    }

    /// Puts an entry in the log's queue, or counts it as lost.
    pub fn log(&self, entry: Entry) {
        if self.entries.try_send(entry).is_err() {
            self.lost_entries.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Sets what the light is to show.
    pub fn show(&self, light: Light) {
        self.light.store(light as u8, Ordering::Relaxed);
    }

    /// The latest code of each sensor. Those of the bridges are not among them: who drives
    /// the bridges has them.
    #[must_use]
    pub fn sensors(&self) -> SensorFrame {
        SensorFrame {
            wheel: self.wheel.get(),
            load_cell: self.load_cell.get(),
            tread: self.tread.get(),
            arm: self.arm.get(),
            bridges: None,
        }
    }

    /// The row of the latest tick; none before the first.
    #[must_use]
    pub fn telemetry(&self) -> Option<Telemetry> {
        self.tape.latest()
    }

    /// What the light is to show.
    #[must_use]
    pub fn light(&self) -> Light {
        match self.light.load(Ordering::Relaxed) {
            light if light == Light::On as u8 => Light::On,
            light if light == Light::Alarm as u8 => Light::Alarm,
            _ => Light::Off,
        }
    }

    /// Whether nothing is driven, as of the latest tick.
    #[must_use]
    pub fn at_rest(&self) -> bool {
        !self.driven.load(Ordering::Relaxed)
    }

    /// Log entries dropped since boot because the journal did not keep up.
    #[must_use]
    pub fn lost_entries(&self) -> u32 {
        self.lost_entries.load(Ordering::Relaxed)
    }

    /// Readings that a sensor failed to give since boot; 0 for other stations.
    #[must_use]
    pub fn bus_faults(&self, sensor: TaskId) -> u32 {
        self.bus_faults.get(sensor.index()).map_or(0, |count| count.load(Ordering::Relaxed))
    }

    /// Who has not checked in within [`CHECK_IN_TICKS`]. One that never started counts as
    /// last seen at boot.
    #[must_use]
    pub fn late(&self, now: Tick) -> MissedCheckIns {
        let manned = TaskId::FIXED + self.operators.load(Ordering::Relaxed) as usize;
        self.older(now, [CHECK_IN_TICKS; TaskId::FIXED + OPERATORS].into_iter().take(manned))
    }

    /// Why the watchdog is not fed: who is late, or who keeps the control tick from coming.
    #[must_use]
    pub fn unfed(&self, now: Tick) -> MissedCheckIns {
        if age(now, self.pulse.ticked()) > CHECK_IN_TICKS {
            return self.culprit();
        }
        let late = self.late(now);
        // One that does not let go keeps all others of its executor waiting as well.
        let manned = TaskId::FIXED + self.operators.load(Ordering::Relaxed) as usize;
        let all = (PERIODS.len()..manned)
            .map(MissedCheckIns::station)
            .fold(MissedCheckIns::NOBODY, MissedCheckIns::and);
        if late == all {
            MissedCheckIns::station(self.awake.load(Ordering::Relaxed).into())
        } else {
            late
        }
    }

    /// A task that waits for other things than time has got its turn.
    pub(super) fn wake(&self, station: TaskId) {
        self.awake.store(station.index() as u8, Ordering::Relaxed);
    }

    /// Who keeps the control tick from coming, as far as the check-ins tell: the task that
    /// has begun a turn in the tick's executor and not ended it, or else the sensors'
    /// tasks that have fallen behind the others, or something outside of it.
    fn culprit(&self) -> MissedCheckIns {
        match self.pulse.turn() {
            Turn::Nobody => {}
            Turn::Tick => return MissedCheckIns::TICK,
            Turn::Sensor(station) => return MissedCheckIns::station(station.into()),
        }
        let ticked = self.pulse.ticked();
        let behind = self.older(ticked, PERIODS.into_iter().map(|period| period - 1));
        // The executor serves a line from its end: those before the one that keeps the
        // others from their turns have had theirs.
        behind.last().unwrap_or(MissedCheckIns::STARVED)
    }

    /// The stations, from the first on, that were last seen longer ago than they may.
    fn older(&self, now: Tick, allowed: impl Iterator<Item = u32>) -> MissedCheckIns {
        let mut late = MissedCheckIns::NOBODY;
        for (index, (seen, ticks)) in self.check_ins.iter().zip(allowed).enumerate() {
            if age(now, seen.load(Ordering::Relaxed)) > ticks {
                late = late.and(MissedCheckIns::station(index));
            }
        }
        late
    }

    /// A task says that it is alive.
    pub(super) fn check_in(&self, station: TaskId, now: Tick) {
        if let Some(seen) = self.check_ins.get(station.index()) {
            seen.store(now, Ordering::Relaxed);
        }
        // Whose turn it is among the sensors, the pulse keeps; theirs end with this.
        if station.index() < PERIODS.len() {
            self.pulse.end();
        } else {
            self.wake(station);
        }
    }

    /// The station of a further operator task; the last one is shared if there are
    /// more than four.
    pub(super) fn enrol_operator(&self) -> TaskId {
        let number = (self.operators.load(Ordering::Relaxed) as usize).min(OPERATORS - 1);
        self.operators.store(number as u32 + 1, Ordering::Relaxed);
        TaskId::Operator(number as u8)
    }

    /// A sensor gave no reading.
    pub(super) fn count_bus_fault(&self, sensor: TaskId) {
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

/// Clock ticks since a control tick was due, which stands on its whole millisecond.
fn since(tick: Tick, now: Instant) -> u32 {
    (now.as_ticks() as u32).wrapping_sub(tick.wrapping_mul(CLOCKS))
}

/// Puts a value in a place for one, instead of the one that may be there. For one writer.
pub(super) fn latest<T>(place: &Channel<CriticalSectionRawMutex, T, 1>, value: T) {
    place.clear();
    // Nobody else writes, so there is room.
    let _ = place.try_send(value);
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

    const ALWAYS: [TaskId; 6] = [
        TaskId::Speed,
        TaskId::Pressure,
        TaskId::Displacement,
        TaskId::Angle,
        TaskId::Model,
        TaskId::Journal,
    ];

    #[test]
    fn the_time_since_a_tick_is_right_across_the_clock_s_low_half() {
        for millisecond in [1_u64, 4_294_966, 4_294_968, 1 << 32, (1 << 32) + 7] {
            let due = Instant::from_millis(millisecond);
            for later in [0, 999, 1500] {
                let now = due + Duration::from_ticks(later);
                assert_eq!(u64::from(since(millisecond as Tick, now)), later, "{millisecond}");
            }
        }
    }

    #[test]
    fn one_silent_task_is_enough() {
        let exchange = Exchange::new();
        assert!(exchange.late(CHECK_IN_TICKS).is_nobody(), "since boot");
        assert_eq!(exchange.late(CHECK_IN_TICKS + 1).bits(), 0x3F);
        let operators = [exchange.enrol_operator(), exchange.enrol_operator()];
        let all: Vec<_> = ALWAYS.into_iter().chain(operators).collect();
        for silent in &all {
            for station in &all {
                exchange.check_in(*station, if station == silent { 1000 } else { 1030 });
            }
            assert!(exchange.late(1050).is_nobody(), "{silent:?}");
            assert_eq!(exchange.late(1051), MissedCheckIns::station(silent.index()), "{silent:?}");
        }
    }

    #[test]
    fn operators_beyond_the_last_seat_share_it() {
        let exchange = Exchange::new();
        let seats: Vec<_> = (0..6).map(|_| exchange.enrol_operator()).collect();
        assert_eq!(seats[3], TaskId::Operator(3));
        assert_eq!(seats[5], TaskId::Operator(3));
        for station in ALWAYS.into_iter().chain(seats) {
            exchange.check_in(station, 500);
        }
        assert!(exchange.late(500).is_nobody());
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
    fn of_tasks_that_wait_for_one_another_the_one_that_has_its_turn_is_named() {
        let exchange = Exchange::new();
        let operator = exchange.enrol_operator();
        exchange.pulse.begin(1000, Turn::Nobody);
        for station in ALWAYS.into_iter().take(4) {
            exchange.check_in(station, 1000);
        }
        exchange.wake(TaskId::Journal);
        assert_eq!(exchange.unfed(1000), MissedCheckIns::station(TaskId::Journal.index()));
        exchange.check_in(operator, 0);
        assert_eq!(exchange.unfed(1000), MissedCheckIns::station(operator.index()));
        // Where the others go on, the one that does not is it.
        exchange.check_in(TaskId::Journal, 990);
        exchange.check_in(operator, 990);
        assert_eq!(exchange.unfed(1000).name(), "model");
    }

    #[test]
    fn who_keeps_the_tick_from_coming_is_named() {
        let exchange = Exchange::new();
        exchange.pulse.begin(700, Turn::Tick);
        assert_eq!(exchange.culprit(), MissedCheckIns::TICK);
        exchange.pulse.begin(701, Turn::Sensor(TaskId::Pressure.index() as u8));
        assert_eq!(exchange.culprit().name(), "pressure");
        // All turns ended, one task is behind: it was waiting in the middle of a reading.
        exchange.pulse.begin(702, Turn::Nobody);
        for station in ALWAYS {
            exchange.check_in(station, if station == TaskId::Angle { 700 } else { 702 });
        }
        assert_eq!(exchange.culprit().name(), "angle");
        // It is due every other tick alone.
        exchange.check_in(TaskId::Angle, 702);
        assert_eq!(exchange.culprit(), MissedCheckIns::STARVED);
        exchange.pulse.begin(703, Turn::Nobody);
        for station in [TaskId::Speed, TaskId::Pressure, TaskId::Displacement] {
            exchange.check_in(station, 703);
        }
        assert_eq!(exchange.culprit(), MissedCheckIns::STARVED);
    }

    #[test]
    fn the_light_follows_the_mode() {
        assert_eq!(light_of(Mode::Idle), Light::Off);
        assert_eq!(light_of(Mode::Preload(Direction::Deploy)), Light::On);
        assert_eq!(light_of(Mode::FaultHold(Fault::SelfTest)), Light::Alarm);
    }
}
