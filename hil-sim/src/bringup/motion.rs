//! Motors in the service mode: bridges, directions, speeds, preload.

use interstage::log::Record;
use interstage::supervise::Mode;

use super::figures::{Counted, Scale, angle, counted, mean, output, preload_n, turned};
use super::line::{Motion, drive as drive_by, press};
use super::{BringupError, Check, Question, Seen, Session, check};

/// Input data of port A, with the wheel encoder's lines.
const PORT_A: u32 = 0x4800_0010;
/// Duties of the drive.
const SLOW: f64 = 0.15;
const FAST: f64 = 0.30;
/// Duty of the pre-tightener, and the steps of preload, ms.
const PRESS: f64 = 0.25;
const STEPS_MS: [u32; 3] = [550, 850, 550];
/// Rest behind a step, ms; the tread's memory is a tenth of a second. Its second half is judged.
const REST_MS: u32 = 500;
/// Changes that count as one: preload, N, and compression, mm. A tread that was rolled creeps by
/// less for a second.
const CHANGED: (f64, f64) = (0.7, 0.025);

/// The drive, wheel free.
pub(super) fn drive(session: &mut Session<'_, '_>) -> Result<Vec<Check>, BringupError> {
    session.operator.confirm(
        "Wheel free of the wall, current limit low: the DRIVE turns outwards, 15 % for 0.6 s.",
    )?;
    // Levels that each line of the encoder has had: low, high.
    let mut lines = [[false; 2]; 2];
    let slow = session.line.move_and(drive_by(SLOW), 600, 300, |line| {
        let port = line.word(PORT_A)?;
        for (pin, seen) in lines.iter_mut().enumerate() {
            seen[(port >> pin & 1) as usize] = true;
        }
        Ok(())
    })?;
    let (bridge, silent) = bridge(&slow, 0, SLOW);
    let mut checks = vec![bridge];
    if silent {
        checks = vec![silent_bridge(session, &slow)?];
    }
    if !checks[0].ok {
        return Ok(checks);
    }
    let counts = counted(driven(&slow, 0));
    (session.say)(&format!("  {} counts", counts.sum));
    let turned = session.operator.look(Question::Turned)?;
    let shift = preload_change(&slow, &Scale::of(&session.expected.rig));
    checks.extend(turns(&slow, counts, shift, lines, turned));
    if checks.iter().any(|check| !check.ok) {
        return Ok(checks);
    }
    session.operator.confirm("The DRIVE turns outwards, 30 % for 0.5 s, and back for 0.8 s.")?;
    let fast = session.line.moved(drive_by(FAST), 500, 300)?;
    session.line.moved(drive_by(-FAST), 800, 300)?;
    let scale = Scale::of(&session.expected.rig);
    let speed = |motion: &Motion| {
        let rows = driven(motion, 0);
        let steady = &rows[rows.len() / 2..];
        let seconds = steady.len().saturating_sub(1).max(1) as f64 * 1e-3;
        counted(steady).sum as f64 * scale.count_mm / seconds
    };
    let (v_slow, v_fast) = (speed(&slow), speed(&fast));
    let no_load = (v_fast - v_slow) / (FAST - SLOW);
    let wanted = session.expected.rig.drive.no_load_speed_mm_s;
    let near = (no_load / wanted - 1.0).abs() <= 0.25;
    let friction = SLOW - v_slow / no_load;
    let rounded = (no_load * 10.0).round() / 10.0;
    if no_load > 1.0 {
        session.proposed.rig.drive.no_load_speed_mm_s = rounded;
    }
    checks.push(check(
        "drive speed",
        near,
        format!("{no_load:.1} mm/s at full duty, parameter {wanted:.1}"),
        &format!(
            "the motor, its supply's voltage, sense.encoder_counts or rig.wheel_radius_mm is \
             another: one turn of the wheel by hand must give sense.encoder_counts. If that is \
             right, set drive.no_load_speed_mm_s = {rounded}"
        ),
    ));
    if near {
        checks.push(check(
            "drive friction",
            friction < 0.08,
            format!("{:.1} % of duty", 100.0 * friction),
            "the drive is stiff: gearbox, bearing, or the wheel drags on the wall",
        ));
    }
    Ok(checks)
}

