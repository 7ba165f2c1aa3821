//! What an operator does with a rig at rest: jog, home, release, zero.
//!
//! Jog and release move one motor in the firmware's service mode, which has the bounds; home is the
//! controller's own retraction to the stow end. The operator's stop ends each of them.

use std::ops::ControlFlow;

use interstage::log::Record;
use interstage::rig::Rig;
use interstage::sense::raw::SensorId;
use interstage::supervise::service::MOTION_TICKS;
use interstage::supervise::{Command, Mode, ServiceDuties};
use interstage::units::Direction;
use serde::Serialize;

use super::figures::{count, level, travel_mm};
use super::line::{Line, drive, press};
use super::motion::CHANGED;
use super::{BringupError, Operator};
use crate::plant::sensors::decode;

/// Farthest jog, mm.
pub const FARTHEST_MM: f64 = 200.0;
/// Duty of a jog: a quarter of the stall force, which is over the prototype's load.
const JOG: f64 = 0.25;
/// Distance to the goal at which a jog asks for rest, mm: the wheel runs on while the request is
/// under way.
const NEAR_MM: f64 = 0.3;
/// A motion of a jog that turns less has met something, mm.
const STUCK_MM: f64 = 0.1;
/// Duty that releases the preload, and its time in a motion, ms: 6 N on the prototype.
const RELEASE: f64 = -0.25;
const RELEASE_MS: u32 = 1000;
/// Fall of the preload since the service mode was entered, N, at which it is entered again: one
/// motion before its bound.
const FALL_N: f64 = 9.0;
/// Preload that a sensor may show of none, N, as the firmware's zero takes it.
const UNLOADED_N: f64 = 3.0;
/// Most motions of a release or a jog.
const MOTIONS: u32 = 60;
/// Rest behind a motion, ms.
const REST_MS: u32 = 300;
/// Time between two looks at a retraction, ms.
const LOOK_MS: u32 = 20;
/// Rows within which a retraction that was commanded has begun: the command waits for a tick.
const START_MS: usize = 500;

/// What is done.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Operation {
    /// Turns the wheel by so many millimetres of its tread, outwards if positive.
    Jog(f64),
    /// Retracts to the stow end.
    Home,
    /// Turns the pre-tightener back until the preload no longer falls.
    Release,
    /// Resets the controller, which takes the sensors' zeros at the stow end.
    Zero,
}

impl Operation {
    /// What the operator has to allow; nothing if nothing moves.
    fn motion(self) -> Option<String> {
        match self {
            Self::Jog(mm) => Some(format!("The DRIVE turns the wheel by {mm:+} mm of its tread.")),
            Self::Home => Some("The DRIVE retracts to the stow end.".to_owned()),
            Self::Release => Some(
                "The PRE-TIGHTENER takes the preload off, and the wheel no longer holds the unit: \
                 support it."
                    .to_owned(),
            ),
            Self::Zero => None,
        }
    }
}

/// How an operation has ended.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Operated {
    /// It did what it was asked.
    pub done: bool,
    /// Why not, or what holds from now on.
    pub note: String,
    /// Mode at its end.
    pub mode: String,
    /// Travel of the tread meanwhile, by the encoder, mm.
    pub travel_mm: f64,
    /// Preload, N, and compression, mm, at its end, by the sensors' nominal zeros.
    pub preload_n: f64,
    pub compression_mm: f64,
}

/// Carries out one operation. Whatever moves comes to rest once `stopped` says so.
///
/// # Errors
/// If the board is silent, moves or holds a fault, or if the operator does not allow the motion.
pub fn operate(
    line: &mut Line<'_>,
    operator: &mut dyn Operator,
    operation: Operation,
    stopped: &dyn Fn() -> bool,
) -> Result<Operated, BringupError> {
    let rig = &line.held()?.rig;
    let mode = line.started()?;
    match mode {
        _ if operation == Operation::Zero && mode.is_at_rest() => {}
        Mode::FaultHold(_) => {
            let held = "mend its cause, then `rig zero` resets it";
            return Err(BringupError::Busy(format!("{}: {held}", words(mode))));
        }
        Mode::Idle | Mode::Complete(_) => {}
        _ => return Err(BringupError::Busy(format!("{}: stop it first", words(mode)))),
    }
    if let Some(motion) = operation.motion() {
        operator.confirm(&motion)?;
        if stopped() {
            return Err(BringupError::Declined(motion));
        }
    }
    let mut doing = Doing { line, rig, stopped, rows: Vec::new() };
    let ended = match operation {
        Operation::Jog(mm) => doing.jog(mm),
        Operation::Home => doing.home(mode),
        Operation::Release => doing.release(),
        Operation::Zero => doing.zero(),
    };
    if ended.is_err() {
        doing.line.leave();
    }
    let (done, note) = ended?;
    let (preload_n, compression_mm) = doing.level()?;
    Ok(Operated {
        done,
        note: if stopped() { "stopped by the operator".to_owned() } else { note },
        mode: words(doing.mode()),
        travel_mm: travel_mm(rig, &doing.rows),
        preload_n,
        compression_mm,
    })
}

/// A mode in words, with its fault.
fn words(mode: Mode) -> String {
    match mode {
        Mode::FaultHold(fault) => format!("fault {}: {}", fault.code(), fault.sentence()),
        mode => mode.words().to_owned(),
    }
}

/// An operation under way.
struct Doing<'a, 'p> {
    line: &'a mut Line<'p>,
    rig: &'a Rig,
    stopped: &'a dyn Fn() -> bool,
    /// All that was heard.
    rows: Vec<Record>,
}

