//! Wake-ups on whole ticks.
//!
//! The control tick's task alone waits for the clock and wakes the sensor tasks: a timer
//! for each of them costs a walk through the queue of timers to set and another to end,
//! which together is as much as half a tick.

use super::exchange::Station;
use crate::units::{TICK_HZ, Tick};
use core::future::poll_fn;
use core::sync::atomic::{AtomicU8, AtomicU32, Ordering};
use core::task::Poll;
use embassy_sync::waitqueue::AtomicWaker;
use embassy_time::{Instant, TICK_HZ as CLOCK_HZ, Timer};

/// Clock ticks of the time driver in a control tick.
const CLOCKS: u32 = (CLOCK_HZ / TICK_HZ as u64) as u32;

/// Tasks of sensors, the first stations.
const SENSORS: usize = 4;

/// Ticks between two readings of the sensors, by [`Station`].
pub(super) const PERIODS: [u32; SENSORS] = [1, 1, 1, ANGLE_PERIOD];

/// The same of the arm's angle.
pub(super) const ANGLE_PERIOD: u32 = 2;

/// What wakes the sensor tasks.
///
/// They and the control tick's task run on one executor, so that none is woken between
/// looking at the clock and going to sleep.
///
/// It keeps whose turn it is as well, for whoever finds that no tick comes any more.
pub(super) struct Pulse {
    wakers: [AtomicWaker; SENSORS],
    /// Number of the sensor from 1, [`TICK`], or 0.
    turn: AtomicU8,
    /// The tick of the latest turn.
    ticked: AtomicU32,
}

/// The control tick among the turns.
const TICK: u8 = u8::MAX;

/// Whose turn it is in the control tick's executor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Turn {
    /// All have ended theirs.
    Nobody,
    /// The control tick's.
    Tick,
    /// That of a sensor's task, by its station.
    Sensor(u8),
}

impl Pulse {
    /// Nobody to wake yet.
    pub(super) const fn new() -> Self {
        Self {
            wakers: [const { AtomicWaker::new() }; SENSORS],
            turn: AtomicU8::new(0),
            ticked: AtomicU32::new(0),
        }
    }

    /// A turn begins.
    pub(super) fn begin(&self, tick: Tick, turn: Turn) {
        let number = match turn {
            Turn::Nobody => 0,
            Turn::Tick => TICK,
            Turn::Sensor(station) => station + 1,
        };
        self.ticked.store(tick, Ordering::Relaxed);
        self.turn.store(number, Ordering::Relaxed);
    }

    /// A turn ends.
    pub(super) fn end(&self) {
        self.turn.store(0, Ordering::Relaxed);
    }

    /// Whose turn it is.
    pub(super) fn turn(&self) -> Turn {
        match self.turn.load(Ordering::Relaxed) {
            0 => Turn::Nobody,
            TICK => Turn::Tick,
            number => Turn::Sensor(number - 1),
        }
    }

    /// The tick of the latest turn.
    pub(super) fn ticked(&self) -> Tick {
        self.ticked.load(Ordering::Relaxed)
    }

    /// Wakes the sensor tasks that are due in this tick.
    fn beat(&self, tick: Tick) {
        for (waker, period) in self.wakers.iter().zip(PERIODS) {
            if tick.is_multiple_of(period) {
                waker.wake();
            }
        }
    }

    /// The waker of a sensor's task; that of the last for stations that are none.
    fn of(&self, station: Station) -> &AtomicWaker {
        &self.wakers[station.index().min(SENSORS - 1)]
    }
}

/// Wakes every N ticks, at ticks divisible by N.
///
/// Unlike a `Ticker` it stands on whole milliseconds, so that time stamps do not
/// jitter between two numbers, and it does not make up for wake-ups that were
/// missed, so that a late tick is followed by a timely one and not by a burst.
pub(super) struct Beat<const N: u32> {
    due: Instant,
    tick: Tick,
}

/// A wake-up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Due {
    /// The tick this wake-up stands for: the last one due.
    pub(super) tick: Tick,
    /// Wake-ups before it that did not happen in time.
    pub(super) missed: u32,
}

impl<const N: u32> Beat<N> {
    /// Clock ticks between two wake-ups.
    const PERIOD: u32 = CLOCKS * N;

    /// The first wake-up is the next whole one.
    pub(super) fn new() -> Self {
        let first = (Instant::now().as_millis() / u64::from(N) + 1) * u64::from(N);
        Self { due: Instant::from_millis(first), tick: first as Tick }
    }

    /// Waits for the next wake-up by the clock; then lets the sensor tasks run first.
    ///
    /// They do because this task is put in line before them, and the executor serves a
    /// line from its end. Would it not, the tick would find codes one tick older.
    pub(super) async fn lead(&mut self, pulse: &Pulse) -> Due {
        pulse.begin(self.tick.wrapping_sub(N), Turn::Nobody);
        Timer::at(self.due).await;
        let mut beaten = false;
        let now = poll_fn(|context| {
            if beaten {
                return Poll::Ready(Instant::now());
            }
            beaten = true;
            context.waker().wake_by_ref();
            pulse.begin(self.tick, Turn::Nobody);
            pulse.beat(self.tick);
            Poll::Pending
        });
        let now = now.await;
        let due = self.advance(now);
        pulse.begin(due.tick, Turn::Tick);
        due
    }

    /// Waits for the next wake-up by the pulse.
    pub(super) async fn follow(&mut self, pulse: &Pulse, station: Station) -> Due {
        let waker = pulse.of(station);
        let due = self.due;
        let now = poll_fn(|context| {
            let now = Instant::now();
            if now >= due {
                return Poll::Ready(now);
            }
            waker.register(context.waker());
            Poll::Pending
        });
        let now = now.await;
        let due = self.advance(now);
        pulse.begin(due.tick, Turn::Sensor(station.index() as u8));
        due
    }

    /// The wake-up that has come, and on to the next.
    fn advance(&mut self, now: Instant) -> Due {
        let late = now.saturating_duration_since(self.due).as_ticks();
        // A 32-bit division; an hour of lateness counts as an hour.
        let missed = u32::try_from(late).unwrap_or(u32::MAX) / Self::PERIOD;
        let tick = self.tick.wrapping_add(missed.wrapping_mul(N));
        self.tick = tick.wrapping_add(N);
        // Half a million years until it saturates.
        let on = u64::from(Self::PERIOD) * (u64::from(missed) + 1);
        self.due = Instant::from_ticks(self.due.as_ticks().saturating_add(on));
        Due { tick, missed }
    }
}
