//! What the core spends its time on: each exception by itself, thread mode, sleep.

use std::collections::BTreeMap;

use serde::Serialize;

/// Thread mode among the numbers of exceptions.
pub const THREAD: u8 = 0;

/// What one exception has taken.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Share {
    /// How often it was taken.
    pub entries: u64,
    /// Cycles of its own, others that preempted it left out.
    pub cycles: u64,
    /// Most cycles of its own in one go.
    pub worst: u64,
    /// From pending to its first instruction, cycles: sum and most.
    pub latency: u64,
    /// The most of these.
    pub worst_latency: u64,
}

/// An exception under way.
#[derive(Clone, Copy, Debug)]
struct Open {
    number: u8,
    own: u64,
}

/// All of them.
#[derive(Clone, Debug, Default)]
pub struct Profile {
    shares: BTreeMap<u8, Share>,
    open: Vec<Open>,
    /// Up to here everything is booked.
    booked: u64,
    asleep: bool,
    slept: u64,
}

impl Profile {
    /// Books the time since the last call on what was running.
    fn book(&mut self, now: u64) {
        let cycles = now.saturating_sub(self.booked);
        self.booked = now;
        if self.asleep {
            self.slept += cycles;
            return;
        }
        let number = match self.open.last_mut() {
            Some(open) => {
                open.own += cycles;
                open.number
            }
            None => THREAD,
        };
        self.shares.entry(number).or_default().cycles += cycles;
    }

    /// An exception that had been pending since `since` is taken at `now`; its handler
    /// begins at `begins`.
    pub(super) fn enter(&mut self, number: u8, since: u64, now: u64, begins: u64) {
        self.book(now);
        self.open.push(Open { number, own: 0 });
        let share = self.shares.entry(number).or_default();
        share.entries += 1;
        let latency = begins.saturating_sub(since);
        share.latency += latency;
        share.worst_latency = share.worst_latency.max(latency);
    }

    pub(super) fn leave(&mut self, now: u64) {
        self.book(now);
        if let Some(open) = self.open.pop() {
            let share = self.shares.entry(open.number).or_default();
            share.worst = share.worst.max(open.own);
        }
    }

    pub(super) fn sleep(&mut self, now: u64) {
        self.book(now);
        self.asleep = true;
    }

    pub(super) fn wake(&mut self, now: u64) {
        self.book(now);
        self.asleep = false;
    }

    pub(super) fn restart(&mut self, now: u64) {
        self.book(now);
        self.open.clear();
        self.asleep = false;
    }

    /// What each exception has taken, by its number; [`THREAD`] is thread mode.
    pub fn shares(&self) -> impl Iterator<Item = (u8, Share)> {
        self.shares.iter().map(|(number, share)| (*number, *share))
    }

    /// Cycles asleep.
    #[must_use]
    pub const fn slept(&self) -> u64 {
        self.slept
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_preempted_exception_is_not_charged_for_the_other() {
        let mut profile = Profile::default();
        profile.enter(20, 90, 100, 112);
        profile.enter(30, 150, 150, 162);
        profile.leave(180);
        profile.leave(200);
        profile.sleep(210);
        profile.wake(300);
        let shares: BTreeMap<_, _> = profile.shares().collect();
        assert_eq!((shares[&20].cycles, shares[&20].worst), (70, 70));
        assert_eq!((shares[&20].latency, shares[&20].worst_latency), (22, 22));
        assert_eq!((shares[&30].cycles, shares[&30].entries), (30, 1));
        assert_eq!((shares[&THREAD].cycles, profile.slept()), (110, 90));
    }
}
