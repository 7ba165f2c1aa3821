//! The core's time: each poll of a task, and sleep.

/// A poll of a task, until it waits again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Poll {
    /// Number of the task.
    pub task: usize,
    /// Cycle at which it began.
    pub began: u64,
    /// Its own cycles, without interrupts that preempted it.
    pub cycles: u64,
}

/// Polls of tasks, and sleep.
#[derive(Clone, Debug)]
pub struct Profile {
    /// The current poll in thread mode and in each active exception.
    levels: Vec<Option<Poll>>,
    polls: Vec<Poll>,
    /// Cycle up to which the time is booked.
    booked: u64,
    asleep: bool,
    slept: u64,
}

impl Default for Profile {
    fn default() -> Self {
        Self { levels: vec![None], polls: Vec::new(), booked: 0, asleep: false, slept: 0 }
    }
}

impl Profile {
    /// Books the time since the last call on the running poll or on sleep.
    fn book(&mut self, now: u64) {
        let cycles = now.saturating_sub(self.booked);
        self.booked = self.booked.max(now);
        if self.asleep {
            self.slept += cycles;
        } else if let Some(Some(task)) = self.levels.last_mut() {
            task.cycles += cycles;
        }
    }

    /// An exception is taken.
    pub(super) fn enter(&mut self, now: u64) {
        self.book(now);
        self.levels.push(None);
    }

    /// The exception that runs returns.
    pub(super) fn leave(&mut self, now: u64) {
        self.book(now);
        if self.levels.len() > 1 {
            self.levels.pop();
        }
    }

    /// A poll begins on the running level.
    pub(super) fn begin(&mut self, task: usize, now: u64) {
        self.book(now);
        if let Some(level) = self.levels.last_mut() {
            *level = Some(Poll { task, began: now, cycles: 0 });
        }
    }

    /// The poll on the running level ends.
    pub(super) fn end(&mut self, now: u64) {
        self.book(now);
        self.polls.extend(self.levels.last_mut().and_then(Option::take));
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
        self.levels = vec![None];
        self.asleep = false;
    }

    /// Polls that have ended since the last call.
    pub fn take_polls(&mut self) -> Vec<Poll> {
        std::mem::take(&mut self.polls)
    }

    /// Cycles asleep.
    pub const fn slept(&self) -> u64 {
        self.slept
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_task_is_not_charged_for_what_preempts_it() {
        let mut profile = Profile::default();
        profile.begin(3, 100);
        profile.enter(110);
        profile.begin(7, 130);
        profile.end(150);
        profile.leave(160);
        profile.end(170);
        profile.sleep(180);
        profile.wake(200);
        let polls = profile.take_polls();
        assert_eq!(polls[0], Poll { task: 7, began: 130, cycles: 20 });
        assert_eq!(polls[1], Poll { task: 3, began: 100, cycles: 20 });
        assert!(profile.take_polls().is_empty());
        assert_eq!(profile.slept(), 20);
    }
}
