//! A run in software: the shipping control tick in closed loop with the plant, a
//! millisecond per step, as fast as the host allows.

mod closed_loop;
mod stream;

use std::time::Instant;

use interstage::model::Strategy;
use interstage::rig::{Rig, RigError};
use interstage::supervise::{Command, Mode};
use interstage::tick::Output;

use crate::injector::FaultTimes;
use crate::plant::limits::Refusal;
use crate::plant::rig::{PlantError, VirtualRig};
use crate::record::{Recording, starter};
use crate::scenario::{ControllerKind, Direction, Scenario};

pub use closed_loop::{Session, drives, initial_rig, plant_at_start, read};

/// Least useful speed, mm/s.
const SLOWEST_MM_S: f64 = 2.0;
/// What every run is given at least, s.
const LEAST_S: f64 = 120.0;

/// Longest run of a rig in one direction, or out and back, s: three times the travel at the least
/// useful speed, or at cruise speed where that is slower.
pub fn longest_s(rig: &Rig) -> f64 {
    let slowest = rig.drive.cruise_speed_mm_s.min(SLOWEST_MM_S);
    LEAST_S.max(3.0 * rig.rig.travel_mm / slowest)
}

/// Options of a run beside its scenario.
#[derive(Clone, Copy, Debug, Default)]
pub struct Options {
    /// Keep one row a tick.
    pub rows: bool,
    /// Crossing speed prescribed to the planner, mm/s, and whether it holds
    /// throughout.
    pub speed: Option<(f64, bool)>,
}

impl Options {
    /// Rows are kept.
    pub const ROWS: Self = Self { rows: true, speed: None };
}

/// Why a run could not be made.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    #[error("{0}")]
    Rig(#[from] RigError),
    #[error("plant: {0}")]
    Refused(#[from] Refusal),
    #[error("{0}")]
    Plant(#[from] PlantError),
    #[error("run.faults: {0} is a fault of the board's hardware: --target board")]
    Hardware(String),
}

impl From<ControllerKind> for Strategy {
    fn from(kind: ControllerKind) -> Self {
        match kind {
            ControllerKind::Scheduled => Self::Scheduled,
            ControllerKind::Constant => Self::Constant,
            ControllerKind::Limit => Self::Limit,
            ControllerKind::Reactive => Self::Reactive,
        }
    }
}

/// A controller and its rig, a millisecond a step: in software, or on the emulated board.
pub trait RunningRig {
    type Error;

    /// One millisecond with an operator's command or none; what the controller puts out.
    fn step(&mut self, command: Option<Command>) -> Result<Output, Self::Error>;

    fn mode(&self) -> Mode;

    /// Whether an operator may give a command.
    fn is_free(&self) -> bool {
        true
    }

    /// Time since boot, s.
    fn time_s(&self) -> f64;

    fn plant(&self) -> &VirtualRig;

    /// When the scenario's faults came and acted.
    fn fault_times(&self) -> FaultTimes;

    /// The binary log since the last call, up to its `end` if the run is over; empty if it is not
    /// kept.
    fn take_log(&mut self, end: bool) -> Vec<u8>;
}

/// Whether a run in one direction is over.
pub const fn is_over(mode: Mode) -> bool {
    matches!(mode, Mode::Complete(_) | Mode::FaultHold(_))
}

/// An operator who begins a run in this direction as soon as the drive is idle, once.
pub fn once(direction: Direction) -> impl FnMut(Mode) -> Option<Command> {
    let mut start = Some(starter(direction));
    move |mode| if mode == Mode::Idle { start.take() } else { None }
}

/// Drives a rig by the operator's command in each mode, until `each` says that it is over, or for
/// `longest_s`. After each millisecond `each` gets its command and output.
pub fn drive<R: RunningRig>(
    rig: &mut R,
    longest_s: f64,
    mut operator: impl FnMut(Mode) -> Option<Command>,
    mut each: impl FnMut(&mut R, Option<Command>, &Output) -> bool,
) -> Result<(), R::Error> {
    let end_s = rig.time_s() + longest_s;
    while rig.time_s() < end_s {
        let command = if rig.is_free() { operator(rig.mode()) } else { None };
        let output = rig.step(command)?;
        if each(rig, command, &output) {
            break;
        }
    }
    Ok(())
}

/// Runs a scenario to its end: arrival, fault hold, or time. The operator presses the
/// button once, as soon as the drive is idle.
pub fn run(scenario: &Scenario, options: Options) -> Result<Recording, RunError> {
    run_session(Session::new(scenario, options)?, scenario)
}

/// [`run`] of a session that has been made ready for this scenario.
pub fn run_session(mut session: Session, scenario: &Scenario) -> Result<Recording, RunError> {
    let (started, operator) = (Instant::now(), once(scenario.run.direction));
    drive(&mut session, longest_s(&scenario.rig), operator, |rig, _, _| is_over(rig.mode()))?;
    Ok(session.finish(started.elapsed().as_secs_f64()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_is_time_for_both_directions_at_any_cruise_speed() {
        let mut rig = Rig::prototype();
        for (travel_mm, cruise_mm_s) in [(80.0, 8.0), (1000.0, 5.0), (160.0, 2.0), (80.0, 0.5)] {
            (rig.rig.travel_mm, rig.drive.cruise_speed_mm_s) = (travel_mm, cruise_mm_s);
            assert!(longest_s(&rig) > 1.2 * (2.0 * travel_mm / cruise_mm_s));
        }
    }
}
