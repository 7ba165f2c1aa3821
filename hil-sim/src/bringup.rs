//! The first power-up of a rig, guided from the host over the probe.
//!
//! Stage by stage: what can be judged at rest comes first, then the emergency stop, then motion
//! in the firmware's service mode, which has the bounds. A stage with a check that fails is the
//! last. Every check has its line in [`CHECKS`]; what a failed one advises is beside its
//! measurement.

mod drive;
mod figures;
mod line;
mod motion;
mod operate;
mod operator;
mod page;
mod pretightener;
mod rest;
mod state;
mod stop;

use Stage::{Board, Drive, Pretightener, Sensors, Stop};
use serde::{Deserialize, Serialize};

use crate::probe::PortError;
use crate::scenario::Scenario;

pub use figures::stowed;
pub use line::Line;
pub use operate::{FARTHEST_MM, Operated, Operation, operate};
pub use operator::{Action, Operator, Question, Seen, Sensor, Stdin};
pub use page::html;
pub use state::Progress;

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Check {
    /// Its name in [`CHECKS`].
    pub name: String,
    /// Passed.
    pub ok: bool,
    /// What was found.
    pub measured: String,
    /// What a sound rig shows.
    pub expected: String,
    /// What to do; empty if it has passed.
    pub advice: String,
}

/// A part of the power-up; the next one begins when all its checks have passed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Stage {
    /// The board alone.
    Board,
    /// Sensors at rest.
    Sensors,
    /// Emergency stop and reset.
    Stop,
    /// The drive, wheel free.
    Drive,
    /// The pre-tightener.
    Pretightener,
}

impl Stage {
    /// Every stage, in its order.
    pub const ALL: [Self; 5] = [Board, Sensors, Stop, Drive, Pretightener];

    /// In words.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Board => "board",
            Self::Sensors => "sensors at rest",
            Self::Stop => "emergency stop",
            Self::Drive => "drive",
            Self::Pretightener => "pre-tightener",
        }
    }
}

/// What there is to know of a check.
#[derive(Clone, Copy, Debug)]
pub struct CheckInfo {
    pub name: &'static str,
    pub stage: Stage,
    /// What is done.
    pub does: &'static str,
    /// What a sound rig shows.
    pub expected: &'static str,
}

const fn info(
    name: &'static str,
    stage: Stage,
    does: &'static str,
    expected: &'static str,
) -> CheckInfo {
    CheckInfo { name, stage, does, expected }
}

/// Every check, in its order.
pub const CHECKS: &[CheckInfo] = &[
    info("option bytes", Board, "reads FLASH_OPTR", "DBANK = 1, as delivered"),
    info("firmware", Board, "reads the binary log for 0.5 s", "a tick each millisecond"),
    info("stop contact", Board, "reads PB12 and PB7", "both low: closed"),
    info("readback at rest", Board, "reads both bridges", "0 % of the supply, 3 % at most"),
    info("encoder at rest", Sensors, "counts for 0.5 s", "2 counts at most"),
    info("preload sensor", Sensors, "reads it unloaded", "0 N, 3 N at most"),
    info("preload noise", Sensors, "reads it for 0.5 s", "0.2 N at most, one sigma"),
    info("compression sensor", Sensors, "reads it unloaded", "0 mm, 0.1 mm at most"),
    info("compression noise", Sensors, "reads it for 0.5 s", "0.008 mm at most, one sigma"),
    info("angle sensor", Sensors, "reads its frames", "sound frames, field in range"),
    info("angle zero", Sensors, "compares it with the stow end", "within 40 codes"),
    info("preload lead", Sensors, "you unplug the sensor", "below 2 % of the converter"),
    info("compression lead", Sensors, "you unplug the sensor", "below 2 % of the converter"),
    info("self-test", Sensors, "resets the controller", "idle, zeros taken"),
    info("stop pressed", Stop, "you press the emergency stop", "fault 151"),
    info("stop cuts supply", Stop, "you look at the supply", "the motors have no supply"),
    info("held in reset", Stop, "you hold the board's reset button", "nothing moves"),
    info("drive bridge", Drive, "15 % for 0.6 s, readback", "15 %, the other bridge 0"),
    info("drive turns", Drive, "15 % outwards, the encoder", "counts upwards"),
    info("drive direction", Drive, "you look at the wheel", "it turns outwards"),
    info("drive speed", Drive, "15 % and 30 %", "its parameter, within 25 %"),
    info("drive friction", Drive, "the same", "less than 8 % of duty"),
    info(
        "pre-tightener bridge",
        Pretightener,
        "25 % for 0.55 s, readback",
        "25 %, the other bridge 0",
    ),
    info("preload rises", Pretightener, "the same", "preload and compression rise"),
    info(
        "preload against tread",
        Pretightener,
        "three steps",
        "compression grows less than the preload",
    ),
    info("arm direction", Pretightener, "the same", "the angle's code grows"),
    info("preload scale", Pretightener, "the same", "as spring 25 %, as tread 50 %"),
    info("preload released", Pretightener, "backwards until slack", "below 2 N, then idle"),
];

