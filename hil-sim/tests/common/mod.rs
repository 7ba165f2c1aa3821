//! Scenarios, and a session with the test as its operator.

#![allow(dead_code, reason = "each test file uses its part of this")]

pub(crate) mod echo;
pub(crate) mod python;

use std::panic::{AssertUnwindSafe, catch_unwind};

use hil_sim::plant::ledger::Crossing;
use hil_sim::plant::rig::Truth;
pub(crate) use hil_sim::record::starter;
use hil_sim::scenario::{Direction, Scenario};
use hil_sim::session::{Options, RunningRig, Session};
use interstage::fault::Fault;
use interstage::sense::raw::SensorFrame;
use interstage::supervise::{Command, Mode};
use interstage::tick::{CrossingRecord, Entry, Event, Telemetry};
use interstage::units::{Direction as Course, MotorCommand};

pub(crate) const DIRECTIONS: [Direction; 2] = [Direction::Deploy, Direction::Retract];

pub(crate) const RIGS: [&str; 2] = ["prototype", "fe"];

/// Largest gross slip of a run that counts as none, mm.
pub(crate) const NO_SLIP_MM: f64 = 0.05;

/// A run of a preset's rig.
pub(crate) fn scenario(preset: &str, direction: Direction, seed: u64) -> Scenario {
    let mut scenario = Scenario::named(preset).expect("a preset");
    scenario.run.direction = direction;
    scenario.run.seed = seed;
    scenario
}

pub(crate) fn overridden(preset: &str, sets: &[&str]) -> Scenario {
    let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
    Scenario::resolve(Some(preset), None, &sets).expect("a sound scenario")
}

pub(crate) fn opposite(direction: Direction) -> Direction {
    match direction {
        Direction::Deploy => Direction::Retract,
        Direction::Retract => Direction::Deploy,
    }
}

/// Axial position at which a run in this direction ends, mm.
pub(crate) fn end_mm(scenario: &Scenario, direction: Direction) -> f64 {
    match direction {
        Direction::Deploy => scenario.rig.rig.travel_mm,
        Direction::Retract => 0.0,
    }
}

/// Checks every case and names all that fail.
pub(crate) fn check_each<C>(cases: impl IntoIterator<Item = C>, check: impl Fn(&C)) {
    let failed = |case| {
        let panic = catch_unwind(AssertUnwindSafe(|| check(&case))).err()?;
        Some(panic.downcast_ref::<String>().cloned().unwrap_or_default())
    };
    let failed: Vec<String> = cases.into_iter().filter_map(failed).collect();
    assert!(failed.is_empty(), "{} cases failed:\n{}", failed.len(), failed.join("\n"));
}

/// One millisecond: the controller's output and the true state after it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Moment {
    /// The controller's row.
    pub(crate) seen: Telemetry,
    /// The plant after the millisecond.
    pub(crate) truth: Truth,
    pub(crate) drive: MotorCommand,
    pub(crate) preload: MotorCommand,
}

impl Moment {
    pub(crate) fn is_off(&self) -> bool {
        !self.drive.enable && !self.preload.enable
    }

    /// The wheel stands and grips; its axle may still sink on the rubber.
    pub(crate) fn is_still(&self) -> bool {
        self.truth.rigid_mm_s.abs() < 1e-6 && self.truth.tread_mm_s == 0.0
    }
}

/// A session with its record.
pub(crate) struct Bench {
    pub(crate) session: Session,
    pub(crate) moments: Vec<Moment>,
    pub(crate) log: Vec<Entry>,
}

impl Bench {
    /// Before the first tick.
    pub(crate) fn new(scenario: &Scenario) -> Self {
        let session = Session::new(scenario, Options::default()).expect("a sound scenario");
        Self { session, moments: Vec::new(), log: Vec::new() }
    }

    /// Booted and waiting for a command.
    pub(crate) fn idle(scenario: &Scenario) -> Self {
        let mut bench = Self::new(scenario);
        bench.until("idle", 1.0, |now| now.seen.mode == Mode::Idle);
        bench
    }

