//! Wake-ups on whole ticks.
//!
//! An interrupt of the board's beats at each whole millisecond and wakes the control tick's
//! task and the sensor tasks in one go. A timer for each of them would cost a walk through
//! the queue of timers to set and another to end, which together is as much as half a tick;
//! and whose timer else is due would be woken in between. Without such an interrupt the
//! control tick's task waits for the clock and wakes the others.

use super::exchange::TaskId;
use crate::units::{TICK_HZ, Tick};
use core::future::poll_fn;
use core::sync::atomic::{AtomicBool, AtomicU8, AtomicU32, Ordering};
use core::task::{Context, Poll, Waker};
use embassy_sync::waitqueue::AtomicWaker;
use embassy_time::{Instant, TICK_HZ as CLOCK_HZ, Timer};

/// Clock ticks of the time driver in a control tick.
pub(super) const CLOCKS: u32 = (CLOCK_HZ / TICK_HZ as u64) as u32;

/// Tasks of sensors, the first stations.
const SENSORS: usize = 4;

/// Ticks between two readings of the sensors, by [`TaskId`].
pub(super) const PERIODS: [u32; SENSORS] = [1, 1, 1, ANGLE_PERIOD];

/// The same of the arm's angle.
pub(super) const ANGLE_PERIOD: u32 = 2;

/// What wakes the control tick's task and the sensor tasks.
///
/// They run on one executor, so that none is woken between looking at the clock and going
/// to sleep.
///
/// It keeps whose turn it is as well, for whoever finds that no tick comes any more.
pub(super) struct Pulse {
    wakers: [AtomicWaker; SENSORS],
    /// The control tick's task, where an interrupt beats.
    lead: AtomicWaker,
    /// The task that runs behind the control tick.
    tail: AtomicWaker,
    /// An interrupt beats.
    beaten: AtomicBool,
    /// Number of the sensor from 1, [`TICK`], or 0.
    turn: AtomicU8,
    /// The tick of the latest turn.
    ticked: AtomicU32,
    /// The latest control tick.
    led: AtomicU32,
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
            lead: AtomicWaker::new(),
            tail: AtomicWaker::new(),
            beaten: AtomicBool::new(false),
            turn: AtomicU8::new(0),
            ticked: AtomicU32::new(0),
            led: AtomicU32::new(0),
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

    /// An interrupt beats from now on, see [`Pulse::strike`].
    pub(super) fn expect(&self) {
        self.beaten.store(true, Ordering::Relaxed);
    }

    /// Wakes all whose turn comes with this millisecond: first the one behind the control
    /// tick and then the control tick's task, so that these run last. For an interrupt at each whole millisecond that preempts their
    /// executor.
    /// Tells whether the arm's angle is among them.
    pub(super) fn strike(&self) -> bool {
        self.tail.wake();
        self.lead.wake();
        // The one behind the latest turn. After ticks that were missed it may be another:
        // those that are woken look at the clock themselves.
        let tick = self.ticked().wrapping_add(1);
        self.beat(tick);
        tick.is_multiple_of(ANGLE_PERIOD)
    }

    /// This task is to run behind each control tick.
    pub(super) fn follow_tick(&self, waker: &Waker) {
        self.tail.register(waker);
    }

    /// Wakes the sensor tasks that are due in this tick, the last first: it runs last.
    fn beat(&self, tick: Tick) {
        let [speed, pressure, displacement, angle] = &self.wakers;
        if tick.is_multiple_of(ANGLE_PERIOD) {
            angle.wake();
        }
        for waker in [displacement, pressure, speed] {
            waker.wake();
        }
    }

    /// The latest control tick.
    pub(super) fn led(&self) -> Tick {
        self.led.load(Ordering::Relaxed)
    }

    /// The waker of a sensor's task; that of the last for stations that are none.
    fn of(&self, station: TaskId) -> &AtomicWaker {
        &self.wakers[station.index().min(SENSORS - 1)]
    }
}

/// Wakes every N ticks, at ticks divisible by N.
///
/// Unlike a `Ticker` it stands on whole milliseconds, so that time stamps do not
/// jitter between two numbers, and it does not make up for wake-ups that were
/// missed, so that a late tick is followed by a timely one and not by a burst.
pub(super) struct Beat<const N: u32> {
    /// When the next is due: the low half of the clock, which is compared within half an
    /// hour.
    due: u32,
    tick: Tick,
    /// Registered with the pulse, which keeps it.
    waker: Option<Waker>,
}

