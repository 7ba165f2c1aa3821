//! Check-ins of the tasks, and the task that blocks the others.

use core::sync::atomic::{AtomicBool, AtomicU8, AtomicU32, Ordering};

use crate::restart::MissedCheckIns;
use crate::sense::freshness::age;
use crate::sense::raw::SensorId;
use crate::units::Tick;

/// Longest time without a check-in of a healthy task, ticks.
pub const CHECK_IN_TICKS: u32 = 50;

/// Tasks that always run.
const FIXED: usize = SensorId::COUNT + 2;

/// Most operator tasks.
const OPERATORS: usize = 4;

/// A task that checks in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TaskId {
    /// That of a sensor.
    Sensor(SensorId),
    /// [`model`](super::model()).
    Model,
    /// [`journal`](super::journal()).
    Journal,
    /// [`operator`](super::operator()), numbered in the order of starting.
    Operator(u8),
}

impl TaskId {
    pub(super) const fn index(self) -> usize {
        match self {
            Self::Sensor(sensor) => sensor as usize,
            Self::Model => SensorId::COUNT,
            Self::Journal => SensorId::COUNT + 1,
            Self::Operator(number) => FIXED + number as usize,
        }
    }
}

pub(super) struct Liveness {
    check_ins: [AtomicU32; FIXED + OPERATORS],
    operators: AtomicU32,
    /// The latest tick for which sensors and control tick were woken.
    started: AtomicU32,
    /// The control tick has begun and not ended.
    in_tick: AtomicBool,
    /// The task below the control rate that ran last.
    background: AtomicU8,
}

impl Liveness {
    pub(super) const fn new() -> Self {
        Self {
            check_ins: [const { AtomicU32::new(0) }; FIXED + OPERATORS],
            operators: AtomicU32::new(0),
            started: AtomicU32::new(0),
            in_tick: AtomicBool::new(false),
            background: AtomicU8::new(0),
        }
    }

    pub(super) fn start(&self, tick: Tick) {
        self.started.store(tick, Ordering::Relaxed);
    }

    pub(super) fn in_tick(&self, running: bool) {
        self.in_tick.store(running, Ordering::Relaxed);
    }

    pub(super) fn running(&self, task: TaskId) {
        self.background.store(task.index() as u8, Ordering::Relaxed);
    }

    pub(super) fn check_in(&self, task: TaskId, now: Tick) {
        if let Some(seen) = self.check_ins.get(task.index()) {
            seen.store(now, Ordering::Relaxed);
        }
        if task.index() >= SensorId::COUNT {
            self.running(task);
        }
    }

    /// Number of a further operator task; beyond four, tasks share the last one.
    pub(super) fn enrol_operator(&self) -> TaskId {
        let number = (self.operators.load(Ordering::Relaxed) as usize).min(OPERATORS - 1);
        self.operators.store(number as u32 + 1, Ordering::Relaxed);
        TaskId::Operator(number as u8)
    }

    fn tasks(&self) -> usize {
        FIXED + self.operators.load(Ordering::Relaxed) as usize
    }

    /// Tasks that have not checked in within [`CHECK_IN_TICKS`]. One that never started
    /// counts as last seen at boot.
    pub(super) fn missed(&self, now: Tick) -> MissedCheckIns {
        let late = |task: &usize| {
            let seen = self.check_ins.get(*task).map_or(now, |seen| seen.load(Ordering::Relaxed));
            age(now, seen) > CHECK_IN_TICKS
        };
        all((0..self.tasks()).filter(late))
    }

    /// Why the watchdog is not fed: tasks that are late, or the one that blocks the control tick.
    pub(super) fn unfed(&self, now: Tick) -> MissedCheckIns {
        if age(now, self.started.load(Ordering::Relaxed)) > CHECK_IN_TICKS {
            return self.stalled_task();
        }
        let missed = self.missed(now);
        // A task that does not return blocks all others of its executor.
        if missed == all(SensorId::COUNT..self.tasks()) {
            MissedCheckIns::task(self.background.load(Ordering::Relaxed).into())
        } else {
            missed
        }
    }