/// Rows in which a bridge was given a duty.
fn driven(motion: &Motion, bridge: usize) -> &[Record] {
    let given = |row: &Record| {
        let duties = [row.telemetry.drive, row.telemetry.pretightener];
        duties[bridge].to_bits() != 0
    };
    let first = motion.rows.iter().position(given).unwrap_or(0);
    let last = motion.rows.iter().rposition(given).map_or(first, |last| last + 1);
    &motion.rows[first..last]
}

/// The fault that ended a motion, in words.
fn fault(motion: &Motion) -> String {
    match motion.mode {
        Mode::FaultHold(fault) => format!("; fault {}: {}", fault.code(), fault.sentence()),
        _ => String::new(),
    }
}

/// What a bridge and the other one put out under a duty; and whether neither put out anything.
fn bridge(motion: &Motion, which: usize, duty: f64) -> (Check, bool) {
    let rows = driven(motion, which);
    let first = motion.rows.iter().position(|row| rows.first() == Some(row)).unwrap_or(0);
    // A fault ends it after some milliseconds: the largest output of those tells.
    let end = (first + rows.len() + 2).min(motion.rows.len());
    let largest = |bridge: usize| {
        let outputs = motion.rows[first..end].iter().map(|row| output(row.bridges[bridge]));
        outputs.fold(0.0, |most: f64, now| if now.abs() > most.abs() { now } else { most })
    };
    let (own, other) = (largest(which), largest(1 - which));
    let name = ["drive bridge", "pre-tightener bridge"][which];
    let (motor, pin) = [("drive", "PB0"), ("pre-tightener", "PB1")][which];
    let silent = own.abs() < 0.3 * duty && other.abs() < 0.3 * duty;
    let advice = if other > 0.5 * duty && own.abs() < 0.5 * duty {
        "the readbacks are exchanged with each other: the drive's belongs to PB0, the \
         pre-tightener's to PB1"
            .to_owned()
    } else if own < -0.5 * duty {
        format!(
            "the two inputs of the {motor}'s readback are swapped (or the bridge's direction line \
             is inverted: its pin is high for forward)"
        )
    } else {
        format!(
            "the {motor}'s bridge gives another voltage than its duty, or the divider at {pin} is wrong"
        )
    };
    let good = motion.mode == Mode::Service && (own - duty).abs() < 0.05 && other.abs() < 0.05;
    let other_fault = matches!(motion.mode, Mode::FaultHold(f) if !matches!(f.code(), 128 | 129));
    let shown = format!("{:.0} %, the other {:.0} %{}", 100.0 * own, 100.0 * other, fault(motion));
    let sound = good || other_fault && (own - duty).abs() < 0.05;
    (check(name, sound, shown, &advice), silent && !rows.is_empty())
}

/// The drive's bridge puts out nothing: the other one tells whether the supply is off.
fn silent_bridge(session: &mut Session<'_, '_>, slow: &Motion) -> Result<Check, BringupError> {
    session
        .operator
        .confirm("The PRE-TIGHTENER turns for 0.1 s: does its bridge put out anything?")?;
    session.line.reset()?;
    let other = session.line.moved(press(SLOW), 100, 100)?;
    let (_, silent) = bridge(&other, 1, SLOW);
    let advice = if silent {
        "the motor supply is off: neither bridge puts out anything. Check supply, fuse and the \
         emergency stop's second contact"
    } else {
        "the drive's bridge puts out nothing, the other does: its enable (PA10) and PWM (PA8), its \
         supply pins"
    };
    Ok(check("drive bridge", false, format!("0 %{}", fault(slow)), advice))
}

/// Change of the preload by a motion, N.
fn preload_change(motion: &Motion, scale: &Scale) -> f64 {
    let rows = &motion.rows;
    let before = mean(rows.iter().take(15).map(|row| scale.preload(row))).0;
    mean(rows.iter().rev().take(100).map(|row| scale.preload(row))).0 - before
}