/// A wake-up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Due {
    /// The tick this wake-up stands for: the last one due.
    pub(super) tick: Tick,
    /// Wake-ups before it that did not happen in time.
    pub(super) missed: u32,
}

/// The low half of the clock.
fn clock() -> u32 {
    Instant::now().as_ticks() as u32
}

impl<const N: u32> Beat<N> {
    /// Clock ticks between two wake-ups.
    const PERIOD: u32 = CLOCKS * N;

    /// The first wake-up is the next whole one.
    pub(super) fn new() -> Self {
        let first = (Instant::now().as_millis() / u64::from(N) + 1) * u64::from(N);
        let due = Instant::from_millis(first).as_ticks() as u32;
        Self { due, tick: first as Tick, waker: None }
    }

    /// Waits for the next wake-up by the interrupt that beats, or by the clock where there
    /// is none; the sensor tasks run first.
    ///
    /// They do because this task is put in line before them, and the executor serves a
    /// line from its end. Would it not, the tick would find codes one tick older.
    pub(super) async fn lead(&mut self, pulse: &Pulse) -> Due {
        pulse.begin(self.tick.wrapping_sub(N), Turn::Nobody);
        pulse.led.store(self.tick.wrapping_sub(N), Ordering::Relaxed);
        if pulse.beaten.load(Ordering::Relaxed) {
            let mut waits = false;
            return poll_fn(|context| {
                self.poll(context, &mut waits, pulse, (&pulse.lead, Turn::Tick))
            })
            .await;
        }
        self.beat(pulse).await;
        let due = self.advance(clock().wrapping_sub(self.due));
        pulse.begin(due.tick, Turn::Tick);
        due
    }

    /// Waits for the clock and wakes the sensor tasks.
    async fn beat(&self, pulse: &Pulse) {
        let now = Instant::now().as_ticks();
        let ahead = self.due.wrapping_sub(now as u32) as i32;
        Timer::at(Instant::from_ticks(now.saturating_add_signed(ahead.into()))).await;
        let mut beaten = false;
        poll_fn(|context| {
            if beaten {
                return Poll::Ready(());
            }
            beaten = true;
            pulse.tail.wake();
            context.waker().wake_by_ref();
            pulse.begin(self.tick, Turn::Nobody);
            pulse.beat(self.tick);
            Poll::Pending
        })
        .await;
    }

    /// The next wake-up by the pulse, for a `poll_fn` of the task's own: an `async fn`, or
    /// one future for all tasks, costs as much again, two times every tick and task. `waits`
    /// begins as false.
    #[inline(always)]
    pub(super) fn follow(
        &mut self,
        context: &Context<'_>,
        waits: &mut bool,
        pulse: &Pulse,
        station: TaskId,
    ) -> Poll<Due> {
        let turn = Turn::Sensor(station.index() as u8);
        self.poll(context, waits, pulse, (pulse.of(station), turn))
    }

    /// A wake-up, if it is due; a turn begins with it.
    #[inline(always)]
    fn poll(
        &mut self,
        context: &Context<'_>,
        waits: &mut bool,
        pulse: &Pulse,
        (wakes, turn): (&AtomicWaker, Turn),
    ) -> Poll<Due> {
        // The same task again: its waker stands there.
        let known = self.waker.as_ref().is_some_and(|waker| waker.will_wake(context.waker()));
        if known && !*waits {
            // It has just had its turn. Whoever wakes it from now on finds its waker, and has
            // done so since.
            *waits = true;
            return Poll::Pending;
        }
        let late = clock().wrapping_sub(self.due);
        if late <= i32::MAX as u32 {
            let due = self.advance(late);
            pulse.begin(due.tick, turn);
            return Poll::Ready(due);
        }
        *waits = true;
        if !known {
            wakes.register(context.waker());
            self.waker = Some(context.waker().clone());
        }
        Poll::Pending
    }

    /// The wake-up that has come, and on to the next.
    #[inline(always)]
    fn advance(&mut self, late: u32) -> Due {
        let missed = if late < Self::PERIOD { 0 } else { late / Self::PERIOD };
        let tick = self.tick.wrapping_add(missed.wrapping_mul(N));
        self.tick = tick.wrapping_add(N);
        self.due = self.due.wrapping_add(Self::PERIOD.wrapping_mul(missed + 1));
        Due { tick, missed }
    }
}