/// A check of this name.
///
/// # Panics
/// If [`CHECKS`] lacks it.
fn check(name: &str, ok: bool, measured: String, advice: &str) -> Check {
    let info = CHECKS.iter().find(|info| info.name == name);
    let expected = info.unwrap_or_else(|| panic!("no check {name}")).expected.to_owned();
    let advice = if ok { String::new() } else { advice.to_owned() };
    Check { name: name.to_owned(), ok, measured, expected, advice }
}

/// Why a power-up ended without a verdict. Displays as one line.
#[derive(Debug, thiserror::Error)]
pub enum BringupError {
    /// The probe or the board failed.
    #[error(transparent)]
    Port(#[from] PortError),
    /// The board does not answer on its line, or refuses.
    #[error(transparent)]
    Line(#[from] crate::params::StoreError),
    /// The user did not confirm.
    #[error("not confirmed: {0} Nothing was moved")]
    Declined(String),
    /// The rig is not at rest, or holds a fault.
    #[error("nothing was moved: {0}")]
    Busy(String),
    /// Nothing is left of the scripted answers.
    #[error("no answer to: {0}")]
    NoAnswer(String),
}

/// What a stage works with.
pub(crate) struct Session<'a, 'p> {
    pub(crate) line: &'a mut Line<'p>,
    pub(crate) operator: &'a mut dyn Operator,
    /// The rig as it should be, and what was measured of it.
    pub(crate) expected: &'a Scenario,
    pub(crate) proposed: &'a mut Scenario,
    /// Told to the user as it is measured.
    pub(crate) say: &'a mut dyn FnMut(&str),
}

impl Session<'_, '_> {
    /// A value that was measured, with half the width of its interval.
    pub(crate) fn measured(&mut self, key: &str, value: f64, within: f64) {
        let digits = (1.0 - within.log10().floor()).clamp(0.0, 4.0) as usize;
        let (low, high) = (value - within, value + within);
        let source = format!("{low:.digits$} to {high:.digits$}, first power-up");
        self.proposed.sources.insert(key.to_owned(), source);
    }
}

/// What a power-up proposes: key, value on the board, value measured.
pub(crate) fn proposals(progress: &Progress) -> Vec<(String, String, String)> {
    let (was, is) = (progress.expected.keys(), progress.proposed.keys());
    let differ = was.into_iter().zip(is).filter(|(was, is)| was.value != is.value);
    differ.map(|(was, is)| (was.key.clone(), was.value.to_string(), is.value.to_string())).collect()
}

/// Runs the stages that `progress` lacks; `keep` is called after each.
pub fn run(
    line: &mut Line<'_>,
    operator: &mut dyn Operator,
    progress: &mut Progress,
    say: &mut dyn FnMut(&str),
    keep: &mut dyn FnMut(&Progress),
) -> Result<(), BringupError> {
    let expected = progress.expected.clone();
    let mut supplied = false;
    for stage in Stage::ALL {
        if progress.is_done(stage) {
            say(&format!("{}: passed before", stage.name()));
            continue;
        }
        say(&format!("{}:", stage.name()));
        if !matches!(stage, Stage::Board | Stage::Sensors) && !supplied {
            operator.act(Action::SwitchOn)?;
            // Where stages were passed before, the board has just started.
            line.idle()?;
            supplied = true;
        }
        let mut proposed = progress.proposed.clone();
        let session =
            &mut Session { line, operator, expected: &expected, proposed: &mut proposed, say };
        let checks = match stage {
            Stage::Board => rest::board(session),
            Stage::Sensors => rest::sensors(session),
            Stage::Stop => stop::run(session),
            Stage::Drive => drive::drive(session),
            Stage::Pretightener => pretightener::pretightener(session),
        };
        let checks = match checks {
            Ok(checks) => checks,
            Err(error) => {
                line.leave();
                return Err(error);
            }
        };
        for check in &checks {
            let verdict = if check.ok { "ok    " } else { "FAILED" };
            say(&format!("  {verdict} {}: {}", check.name, check.measured));
            if !check.ok {
                say(&format!("         expected: {}", check.expected));
                say(&format!("         {}", check.advice));
            }
        }
        let good = checks.iter().all(|check| check.ok);
        if good {
            progress.proposed = proposed;
        }
        progress.add(stage, checks);
        keep(progress);
        if !good {
            line.leave();
            break;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_manual_has_each_check_with_what_is_done_and_expected() {
        let page = include_str!("../../docs/HARDWARE.md");
        for CheckInfo { name, stage, does, expected } in CHECKS {
            let row = format!("| {} | {name} | {does} | {expected} |", stage.name());
            assert!(page.contains(&row), "{row}");
        }
    }
}
