//! A run in software as the ticks of its controller.

use interstage::supervise::{Command, Mode};
use interstage::tick::Input;
use interstage_images::tick::{Given, Taken};

use super::Phase;
use hil_sim::scenario::{Direction, Scenario};
use hil_sim::sil::{Options, RunError, Session};

/// Longest run recorded, ticks: as a run in software.
const LONGEST: usize = 120_000;

/// One tick of the controller.
#[derive(Clone, Copy, Debug)]
pub struct Recorded {
    /// What it was given; the plan is worked out anew.
    pub given: Given,
    /// What is looked at of what it gave.
    pub taken: Taken,
    /// Phase after it.
    pub phase: Phase,
}

/// Runs a scenario to its end and keeps what the controller was given and gave.
///
/// # Errors
/// [`RunError`] as for a run in software.
pub fn record(scenario: &Scenario) -> Result<Vec<Recorded>, RunError> {
    let mut session = Session::new(scenario, Options::default())?;
    let mut start = Some(match scenario.run.direction {
        Direction::Deploy => Command::Start,
        Direction::Retract => Command::Retract,
    });
    let mut ticks = Vec::new();
    while ticks.len() < LONGEST {
        let command = if session.mode() == Mode::Idle { start.take() } else { None };
        let sensors = session.sense();
        let now = ticks.len() as u32;
        let given = Given::of(&Input { now, sensors, command, ..Input::default() });
        let output = session.advance(&sensors, command)?;
        let phase = Phase { mode: output.telemetry.mode, stage: output.telemetry.stage };
        ticks.push(Recorded { given, taken: Taken::of(&output), phase });
        if matches!(session.mode(), Mode::Complete(_) | Mode::FaultHold(_)) {
            break;
        }
    }
    Ok(ticks)
}