/// Whether it did what it was asked, and what there is to say.
type Ended = Result<(bool, String), BringupError>;

impl Doing<'_, '_> {
    fn mode(&self) -> Mode {
        self.rows.last().map_or(Mode::Boot, |row| row.telemetry.mode)
    }

    /// Preload, N, and compression, mm, of the last tenth of a second.
    fn level(&self) -> Result<(f64, f64), BringupError> {
        let of = |sensor| level(sensor, self.rig, self.rows.iter().rev().take(100));
        Ok((of(SensorId::PreloadSensor)?, of(SensorId::CompressionSensor)?))
    }

    /// A motion of the service mode, until `is_over` says so of its travel, mm, or the operator
    /// stops it. Returns its travel; none if a fault has ended it.
    fn motion(
        &mut self,
        duties: ServiceDuties,
        milliseconds: u32,
        is_over: impl Fn(f64) -> bool,
    ) -> Result<Option<f64>, BringupError> {
        let (stopped, rig) = (self.stopped, self.rig);
        let mut start = None;
        let motion = self.line.move_and(duties, milliseconds, REST_MS, |line| {
            let Some(count) = line.heard().last().map(count) else {
                return Ok(ControlFlow::Continue(()));
            };
            let counts = count.since(*start.get_or_insert(count));
            let is_over = stopped() || is_over(decode(SensorId::WheelEncoder, rig, counts.into()));
            Ok(if is_over { ControlFlow::Break(()) } else { ControlFlow::Continue(()) })
        })?;
        let travel_mm = travel_mm(rig, &motion.rows);
        self.rows.extend(motion.rows);
        Ok((self.mode() == Mode::Service).then_some(travel_mm))
    }

    /// Leads back to idle, through the self-test; returns whether it did.
    fn reset(&mut self) -> Result<bool, BringupError> {
        let rows = self.line.reset_rows()?;
        self.rows.extend(rows);
        Ok(self.mode() == Mode::Idle)
    }

    fn jog(&mut self, wanted_mm: f64) -> Ended {
        self.reset()?;
        let mut left = wanted_mm;
        let mut note = "the position is not known now: `rig home` finds the stow end";
        for _ in 0..MOTIONS {
            let to_go = left.abs() - NEAR_MM;
            if to_go <= 0.0 || (self.stopped)() {
                break;
            }
            let duties = drive(JOG.copysign(left));
            let Some(moved) =
                self.motion(duties, MOTION_TICKS.into(), |travel| travel.abs() >= to_go)?
            else {
                return Ok((false, words(self.mode())));
            };
            left -= moved;
            if moved.abs() < STUCK_MM {
                note = "the wheel does not turn at a quarter of the duty";
                break;
            }
        }
        Ok((self.reset()? && left.abs() <= 2.0 * NEAR_MM, note.to_owned()))
    }

    fn home(&mut self, mode: Mode) -> Ended {
        let there = Mode::Complete(Direction::Retract);
        if mode == there {
            self.rows = self.line.listen(LOOK_MS)?;
            return Ok((true, "the wheel was there already".to_owned()));
        }
        // A second letter would mean stop: it is sent once.
        self.line.command(Command::Retract)?;
        let (mut has_begun, mut is_stopping) = (false, false);
        loop {
            let rows = self.line.listen(LOOK_MS)?;
            if rows.is_empty() {
                return Ok((false, "the board has fallen silent".to_owned()));
            }
            self.rows.extend(rows);
            let is_at_rest = self.mode().is_at_rest();
            has_begun |= !is_at_rest;
            if is_at_rest && (has_begun || self.rows.len() > START_MS) {
                let done = self.mode() == there;
                let note = if done {
                    "the position is that of the stow end".to_owned()
                } else {
                    words(self.mode())
                };
                return Ok((done, note));
            }
            if (self.stopped)() && !is_stopping {
                self.line.command(Command::Stop)?;
                is_stopping = true;
            }
        }
    }

    fn release(&mut self) -> Ended {
        self.reset()?;
        let mut entry = self.level()?.0;
        for _ in 0..MOTIONS {
            let before = self.level()?.0;
            if self.motion(press(RELEASE), RELEASE_MS, |_| false)?.is_none() {
                return Ok((false, words(self.mode())));
            }
            let now = self.level()?.0;
            if now - before > CHANGED.0 {
                let note =
                    "the preload rises: the pre-tightener's leads are swapped, or the sensor's";
                self.reset()?;
                return Ok((false, note.to_owned()));
            }
            if (self.stopped)() || (before - now).abs() < CHANGED.0 {
                let is_slack = now.abs() < UNLOADED_N;
                let note = if is_slack {
                    "the pre-tightener is slack; `rig zero` takes zeros at the stow end"
                } else {
                    "the preload no longer falls, and is not gone: the screw, or the sensor's zero"
                };
                return Ok((self.reset()? && is_slack, note.to_owned()));
            }
            if (entry - now).abs() > FALL_N {
                self.reset()?;
                entry = now;
            }
        }
        self.reset()?;
        Ok((false, "the preload does not come to rest".to_owned()))
    }

    fn zero(&mut self) -> Ended {
        let is_idle = self.reset()?;
        let taken = self.rows.iter().any(|row| row.telemetry.mode == Mode::Zero);
        let note = match (is_idle, taken) {
            (true, true) => "zeros taken at the stow end".to_owned(),
            (true, false) => "no zeros taken, those of before hold: the wheel is not at the stow \
                              end, or something presses it, such as the load on its arm"
                .to_owned(),
            _ => words(self.mode()),
        };
        Ok((is_idle && taken, note))
    }
}