    /// A millisecond on sensors as `spoil` leaves them.
    pub(crate) fn spoiled(
        &mut self,
        command: Option<Command>,
        spoil: impl FnOnce(&mut SensorFrame),
    ) -> &Moment {
        let mut frame = self.session.sense();
        spoil(&mut frame);
        let output = self.session.advance(&frame, command).expect("a sound plant");
        self.log.extend(&output.events);
        self.moments.push(Moment {
            seen: output.telemetry,
            truth: *self.session.plant().truth(),
            drive: output.drive,
            preload: output.preload,
        });
        self.now()
    }

    pub(crate) fn tick(&mut self) -> &Moment {
        self.spoiled(None, |_| {})
    }

    pub(crate) fn give(&mut self, command: Command) -> &Moment {
        self.spoiled(Some(command), |_| {})
    }

    pub(crate) fn run_s(&mut self, seconds: f64) {
        for _ in 0..(seconds * 1e3).round() as usize {
            self.tick();
        }
    }

    /// Runs until the condition holds, and returns how long it took, s.
    pub(crate) fn until(
        &mut self,
        what: &str,
        within_s: f64,
        mut holds: impl FnMut(&Moment) -> bool,
    ) -> f64 {
        let from = self.session.time_s();
        while self.session.time_s() - from < within_s {
            if holds(self.tick()) {
                return self.session.time_s() - from;
            }
        }
        let now = self.now();
        panic!("no {what} within {within_s} s: {:?}, {:?}", now.seen, now.truth);
    }

    /// Starts in this direction, and runs as [`Bench::finish`].
    pub(crate) fn go(&mut self, direction: Direction) -> Mode {
        self.give(starter(direction));
        self.finish()
    }

    /// Runs until arrival or fault hold, and returns the mode.
    pub(crate) fn finish(&mut self) -> Mode {
        let ended = |now: &Moment| matches!(now.seen.mode, Mode::Complete(_) | Mode::FaultHold(_));
        self.until("end", 30.0, ended);
        self.mode()
    }

    pub(crate) fn now(&self) -> &Moment {
        self.moments.last().expect("not before the first tick")
    }

    pub(crate) fn mode(&self) -> Mode {
        self.session.mode()
    }

    pub(crate) fn position_mm(&self) -> f64 {
        self.session.plant().truth().position_mm
    }

    pub(crate) fn peak_preload_n(&self) -> f64 {
        self.moments.iter().map(|now| now.truth.preload_n).fold(0.0, f64::max)
    }

    /// The plant's ledger.
    pub(crate) fn crossings(&self) -> &[Crossing] {
        self.session.plant().ledger().crossings()
    }

    /// The true gap that this record measured, mm; none if the crossing was turned back before it
    /// counted in the plant's ledger.
    pub(crate) fn true_gap_mm(&self, record: &CrossingRecord) -> Option<f64> {
        let same = |crossing: &&Crossing| {
            crossing.index == usize::from(record.index)
                && crossing.climbing == (record.direction == Course::Deploy)
        };
        let off = |gap_mm: &f64| (gap_mm - record.gap_measured.to_num::<f64>()).abs();
        let gaps = self.crossings().iter().filter(same).map(|crossing| crossing.gap_mm);
        gaps.min_by(|a, b| off(a).total_cmp(&off(b)))
    }

    /// The controller's ledger.
    pub(crate) fn records(&self) -> Vec<CrossingRecord> {
        self.pick(|event| match event {
            Event::Crossing(record) => Some(record),
            _ => None,
        })
    }

    pub(crate) fn faults(&self) -> Vec<Fault> {
        self.pick(|event| match event {
            Event::Fault(fault) => Some(fault),
            _ => None,
        })
    }

    /// Codes of the limits that report steps out of place.
    pub(crate) fn step_codes(&self) -> Vec<u16> {
        let codes = self.pick(|event| match event {
            Event::Limit(limit) => Some(limit.code()),
            _ => None,
        });
        codes.into_iter().filter(|code| STEP_CODES.contains(code)).collect()
    }

    fn pick<T>(&self, of: impl Fn(Event) -> Option<T>) -> Vec<T> {
        self.log.iter().filter_map(|entry| of(entry.event)).collect()
    }
}

/// Codes of steps early, late, missing and extra.
pub(crate) const STEP_CODES: [u16; 4] = [201, 202, 203, 204];
