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
    /// What the flash's wait states would have added to them, if that is counted.
    pub waits: u64,
}

/// A time: textbook cycles, and the waits of the flash up to then.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Clock {
    pub cycles: u64,
    pub waits: u64,
}

/// Polls of tasks, and sleep.
#[derive(Clone, Debug)]
pub struct Profile {
    /// The current poll in thread mode and in each active exception.
    levels: Vec<Option<Poll>>,
    polls: Vec<Poll>,
    /// Time up to which everything is booked.
    booked: Clock,
    asleep: bool,
    slept: u64,
}

impl Default for Profile {
    fn default() -> Self {
        Self {
            levels: vec![None],
            polls: Vec::new(),
            booked: Clock::default(),
            asleep: false,
            slept: 0,
        }
    }
}

impl Profile {
    /// Books the time since the last call on the running poll or on sleep.
    fn book(&mut self, now: Clock) {
        let cycles = now.cycles.saturating_sub(self.booked.cycles);
        let waits = now.waits.saturating_sub(self.booked.waits);
        self.booked.cycles = self.booked.cycles.max(now.cycles);
        self.booked.waits = self.booked.waits.max(now.waits);
        if self.asleep {
            self.slept += cycles;
        } else if let Some(Some(task)) = self.levels.last_mut() {
            task.cycles += cycles;
            task.waits += waits;
        }
    }

    /// An exception is taken.
    pub(super) fn enter(&mut self, now: Clock) {
        self.book(now);
        self.levels.push(None);
    }

    /// The exception that runs returns.
    pub(super) fn leave(&mut self, now: Clock) {
        self.book(now);
        if self.levels.len() > 1 {
            self.levels.pop();
        }
    }

    /// A poll begins on the running level.
    pub(super) fn begin(&mut self, task: usize, now: Clock) {
        self.book(now);
        if let Some(level) = self.levels.last_mut() {
            *level = Some(Poll { task, began: now.cycles, cycles: 0, waits: 0 });
        }
    }

    /// The poll on the running level ends.
    pub(super) fn end(&mut self, now: Clock) {
        self.book(now);
        self.polls.extend(self.levels.last_mut().and_then(Option::take));
    }

    pub(super) fn sleep(&mut self, now: Clock) {
        self.book(now);
        self.asleep = true;
    }

    pub(super) fn wake(&mut self, now: Clock) {
        self.book(now);
        self.asleep = false;
    }

    pub(super) fn restart(&mut self, now: Clock) {
        self.book(now);
        self.levels = vec![None];
        self.asleep = false;
    }

    /// Polls that have ended since the last call.
    pub fn take_polls(&mut self) -> Vec<Poll> {
        std::mem::take(&mut self.polls)
    }

    pub(crate) const fn slept(&self) -> u64 {
        self.slept
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_task_is_not_charged_for_what_preempts_it() {
        let mut profile = Profile::default();
        // A wait in every ten cycles.
        let at = |cycles| Clock { cycles, waits: cycles / 10 };
        profile.begin(3, at(100));
        profile.enter(at(110));
        profile.begin(7, at(130));
        profile.end(at(150));
        profile.leave(at(160));
        profile.end(at(170));
        profile.sleep(at(180));
        profile.wake(at(200));
        let polls = profile.take_polls();
        assert_eq!(polls[0], Poll { task: 7, began: 130, cycles: 20, waits: 2 });
        assert_eq!(polls[1], Poll { task: 3, began: 100, cycles: 20, waits: 2 });
        assert!(profile.take_polls().is_empty());
        assert_eq!(profile.slept(), 20);
    }
}
