//! A run in software: the shipping control tick in closed loop with the plant, a
//! millisecond at a time, as fast as the host goes.

mod account;
mod echo;
mod session;
mod stream;
mod trace;

use std::time::Instant;

use interstage::model::Strategy;
use interstage::rig::RigError;
use interstage::supervise::{Command, Mode};
use interstage::tick::{CrossingRecord, Event, Output};

use crate::plant::limits::Refusal;
use crate::plant::rig::PlantError;
use crate::record::{LogLine, Recording, Report};
use crate::scenario::{ControllerKind, Direction, Scenario};

pub use account::{PhaseAccount, PlantAccount, account, account_of};
pub use echo::Echo;
pub use session::{Session, drives, read};
pub use stream::Stream;
pub(crate) use trace::Trace;
pub use trace::text;

/// Control period, s.
pub(crate) const TICK_S: f64 = 1e-3;
/// Longest run, s: the whole travel at the least useful speed, three times over.
pub(crate) const LONGEST_S: f64 = 120.0;

/// What is asked of a run beside its scenario.
#[derive(Clone, Copy, Debug, Default)]
pub struct Options {
    /// Keep one row a tick.
    pub rows: bool,
    /// Crossing speed prescribed to the planner, mm/s, and whether it holds
    /// throughout.
    pub speed: Option<(f64, bool)>,
}

/// A run that could not be made.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The parameters do not make a controller.
    #[error("{0}")]
    Rig(#[from] RigError),
    /// The plant of this seed cannot be computed, because it cannot be.
    #[error("plant: {0}")]
    Refused(#[from] Refusal),
    /// The plant left the set of meaningful states.
    #[error("{0}")]
    Plant(#[from] PlantError),
    /// There is no board that could break.
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

/// Runs a scenario to its end: arrival, fault hold, or time. The operator presses the
/// button once, as soon as the drive is idle.
///
/// # Errors
/// [`RunError`] if the parameters are out of range or the plant fails. A run that
/// ends in a fault is a result, not an error.
pub fn run(scenario: &Scenario, options: Options) -> Result<Recording, RunError> {
    run_session(Session::new(scenario, options)?, scenario)
}

/// [`run`] of a session that has been made ready for this scenario.
///
/// # Errors
/// [`RunError::Plant`] if the plant fails.
pub fn run_session(mut session: Session, scenario: &Scenario) -> Result<Recording, RunError> {
    let mut start = Some(start_of(scenario));
    let started = Instant::now();
    while tick(&mut session, &mut start)?.is_some() {}
    Ok(session.finish(started.elapsed().as_secs_f64()))
}

/// The command that sets a run going.
pub(crate) fn start_of(scenario: &Scenario) -> Command {
    match scenario.run.direction {
        Direction::Deploy => Command::Start,
        Direction::Retract => Command::Retract,
    }
}

/// A tick of a run that gets `start` as soon as the drive is idle; none at its end.
fn tick(session: &mut Session, start: &mut Option<Command>) -> Result<Option<Output>, RunError> {
    let over = matches!(session.mode(), Mode::Complete(_) | Mode::FaultHold(_));
    if over || session.time_s() >= LONGEST_S {
        return Ok(None);
    }
    let command = if session.mode() == Mode::Idle { start.take() } else { None };
    session.step(command).map(Some)
}

/// Kept for the ledger: when, and what the controller reported of a crossing.
type Reported = (f64, CrossingRecord);

/// Log line, fault and limit reports of an event.
fn report(t_s: f64, event: &Event) -> (LogLine, Option<(bool, Report)>) {
    let line = LogLine { t_s, text: text(event) };
    let found = match event {
        Event::Fault(fault) => Some((true, fault.code(), fault.sentence())),
        Event::Limit(limit) => Some((false, limit.code(), limit.sentence())),
        _ => None,
    };
    let found =
        found.map(|(latched, code, text)| (latched, Report { t_s, code, text: text.to_owned() }));
    (line, found)
}