/// What the encoder, an eye and the other sensors make of the first motion of the drive.
fn turns(
    motion: &Motion,
    counts: Counted,
    preload_change: f64,
    lines: [[bool; 2]; 2],
    seen: Seen,
) -> Vec<Check> {
    let eye = match seen {
        Seen::Outwards => "outwards",
        Seen::Inwards => "inwards",
        Seen::Nothing => "not",
        _ => "not observed",
    };
    let shown = format!("{} counts, seen to turn: {eye}{}", counts.sum, fault(motion));
    if counts.sum > 20 {
        let advice = match seen {
            Seen::Inwards => {
                "both the encoder's lines and the drive motor's leads are swapped: swap A and B, \
                 and the motor's leads"
            }
            Seen::Nothing => "the encoder counts although the wheel does not turn: its coupling",
            _ => {
                "nobody looked: with both encoder lines and motor leads swapped the unit would \
                  run the wrong way, and no sensor shows it here. Run again and look"
            }
        };
        return vec![
            check("drive turns", true, shown, ""),
            check("drive direction", seen == Seen::Outwards, eye.to_owned(), advice),
        ];
    }
    let advice = if counts.sum < -20 {
        match seen {
            Seen::Outwards => "the encoder's lines A and B are swapped".to_owned(),
            Seen::Inwards => "the drive motor's leads are swapped".to_owned(),
            _ => "A and B of the encoder are swapped, or the drive motor's leads: if the wheel \
                  turns outwards, swap A (PA0) and B (PA1); if inwards, the motor's leads"
                .to_owned(),
        }
    } else if preload_change.abs() > CHANGED.0 && !matches!(seen, Seen::Outwards | Seen::Inwards) {
        format!(
            "the motors are exchanged: the drive's bridge moves the pre-tightener (preload \
             {preload_change:+.1} N)"
        )
    } else if counts.changes > 5 {
        let stuck: Vec<&str> = ["A (PA0)", "B (PA1)"]
            .into_iter()
            .zip(lines)
            .filter(|(_, seen)| *seen != [true; 2])
            .map(|(name, _)| name)
            .collect();
        match stuck[..] {
            [line] => format!("the encoder's line {line} is missing: its level never changes"),
            _ => "the encoder's line A or B is missing: measure PA0 and PA1 while the wheel is \
                  turned by hand; the one that does not change"
                .to_owned(),
        }
    } else {
        match seen {
            Seen::Outwards | Seen::Inwards => {
                "the wheel encoder is not connected: neither line changes although the wheel turns"
                    .to_owned()
            }
            _ => "the wheel is blocked, or the drive motor's leads are open: turn the wheel by \
                  hand; if it is free, measure the motor's resistance at the bridge"
                .to_owned(),
        }
    };
    vec![check("drive turns", false, shown, &advice)]
}

/// Means at rest.
#[derive(Clone, Copy, Debug, Default)]
struct Level {
    preload: f64,
    compression: f64,
    /// Compression from the zero that the controller has taken.
    pressed: f64,
    angle: f64,
}

impl Level {
    fn of(rows: &[Record], scale: &Scale) -> Self {
        let last = || rows.iter().rev().take(REST_MS as usize / 2);
        let first = last().next().map_or(0.0, angle);
        Self {
            preload: mean(last().map(|row| scale.preload(row))).0,
            compression: mean(last().map(|row| scale.compression(row))).0,
            pressed: mean(last().map(|row| row.telemetry.compression.to_num())).0,
            angle: first + mean(last().map(|row| turned(first, angle(row)))).0,
        }
    }

    fn since(self, before: Self) -> Self {
        Self {
            preload: self.preload - before.preload,
            compression: self.compression - before.compression,
            pressed: self.pressed,
            angle: turned(before.angle, self.angle),
        }
    }

    fn is_none(self) -> bool {
        self.preload.abs() < CHANGED.0 && self.compression.abs() < CHANGED.1
    }

    fn text(self) -> String {
        let Self { preload, compression, angle, .. } = self;
        format!(
            "preload {preload:+.2} N, compression {compression:+.4} mm, angle {angle:+.1} codes"
        )
    }
}

