//! The pre-tightener's motor in the service mode: its bridge, direction, sensors, scale.

use interstage::log::Record;
use interstage::rig::Rig;
use interstage::sense::raw::SensorId;
use interstage::supervise::Mode;

use super::figures::{angle, counted, level, mean, turned};
use super::line::{Motion, press};
use super::motion::{CHANGED, bridge, driven, fault};
use super::{Action, BringupError, Check, Session, row};

/// Duty of the pre-tightener, and the steps of preload, ms.
const PRESS: f64 = 0.25;
const STEPS_MS: [u32; 3] = [550, 850, 550];
/// Rest behind a step, ms; the tread's memory is a tenth of a second. Its second half is judged.
pub(super) const REST_MS: u32 = 500;

/// Means at rest.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Level {
    pub(super) preload: f64,
    pub(super) compression: f64,
    angle: Option<f64>,
}

impl Level {
    /// Of the last of these rows.
    pub(super) fn of(rows: &[Record], rig: &Rig) -> Result<Self, BringupError> {
        let last = || rows.iter().rev().take(REST_MS as usize / 2);
        let mean_from = |first| {
            Some(first + mean(last().filter_map(angle).map(|angle| turned(first, angle)))?.0)
        };
        Ok(Self {
            preload: level(SensorId::PreloadSensor, rig, last())?,
            compression: level(SensorId::CompressionSensor, rig, last())?,
            angle: last().find_map(angle).and_then(mean_from),
        })
    }

    pub(super) fn since(self, before: Self) -> Self {
        Self {
            preload: self.preload - before.preload,
            compression: self.compression - before.compression,
            angle: before.angle.zip(self.angle).map(|(before, now)| turned(before, now)),
        }
    }

    fn is_none(self) -> bool {
        self.preload.abs() < CHANGED.0 && self.compression.abs() < CHANGED.1
    }

    fn text(self) -> String {
        let Self { preload, compression, angle } = self;
        let angle =
            angle.map_or_else(|| "unknown".to_owned(), |codes| format!("{codes:+.1} codes"));
        format!("preload {preload:+.2} N, compression {compression:+.4} mm, angle {angle}")
    }
}

/// The pre-tightener: direction, sensors, scale; and back.
pub(super) fn pretightener(session: &mut Session<'_, '_>) -> Result<Vec<Check>, BringupError> {
    session.operator.act(Action::SetDown)?;
    // The emergency stop was pressed meanwhile; the bounds and zeros are those of this rest.
    session.line.reset()?;
    session.operator.confirm("The PRE-TIGHTENER presses the wheel, 25 % for 0.55 s.")?;
    let rig = &session.expected.rig;
    let base = Level::of(&session.line.listen(REST_MS)?, rig)?;
    let first = session.line.moved(press(PRESS), STEPS_MS[0], REST_MS)?;
    let mut checks = vec![bridge(&first, 1, PRESS).0];
    if !checks[0].ok {
        return Ok(checks);
    }
    let change = Level::of(&first.rows, rig)?.since(base);
    (session.say)(&format!("  {}", change.text()));
    checks.push(rises(session, &first, change, base)?);
    if checks.iter().any(|check| !check.ok) {
        release(session, base, STEPS_MS[0])?;
        return Ok(checks);
    }
    session.operator.confirm("The PRE-TIGHTENER presses on, to about 12 N.")?;
    let mut levels = vec![(driven(&first, 1).len() as f64 * 1e-3, change)];
    for milliseconds in &STEPS_MS[1..] {
        let motion = session.line.moved(press(PRESS), *milliseconds, REST_MS)?;
        let level = Level::of(&motion.rows, rig)?.since(base);
        (session.say)(&format!("  {}", level.text()));
        levels.push((driven(&motion, 1).len() as f64 * 1e-3, level));
    }
    checks.extend(judge(session, &levels));
    let (left, mode) = release(session, base, STEPS_MS.iter().sum())?;
    let released = (mode == Some(Mode::Idle)).then_some(left.preload);
    let advice = "the preload does not come off: turn the pre-tightener back by hand";
    checks.push(row::PRELOAD_RELEASED.by(released, left.text(), advice));
    Ok(checks)
}