    /// What blocks the control tick: the tick itself, the first of the sensors' tasks, in the
    /// order in which they run, without a check-in since its wake-up, or something outside their
    /// executor.
    fn stalled_task(&self) -> MissedCheckIns {
        if self.in_tick.load(Ordering::Relaxed) {
            return MissedCheckIns::TICK;
        }
        let started = self.started.load(Ordering::Relaxed);
        let stalled = SensorId::PERIODS
            .iter()
            .zip(&self.check_ins)
            .position(|(period, seen)| seen.load(Ordering::Relaxed) != started - started % period);
        stalled.map_or(MissedCheckIns::STARVED, MissedCheckIns::task)
    }
}

fn all(tasks: impl Iterator<Item = usize>) -> MissedCheckIns {
    tasks.map(MissedCheckIns::task).fold(MissedCheckIns::NOBODY, MissedCheckIns::and)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The tasks that always run, in their order.
    fn always() -> impl Iterator<Item = TaskId> + Clone {
        let sensors = SensorId::ALL.into_iter().map(TaskId::Sensor);
        sensors.chain([TaskId::Model, TaskId::Journal])
    }

    #[test]
    fn one_silent_task_is_enough() {
        let liveness = Liveness::new();
        assert!(liveness.missed(CHECK_IN_TICKS).is_nobody(), "since boot");
        assert_eq!(liveness.missed(CHECK_IN_TICKS + 1).0, 0x3F);
        let operators = [liveness.enrol_operator(), liveness.enrol_operator()];
        let tasks: Vec<_> = always().chain(operators).collect();
        for silent in &tasks {
            for task in &tasks {
                liveness.check_in(*task, if task == silent { 1000 } else { 1030 });
            }
            assert!(liveness.missed(1050).is_nobody(), "{silent:?}");
            let missed = liveness.missed(1051);
            assert_eq!(missed, MissedCheckIns::task(silent.index()), "{silent:?}");
        }
    }

    #[test]
    fn operators_beyond_the_last_share_its_number() {
        let liveness = Liveness::new();
        let numbers: Vec<_> = (0..6).map(|_| liveness.enrol_operator()).collect();
        assert_eq!(numbers[3..], [TaskId::Operator(3); 3]);
        for task in always().chain(numbers) {
            liveness.check_in(task, 500);
        }
        assert!(liveness.missed(500).is_nobody());
    }

    #[test]
    fn of_tasks_that_wait_the_running_one_is_named() {
        let liveness = Liveness::new();
        let operator = liveness.enrol_operator();
        liveness.start(1000);
        for task in always().take(4) {
            liveness.check_in(task, 1000);
        }
        liveness.running(TaskId::Journal);
        assert_eq!(liveness.unfed(1000).name(), "journal");
        liveness.check_in(operator, 0);
        assert_eq!(liveness.unfed(1000), MissedCheckIns::task(operator.index()));
        // Where the others go on, the one that does not is it.
        liveness.check_in(TaskId::Journal, 990);
        liveness.check_in(operator, 990);
        assert_eq!(liveness.unfed(1000).name(), "model");
    }

    #[test]
    fn the_task_that_blocks_the_tick_is_named() {
        let liveness = Liveness::new();
        for (index, task) in always().enumerate().take(SensorId::COUNT) {
            // Those before it have run in this tick, it and those behind it have not.
            for other in always() {
                liveness.check_in(other, if other.index() < index { 702 } else { 700 });
            }
            liveness.start(702);
            assert_eq!(liveness.unfed(900), MissedCheckIns::task(task.index()));
        }
        for task in always() {
            liveness.check_in(task, 702);
        }
        assert_eq!(liveness.unfed(900), MissedCheckIns::STARVED);
        liveness.in_tick(true);
        assert_eq!(liveness.unfed(900), MissedCheckIns::TICK);
        liveness.in_tick(false);
        // The angle is read every other tick alone.
        liveness.start(703);
        for task in always().take(3) {
            liveness.check_in(task, 703);
        }
        assert_eq!(liveness.unfed(900), MissedCheckIns::STARVED);
    }
}