/// The pre-tightener: direction, sensors, scale; and back.
pub(super) fn pretightener(session: &mut Session<'_, '_>) -> Result<Vec<Check>, BringupError> {
    session.operator.confirm(
        "Wheel on the wall at the stow end: the PRE-TIGHTENER presses it, 25 % for 0.55 s.",
    )?;
    let scale = Scale::of(&session.expected.rig);
    let base = Level::of(&session.line.listen(REST_MS)?, &scale);
    let first = session.line.moved(press(PRESS), STEPS_MS[0], REST_MS)?;
    let mut checks = vec![bridge(&first, 1, PRESS).0];
    if !checks[0].ok {
        return Ok(checks);
    }
    let change = Level::of(&first.rows, &scale).since(base);
    (session.say)(&format!("  {}", change.text()));
    let rises = rises(session, &first, change, base, &scale)?;
    let good = rises.ok;
    checks.push(rises);
    if !good {
        release(session, base, &scale, STEPS_MS[0])?;
        return Ok(checks);
    }
    session.operator.confirm("The PRE-TIGHTENER presses on, to about 12 N.")?;
    let mut levels = vec![(driven(&first, 1).len() as f64 * 1e-3, change)];
    for milliseconds in &STEPS_MS[1..] {
        let motion = session.line.moved(press(PRESS), *milliseconds, REST_MS)?;
        let level = Level::of(&motion.rows, &scale).since(base);
        (session.say)(&format!("  {}", level.text()));
        levels.push((driven(&motion, 1).len() as f64 * 1e-3, level));
    }
    checks.extend(judge(session, &levels));
    let (left, mode) = release(session, base, &scale, STEPS_MS.iter().sum())?;
    let (measured, good) = (left.text(), left.preload < 2.0 && mode == Some(Mode::Idle));
    let advice = "the preload does not come off: turn the pre-tightener back by hand";
    checks.push(check("preload released", good, measured, advice));
    Ok(checks)
}

/// What the first step of preload has done.
fn rises(
    session: &mut Session<'_, '_>,
    first: &Motion,
    change: Level,
    base: Level,
    scale: &Scale,
) -> Result<Check, BringupError> {
    let up = |value: f64, least: f64| if value.abs() < least { 0.0 } else { value.signum() };
    let preload = up(change.preload, CHANGED.0);
    let compression = up(change.compression, CHANGED.1);
    let shown = change.text() + &fault(first);
    let advice = match (preload as i32, compression as i32) {
        (1, 1) if first.mode == Mode::Service => {
            return Ok(check("preload rises", true, shown, ""));
        }
        (1, 1) => "the motion ended in a fault".to_owned(),
        (-1, 1) => "the preload sensor's bridge is reversed: swap its two signal leads".to_owned(),
        (1, -1) => {
            "the compression sensor is reversed: swap its signal leads, or its sense at the \
                    amplifier"
                .to_owned()
        }
        (0, 1) => {
            "the preload sensor shows nothing of a preload that compresses the tread: where it \
                   is mounted, its amplifier"
                .to_owned()
        }
        (1, 0) => "the compression sensor shows nothing of a preload that the other sensor shows: \
                   where it is mounted, its amplifier"
            .to_owned(),
        (-1, -1) => {
            "the pre-tightener's leads are swapped: preload and compression fall".to_owned()
        }
        _ if counted(driven(first, 1)).range > 20 => {
            "the motors are exchanged: the pre-tightener's bridge turns the wheel".to_owned()
        }
        _ => {
            session.operator.confirm("Nothing moved: the PRE-TIGHTENER turns back for 1.2 s.")?;
            let back = session.line.moved(press(-PRESS), 1200, REST_MS)?;
            let change = Level::of(&back.rows, scale).since(base);
            if change.is_none() {
                "the pre-tightener does not move, or the wheel is clear of the wall: its motor's \
                 leads; turn the screw by hand until the wheel touches"
                    .to_owned()
            } else {
                format!(
                    "the pre-tightener's leads are swapped: backwards it presses ({})",
                    change.text()
                )
            }
        }
    };
    Ok(check("preload rises", false, shown, &advice))
}

