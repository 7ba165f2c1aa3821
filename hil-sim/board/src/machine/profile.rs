//! What the core spends its time on: each exception by itself, each task by itself,
//! sleep.

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
    /// From pending to its first instruction, cycles: the sum.
    pub latency: u64,
    /// The most of these.
    pub worst_latency: u64,
}

/// A task run once, up to where it waits again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Poll {
    /// Which task.
    pub task: usize,
    /// Cycle at which it began.
    pub began: u64,
    /// Cycles of its own, interrupts that preempted it left out.
    pub cycles: u64,
}

/// What is open on one level: thread mode or an exception.
#[derive(Clone, Copy, Debug, Default)]
struct Level {
    number: u8,
    own: u64,
    task: Option<Poll>,
}

/// All of them.
#[derive(Clone, Debug)]
pub struct Profile {
    shares: BTreeMap<u8, Share>,
    levels: Vec<Level>,
    polls: Vec<Poll>,
    /// Up to here everything is booked.
    booked: u64,
    asleep: bool,
    slept: u64,
}

impl Default for Profile {
    fn default() -> Self {
        Self {
            shares: BTreeMap::new(),
            levels: vec![Level::default()],
            polls: Vec::new(),
            booked: 0,
            asleep: false,
            slept: 0,
        }
    }
}

impl Profile {
    /// Books the time since the last call on what was running.
    fn book(&mut self, now: u64) {
        let cycles = now.saturating_sub(self.booked);
        self.booked = self.booked.max(now);
        if self.asleep {
            self.slept += cycles;
            return;
        }
        if let Some(level) = self.levels.last_mut() {
            level.own += cycles;
            if let Some(task) = &mut level.task {
                task.cycles += cycles;
            }
            self.shares.entry(level.number).or_default().cycles += cycles;
        }
    }

    /// An exception that had been pending since `since` is taken at `now`; its handler
    /// begins at `begins`.
    pub(super) fn enter(&mut self, number: u8, since: u64, now: u64, begins: u64) {
        self.book(now);
        self.levels.push(Level { number, ..Level::default() });
        let share = self.shares.entry(number).or_default();
        share.entries += 1;
        let latency = begins.saturating_sub(since);
        share.latency += latency;
        share.worst_latency = share.worst_latency.max(latency);
    }

    pub(super) fn leave(&mut self, now: u64) {
        self.book(now);
        if self.levels.len() > 1
            && let Some(level) = self.levels.pop()
        {
            let share = self.shares.entry(level.number).or_default();
            share.worst = share.worst.max(level.own);
        }
    }

    /// A task begins on the level that runs.
    pub(super) fn begin(&mut self, task: usize, now: u64) {
        self.book(now);
        if let Some(level) = self.levels.last_mut() {
            level.task = Some(Poll { task, began: now, cycles: 0 });
        }
    }

    /// The task on the level that runs waits again.
    pub(super) fn end(&mut self, now: u64) {
        self.book(now);
        if let Some(poll) = self.levels.last_mut().and_then(|level| level.task.take()) {
            self.polls.push(poll);
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
        self.levels = vec![Level::default()];
        self.asleep = false;
    }

    /// Forgets what was booked so far.
    pub fn clear(&mut self, now: u64) {
        self.book(now);
        self.shares.clear();
        self.polls.clear();
    }

    /// What each exception has taken, by its number; [`THREAD`] is thread mode.
    pub fn shares(&self) -> impl Iterator<Item = (u8, Share)> {
        self.shares.iter().map(|(number, share)| (*number, *share))
    }

    /// Runs of tasks that have ended since this was last asked.
    pub fn take_polls(&mut self) -> Vec<Poll> {
        std::mem::take(&mut self.polls)
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

    #[test]
    fn a_task_is_not_charged_for_what_preempts_it() {
        let mut profile = Profile::default();
        profile.begin(3, 100);
        profile.enter(20, 110, 110, 122);
        profile.begin(7, 130);
        profile.end(150);
        profile.leave(160);
        profile.end(170);
        let polls = profile.take_polls();
        assert_eq!(polls[0], Poll { task: 7, began: 130, cycles: 20 });
        assert_eq!(polls[1], Poll { task: 3, began: 100, cycles: 20 });
        assert!(profile.take_polls().is_empty());
    }
}