/// What the first step of preload has done.
fn rises(
    session: &mut Session<'_, '_>,
    first: &Motion,
    change: Level,
    base: Level,
) -> Result<Check, BringupError> {
    let up = |value: f64, least: f64| if value.abs() < least { 0.0 } else { value.signum() };
    let preload = up(change.preload, CHANGED.0);
    let compression = up(change.compression, CHANGED.1);
    let shown = change.text() + &fault(first);
    let advice = match (preload as i32, compression as i32) {
        (1, 1) if first.mode == Mode::Service => {
            return Ok(row::PRELOAD_RISES.check(true, shown, ""));
        }
        (1, 1) => "the motion ended in a fault",
        (-1, 1) => "the preload sensor's bridge is reversed: swap its two signal leads",
        (1, -1) => {
            "the compression sensor is reversed: swap its signal leads, or its sense at the \
             amplifier"
        }
        (0, 1) => {
            "the preload sensor shows nothing of a preload that compresses the tread: where it is \
             mounted, its amplifier"
        }
        (1, 0) => {
            "the compression sensor shows nothing of a preload that the other sensor shows: where \
             it is mounted, its amplifier"
        }
        (-1, -1) => "the pre-tightener's leads are swapped: preload and compression fall",
        _ if counted(driven(first, 1)).range > 20 => {
            "the motors are exchanged: the pre-tightener's bridge turns the wheel"
        }
        _ => {
            session.operator.confirm("Nothing moved: the PRE-TIGHTENER turns back for 1.2 s.")?;
            let back = session.line.moved(press(-PRESS), 1200, REST_MS)?;
            let change = Level::of(&back.rows, &session.expected.rig)?.since(base);
            let swapped = format!(
                "the pre-tightener's leads are swapped: backwards it presses ({})",
                change.text()
            );
            let advice = if change.is_none() {
                "the pre-tightener does not move, or the wheel is clear of the wall: its motor's \
                 leads; turn the screw by hand until the wheel touches"
            } else {
                &swapped
            };
            return Ok(row::PRELOAD_RISES.check(false, shown, advice));
        }
    };
    Ok(row::PRELOAD_RISES.check(false, shown, advice))
}

/// The three steps together: each time of duty, s, and the level it led to.
fn judge(session: &mut Session<'_, '_>, levels: &[(f64, Level)]) -> Vec<Check> {
    let rig = &session.expected.rig;
    let [(t_1, first), (t_2, second), (t_3, last)] = levels else { return Vec::new() };
    let inwards = last.angle.is_some_and(|angle| angle < 0.0);
    let advice = if inwards {
        "the arm's codes grow inwards: put the chip at the pivot's other end, then measure \
         sense.angle_zero_code"
    } else {
        "the arm's code does not follow the tread's compression: the magnet turns with the arm, \
         and the sensor does not?"
    };
    let mut checks = vec![row::ARM_DIRECTION.by(last.angle, last.text(), advice)];
    // Two durations give rate and dead time, P = slew u (T - D); the outer steps are alike.
    let (short, long) =
        (last.preload - second.preload + first.preload, second.preload - first.preload);
    let (short, t_short) = (short / 2.0, (t_1 + t_3) / 2.0);
    let slew = (long - short) / (PRESS * (t_2 - t_short));
    let dead_s = t_short - short / (PRESS * slew);
    let by_spring = slew / rig.preload.slew_n_per_s;
    let rounded = (slew * 10.0).round() / 10.0;
    if row::PRELOAD_RATE.has(by_spring) {
        session.proposed.rig.preload.slew_n_per_s = rounded;
        // The outer steps differ by what does not repeat.
        let repeats = (last.preload - second.preload - first.preload).abs();
        let within = 0.1 + repeats / (PRESS * (t_2 - t_short));
        session.measured("preload.slew_n_per_s", rounded, within, "three steps");
    }
    let shown = format!(
        "{slew:.1} N/s at full duty ({by_spring:.2} of the parameter), dead time and lag {dead_s:.3} s"
    );
    let advice = format!(
        "the pre-tightener is of another speed or spring, or the preload sensor of another scale: \
         press it by a known force. If it shows that, set preload.slew_n_per_s = {rounded}"
    );
    checks.push(row::PRELOAD_RATE.by(Some(by_spring), shown, &advice));
    checks
}

/// Takes the preload back, and leaves the service mode; what is left, and the mode.
pub(super) fn release(
    session: &mut Session<'_, '_>,
    base: Level,
    raised_ms: u32,
) -> Result<(Level, Option<Mode>), BringupError> {
    if session.line.mode()? != Some(Mode::Service) && session.line.reset()? != Some(Mode::Idle) {
        return Ok((base, None));
    }
    let (mut left, mut is_slack) = (Level::default(), false);
    let mut spent = 0;
    // As long as it was raised, and some more: dead times add up.
    while spent < raised_ms + 1500 {
        let motion = session.line.moved(press(-PRESS), 400, REST_MS)?;
        left = Level::of(&motion.rows, &session.expected.rig)?.since(base);
        spent += 400;
        // Once more: the sensor shows less than this of what presses.
        if is_slack || motion.mode != Mode::Service {
            break;
        }
        is_slack = left.is_none();
    }
    Ok((left, session.line.reset()?))
}