/// The three steps together: each time of duty, s, and the level it led to.
fn judge(session: &mut Session<'_, '_>, levels: &[(f64, Level)]) -> Vec<Check> {
    let rig = &session.expected.rig;
    let [(t_1, first), (t_2, second), (t_3, last)] = levels else { return Vec::new() };
    let power = (last.compression / first.compression).ln() / (last.preload / first.preload).ln();
    let exchanged = power.is_nan() || power >= 1.0;
    let mut checks = vec![check(
        "preload against tread",
        !exchanged,
        format!("compression grows as preload^{power:.2}"),
        "preload and compression sensor are exchanged: a tread grows stiffer under load (0.67), \
         these show it the other way round. Swap PC2 and PC3",
    )];
    if exchanged {
        return checks;
    }
    let inwards = last.angle < 0.0;
    let advice = if inwards {
        "the arm's codes grow inwards: turn the magnet over, then measure sense.angle_zero_code"
    } else {
        "the arm's code does not follow the tread's compression: the magnet turns with the arm, \
         and the sensor does not?"
    };
    checks.push(check("arm direction", last.angle > 1.0, last.text(), advice));
    // Two durations give rate and dead time, P = slew u (T - D); the outer steps are alike.
    let (short, long) =
        (last.preload - second.preload + first.preload, second.preload - first.preload);
    let (short, t_short) = (short / 2.0, (t_1 + t_3) / 2.0);
    let slew = (long - short) / (PRESS * (t_2 - t_short));
    let dead_s = t_short - short / (PRESS * slew);
    let by_spring = slew / rig.preload.slew_n_per_s;
    // Differences: the arm's thrust presses the wheel as well.
    let carried = preload_n(rig, last.pressed) - preload_n(rig, first.pressed);
    let by_tread = (last.preload - first.preload) / carried;
    let off = |ratio: f64| !(0.8..=1.25).contains(&ratio);
    let rounded = (slew * 10.0).round() / 10.0;
    let advice = if off(by_spring) && off(by_tread) && (by_spring > 1.0) == (by_tread > 1.0) {
        format!(
            "the preload sensor's scale is wrong by {:.2}, or spring and tread both are: hang a \
             known weight on it and set sense.preload_full_scale_n = {:.0}",
            (by_spring * by_tread).sqrt(),
            rig.sense.preload_full_scale_n / (by_spring * by_tread).sqrt(),
        )
    } else if off(by_tread) {
        "the compression sensor's scale is wrong, or the tread is another: press it by a feeler \
         gauge; `rig identify` finds the tread"
            .to_owned()
    } else {
        format!(
            "the pre-tightener is of another speed or spring: set preload.slew_n_per_s = {rounded}"
        )
    };
    if !off(by_spring) {
        session.proposed.rig.preload.slew_n_per_s = rounded;
    }
    checks.push(check(
        "preload scale",
        !off(by_spring) && !off(by_tread),
        format!(
            "{slew:.1} N/s at full duty ({by_spring:.2} of the parameter), {by_tread:.2} of the \
             tread's stiffness, dead time and lag {dead_s:.3} s"
        ),
        &advice,
    ));
    checks
}

/// Takes the preload back, and leaves the service mode; what is left, and the mode.
fn release(
    session: &mut Session<'_, '_>,
    base: Level,
    scale: &Scale,
    raised_ms: u32,
) -> Result<(Level, Option<Mode>), BringupError> {
    if session.line.mode()? != Some(Mode::Service) && session.line.reset()? != Some(Mode::Idle) {
        return Ok((base, None));
    }
    let mut left = Level::default();
    let mut spent = 0;
    // As long as it was raised, and some more: dead times add up.
    while spent < raised_ms + 1500 {
        let motion = session.line.moved(press(-PRESS), 400, REST_MS)?;
        left = Level::of(&motion.rows, scale).since(base);
        spent += 400;
        if left.is_none() || motion.mode != Mode::Service {
            break;
        }
    }
    Ok((left, session.line.reset()?))
}
