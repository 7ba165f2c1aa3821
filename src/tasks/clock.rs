//! The control clock.

use super::exchange::Exchange;
use crate::units::Tick;
use embassy_time::{Duration, Instant, Timer};

/// Wakes the sensor tasks that are due and the control tick at each whole millisecond.
///
/// Time stamps are whole milliseconds, so that they do not jitter. A missed millisecond is
/// skipped: a late tick is followed by a timely one, not by a burst.
pub async fn clock(exchange: &Exchange) -> ! {
    loop {
        Timer::at(Instant::from_millis(Instant::now().as_millis() + 1)).await;
        exchange.start_tick(uptime());
    }
}

/// The present tick, by the clock; wraps.
pub(super) fn uptime() -> Tick {
    Instant::now().as_millis() as Tick
}

/// Deadline of a task below the control rate that waits for time alone: after `wait`, half a
/// millisecond more or less, in the middle between two ticks. So neither its timer nor its
/// critical sections delay the start of a tick.
pub fn mid_tick_deadline(wait: Duration) -> Instant {
    Instant::from_millis((Instant::now() + wait).as_millis()) + Duration::from_micros(500)
}
