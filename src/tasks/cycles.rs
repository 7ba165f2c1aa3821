//! Cycles of the control tick by the core's own counter, for the text log.

use core::sync::atomic::{AtomicU32, Ordering};

use crate::units::{TICK_HZ, Tick};

/// Ticks between two lines of the log while the drive runs, and at rest.
const UNDER_WAY: Tick = TICK_HZ;
const AT_REST: Tick = 10 * TICK_HZ;

/// Cycles of some ticks, with what preempted them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TickCycles {
    /// Mean.
    pub mean: u32,
    /// Most.
    pub most: u32,
}

/// Sums over the ticks since the last line. The tick adds, the journal takes: a tick in between
/// may count for either line.
pub(super) struct CycleCount {
    ticks: AtomicU32,
    sum: AtomicU32,
    most: AtomicU32,
}

impl CycleCount {
    pub(super) const fn new() -> Self {
        Self { ticks: AtomicU32::new(0), sum: AtomicU32::new(0), most: AtomicU32::new(0) }
    }

    /// Adds a tick. Ten seconds of ticks of a complete period each fit: 10,000 x 170,000 < 2^31.
    pub(super) fn note(&self, cycles: u32) {
        self.most.fetch_max(cycles, Ordering::Relaxed);
        self.sum.fetch_add(cycles, Ordering::Relaxed);
        self.ticks.fetch_add(1, Ordering::Relaxed);
    }

    /// What a line of the log shows, if one is due.
    pub(super) fn due(&self, at_rest: bool) -> Option<TickCycles> {
        let interval = if at_rest { AT_REST } else { UNDER_WAY };
        if self.ticks.load(Ordering::Relaxed) < interval {
            return None;
        }
        let all = [&self.ticks, &self.sum, &self.most];
        let [ticks, sum, most] = all.map(|number| number.swap(0, Ordering::Relaxed));
        Some(TickCycles { mean: sum / ticks.max(1), most })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_due_each_second_under_way_and_each_ten_at_rest() {
        let count = CycleCount::new();
        for at_rest in [false, true] {
            let interval = if at_rest { AT_REST } else { UNDER_WAY };
            for tick in 0..interval {
                assert_eq!(count.due(at_rest), None, "{tick}");
                count.note(4000 + 2 * (tick % 2));
            }
            assert_eq!(count.due(at_rest), Some(TickCycles { mean: 4001, most: 4002 }));
        }
        (0..AT_REST).for_each(|_| count.note(170_000));
        assert_eq!(count.due(true), Some(TickCycles { mean: 170_000, most: 170_000 }));
    }
}
