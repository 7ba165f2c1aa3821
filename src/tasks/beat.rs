//! Wake-ups on whole ticks.

use crate::units::{TICK_HZ, Tick};
use embassy_time::{Duration, Instant, TICK_HZ as CLOCK_HZ, Timer};

/// Clock ticks of the time driver in a control tick.
const CLOCKS: u32 = (CLOCK_HZ / TICK_HZ as u64) as u32;

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

    /// Waits for the next wake-up.
    pub(super) async fn next(&mut self) -> Due {
        Timer::at(self.due).await;
        let late = Instant::now().saturating_duration_since(self.due).as_ticks();
        // A 32-bit division; an hour of lateness counts as an hour.
        let missed = u32::try_from(late).unwrap_or(u32::MAX) / Self::PERIOD;
        let tick = self.tick.wrapping_add(missed.wrapping_mul(N));
        self.tick = tick.wrapping_add(N);
        self.due += Duration::from_ticks(u64::from(Self::PERIOD) * (u64::from(missed) + 1));
        Due { tick, missed }
    }
}
