//! The first power-up of a rig, guided from the host over the probe.
//!
//! Stage by stage: what can be judged at rest comes first, then the emergency stop, then motion
//! in the firmware's service mode, which has the bounds. A stage with a check that fails is the
//! last. Every check has its row in [`GATES`], with the limits of its figure; what a failed
//! one advises is beside its measurement.

mod drive;
mod figures;
pub(crate) mod gates;
mod line;
mod motion;
mod operate;
mod operator;
mod page;
mod pretightener;
mod pull;
mod reference;
mod rest;
mod state;
mod stop;

use interstage::sense::analog::BROKEN_BELOW;
use serde::{Deserialize, Serialize};

use crate::probe::PortError;
use crate::scenario::Scenario;

pub use figures::stowed;
pub use line::Line;
pub use operate::{FARTHEST_MM, Operated, Operation, operate};
pub use operator::{Action, Operator, Question, Seen, Stdin};
pub(crate) use page::html;
pub use state::Progress;

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Check {
    /// Its name in [`GATES`].
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

type Run = fn(&mut Session<'_, '_>) -> Result<Vec<Check>, BringupError>;

/// A stage and what it checks.
pub struct Gate {
    pub stage: Stage,
    pub name: &'static str,
    /// What makes its checks; none if logs do.
    run: Option<Run>,
    /// Its checks in their order.
    pub checks: &'static [Row],
}

/// A check of a stage.
pub struct Row {
    pub name: &'static str,
    /// What is done.
    pub does: &'static str,
    /// What a sound rig shows.
    pub expected: &'static str,
    /// Least and largest figure of a sound rig.
    limits: (f64, f64),
}

impl Row {
    /// Whether a sound rig shows this figure.
    fn has(&self, figure: f64) -> bool {
        (self.limits.0..=self.limits.1).contains(&figure)
    }

    /// The check by its figure, which fails if there is none.
    fn by(&self, figure: Option<f64>, measured: String, advice: &str) -> Check {
        self.check(figure.is_some_and(|figure| self.has(figure)), measured, advice)
    }

    /// The check, passed or not.
    fn check(&self, ok: bool, measured: String, advice: &str) -> Check {
        let (name, expected) = (self.name.to_owned(), self.expected.to_owned());
        let advice = if ok { String::new() } else { advice.to_owned() };
        Check { name, ok, measured, expected, advice }
    }
}

/// No limit.
const MOST: f64 = f64::INFINITY;

/// Declares the gates: stage, name and what makes its checks; then a row for each check, with the
/// limits of its figure if it has one.
macro_rules! gates {
    ($($(#[$about:meta])* $stage:ident $name:literal, $run:expr =>
        $($row:ident $check:literal | $does:literal | $expected:literal
            $(in $limits:expr)?),*;)*) => {
        mod row {
            use super::{BROKEN_BELOW, MOST, Row};
            $($(pub(crate) const $row: Row = Row {
                name: $check,
                does: $does,
                expected: $expected,
                limits: [$($limits,)? (-MOST, MOST)][0],
            };)*)*
        }

        /// A part of the way from wiring to a trusted run; the next one begins when all its checks
        /// have passed.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
        #[serde(rename_all = "snake_case")]
        pub enum Stage { $($(#[$about])* $stage,)* }

        /// Every gate, in its order.
        pub const GATES: &[Gate] = &[$(Gate {
            stage: Stage::$stage,
            name: $name,
            run: $run,
            checks: &[$(row::$row),*],
        }),*];
    };
}

gates! {
    Board "board", Some(rest::board) =>
        OPTION_BYTES "option bytes" | "reads FLASH_OPTR" | "DBANK = 1, as delivered",
        FIRMWARE "firmware" | "reads the binary log for 0.5 s" |
            "a tick each millisecond" in (500.0, MOST),
        STOP_CONTACT "stop contact" | "reads PB12 and PB7" | "both low: closed",
        READBACK_AT_REST "readback at rest" | "reads both bridges" |
            "0 % of the supply, 3 % at most" in (0.0, 0.03);
    Sensors "sensors at rest", Some(rest::sensors) =>
        ENCODER_AT_REST "encoder at rest" | "counts for 0.5 s" | "2 counts at most" in (0.0, 2.0),
        PRELOAD_SENSOR "preload sensor" | "reads it unloaded" | "0 N, 3 N at most" in (0.0, 3.0),
        PRELOAD_NOISE "preload noise" | "reads it for 0.5 s" |
            "0.2 N at most, one sigma" in (0.0, 0.2),
        COMPRESSION_SENSOR "compression sensor" | "reads it unloaded" |
            "0 mm, 0.1 mm at most" in (0.0, 0.1),
        COMPRESSION_NOISE "compression noise" | "reads it for 0.5 s" |
            "0.008 mm at most, one sigma" in (0.0, 0.008),
        ANGLE_SENSOR "angle sensor" | "reads its frames" |
            "sound frames, field in range" in (0.99, 1.0),
        // A magnet off by more moves the wheel's place by over 1.5 mm.
        ANGLE_ZERO "angle zero" | "compares it with the stow end" |
            "within 40 codes; a new magnet's is named" in (0.0, 40.0),
        PRELOAD_LEAD "preload lead" | "you unplug the sensor" |
            "below 2 % of the converter" in (0.0, BROKEN_BELOW),
        COMPRESSION_LEAD "compression lead" | "you unplug the sensor" |
            "below 2 % of the converter" in (0.0, BROKEN_BELOW),
        SELF_TEST "self-test" | "resets the controller" | "idle, zeros taken";
    Stop "emergency stop", Some(stop::run) =>
        STOP_PRESSED "stop pressed" | "you press the emergency stop" | "fault 151",
        STOP_CUTS_SUPPLY "stop cuts supply" | "you measure at the bridges" | "below 3 V within 5 s",
        HELD_IN_RESET "held in reset" | "you hold the board's reset button" |
            "no voltage at the bridges' outputs";
    /// The drive, wheel free.
    Drive "drive", Some(drive::drive) =>
        DRIVE_BRIDGE "drive bridge" | "15 % for 0.6 s, readback" | "15 %, the other bridge 0",
        // Ten times what it may count at rest.
        DRIVE_TURNS "drive turns" | "15 % outwards, the encoder" | "counts upwards" in (21.0, MOST),
        DRIVE_DIRECTION "drive direction" | "you look at the wheel" |
            "its wall side goes to the stow end",
        DRIVE_SPEED "drive speed" | "15 % and 30 %" | "its parameter, within 25 %" in (0.75, 1.25),
        DRIVE_FRICTION "drive friction" | "the same" | "less than 8 % of duty" in (-MOST, 0.08);
    Pretightener "pre-tightener", Some(pretightener::pretightener) =>
        PRETIGHTENER_BRIDGE "pre-tightener bridge" | "25 % for 0.55 s, readback" |
            "25 %, the other bridge 0",
        PRELOAD_RISES "preload rises" | "the same" | "preload and compression rise",
        ARM_DIRECTION "arm direction" | "three steps" | "the angle's code grows" in (1.0, MOST),
        // Beyond, screw, spring or the preload sensor's scale is another one.
        PRELOAD_RATE "preload rate" | "the same" | "half to twice its parameter" in (0.5, 2.0),
        PRELOAD_RELEASED "preload released" | "backwards until slack" |
            "below 2 N, then idle" in (-MOST, 2.0);
    /// Weights on the preload sensor.
    Weights "weights", Some(|session| reference::run(session, &reference::WEIGHT)) =>
        WEIGHT_DIRECTION "weight direction" | "you hang two weights" |
            "the preload grows" in (0.1, MOST),
        WEIGHTS_AGREE "weights agree" | "the same, and off" |
            "within 2 %, zero as before" in (0.0, 0.02),
        WEIGHT_SCALE "weight scale" | "the same" | "its parameter, within 5 %" in (0.95, 1.05);
    /// Gauges under the compression sensor.
    Compression "compression", Some(|session| reference::run(session, &reference::GAUGE)) =>
        GAUGE_DIRECTION "gauge direction" | "you put in two gauges" |
            "the compression grows" in (0.1, MOST),
        GAUGES_AGREE "gauges agree" | "the same, and out" |
            "within 2 %, zero as before" in (0.0, 0.02),
        GAUGE_SCALE "gauge scale" | "the same" | "its parameter, within 5 %" in (0.95, 1.05);
    Friction "friction", Some(pull::run) =>
        // Between blocked and free.
        PULL_SLIPS "pull slips" | "pressed, 30 % against the stop" |
            "10 to 97 % of its free speed" in (0.1, 0.97),
        // Rubber on metal, from wet to clean.
        FRICTION "friction" | "the same" | "0.3 to 1.6" in (0.3, 1.6);
    /// A deployment at the least speed, by its log.
    Crossing "first crossing", None =>
        FIRST_CROSSING "first crossing" | "`rig bringup --log` of it" |
            "every step at 5 mm/s, no fault, no slip" in (0.0, 0.5);
    Identification "identification", None =>
        IDENTIFIED "identified" | "`rig identify --out` this folder" |
            "tread and friction within intervals";
    Acceptance "acceptance", None =>
        ACCEPTED "accepted" | "`rig accept --out` this folder" | "accepted";
}

impl Stage {
    /// In words.
    pub(crate) fn name(self) -> &'static str {
        GATES[self as usize].name
    }
}

impl Gate {
    /// Whether logs prove it, and not the first power-up itself.
    pub fn is_by_logs(&self) -> bool {
        self.run.is_none()
    }
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
    pub(crate) fn measured(&mut self, key: &str, value: f64, within: f64, by: &str) {
        let digits = (1.0 - within.log10().floor()).clamp(0.0, 4.0) as usize;
        let (low, high) = (value - within, value + within);
        let source = format!("{low:.digits$} to {high:.digits$}, first power-up, by {by}");
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
    for &Gate { stage, name, run, .. } in GATES {
        let Some(run) = run else { continue };
        if progress.is_done(stage) {
            say(&format!("{name}: passed before"));
            continue;
        }
        say(&format!("{name}:"));
        if !matches!(stage, Stage::Board | Stage::Sensors) && !supplied {
            operator.act(Action::SwitchOn)?;
            // Where stages were passed before, the board has just started.
            line.idle()?;
            supplied = true;
        }
        let mut proposed = progress.proposed.clone();
        let session =
            &mut Session { line, operator, expected: &expected, proposed: &mut proposed, say };
        let checks = match run(session) {
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
    use crate::probe::Mute;

    /// What becomes of a stage whose log is silent, while a hand does what it is asked.
    pub(super) fn on_a_silent_log<T>(of: impl FnOnce(&mut Session<'_, '_>) -> T) -> T {
        let expected = Scenario::default();
        of(&mut Session {
            line: &mut Line::new(&mut Mute::new()),
            operator: &mut Stdin::new(&b"\n\n"[..], Vec::new(), true),
            expected: &expected,
            proposed: &mut expected.clone(),
            say: &mut |_| {},
        })
    }

    #[test]
    fn the_manual_has_each_check_with_what_is_done_and_expected() {
        let page = include_str!("../../docs/GETTING_STARTED.md");
        for (Gate { name: stage, .. }, Row { name, does, expected, .. }) in
            GATES.iter().flat_map(|gate| gate.checks.iter().map(move |check| (gate, check)))
        {
            let row = format!("| {stage} | {name} | {does} | {expected} |");
            assert!(page.contains(&row), "{row}");
        }
    }
}
