//! The drive's motor in the service mode: its bridge, its encoder's lines, direction, speed.

use std::ops::ControlFlow;

use interstage::rig::Rig;
use interstage::sense::raw::SensorId;

use super::figures::{Counted, counted, level};
use super::line::{Motion, drive as drive_by, press};
use super::motion::{CHANGED, bridge, driven, fault, speed};
use super::{Action, BringupError, Check, Question, Seen, Session, row};
use crate::table;

/// Input data of port A, with the wheel encoder's lines.
const PORT_A: u32 = 0x4800_0010;
/// Duties of the drive.
const SLOW: f64 = 0.15;
const FAST: f64 = 0.30;
/// Part of the no-load speed by which this measurement may be off: supply and converter by 2 % each,
/// losses that change with the speed by 1 %.
const UNSURE: f64 = 0.05;

/// The drive, wheel free.
pub(super) fn drive(session: &mut Session<'_, '_>) -> Result<Vec<Check>, BringupError> {
    session.operator.act(Action::Block)?;
    // The emergency stop was pressed meanwhile.
    session.line.reset()?;
    session.operator.confirm("Current limit low: the DRIVE turns outwards, 15 % for 0.6 s.")?;
    // Levels that each line of the encoder has had: low, high.
    let mut lines = [[false; 2]; 2];
    let slow = session.line.move_and(drive_by(SLOW), 600, 300, |line| {
        let port = line.word(PORT_A)?;
        for (pin, seen) in lines.iter_mut().enumerate() {
            seen[(port >> pin & 1) as usize] = true;
        }
        Ok(ControlFlow::Continue(()))
    })?;
    let (bridge, silent) = bridge(&slow, 0, SLOW);
    let mut checks = vec![if silent { silent_bridge(session, &slow)? } else { bridge }];
    if !checks[0].ok {
        return Ok(checks);
    }
    let counts = counted(driven(&slow, 0));
    (session.say)(&format!("  {}", table::counted(counts.sum, "count")));
    let turned = session.operator.look(Question::Turned)?;
    let shift = preload_change(&slow, &session.expected.rig)?;
    checks.extend(turns(&slow, counts, shift, lines, turned));
    if checks.iter().any(|check| !check.ok) {
        return Ok(checks);
    }
    session.operator.confirm("The DRIVE turns outwards, 30 % for 0.5 s, and back for 0.8 s.")?;
    let fast = session.line.moved(drive_by(FAST), 500, 300)?;
    session.line.moved(drive_by(-FAST), 800, 300)?;
    let [v_slow, v_fast] = [&slow, &fast].map(|motion| speed(motion, &session.expected.rig));
    let no_load = (v_fast - v_slow) / (FAST - SLOW);
    let wanted = session.expected.rig.drive.no_load_speed_mm_s;
    let friction = SLOW - v_slow / no_load;
    let rounded = (no_load * 10.0).round() / 10.0;
    // What the board has is replaced only where the measurement contradicts it.
    let within = UNSURE * no_load;
    if no_load > 1.0 && (no_load - wanted).abs() > within {
        session.proposed.rig.drive.no_load_speed_mm_s = rounded;
    }
    let proposed = session.proposed.rig.drive.no_load_speed_mm_s;
    if (no_load - proposed).abs() <= within {
        session.measured("drive.no_load_speed_mm_s", no_load, within, "two duties");
    }
    checks.push(row::DRIVE_SPEED.by(
        Some(no_load / wanted),
        format!("{no_load:.1} mm/s at full duty, parameter {wanted:.1}{}", fault(&fast)),
        &format!(
            "the wheel wedges where it touches the wall: hold it off; or the motor, its supply's \
             voltage, sense.encoder_counts or rig.wheel_radius_mm is another: one turn of the wheel \
             by hand must give sense.encoder_counts. If that is right, set \
             drive.no_load_speed_mm_s = {rounded}"
        ),
    ));
    if checks.iter().all(|check| check.ok) {
        checks.push(row::DRIVE_FRICTION.by(
            Some(friction),
            format!("{:.1} % of duty", 100.0 * friction),
            "the drive is stiff: gearbox, bearing, or the wheel drags on the wall",
        ));
    }
    Ok(checks)
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
    Ok(row::DRIVE_BRIDGE.check(false, format!("0 %{}", fault(slow)), advice))
}

/// Change of the preload by a motion, N.
fn preload_change(motion: &Motion, rig: &Rig) -> Result<f64, BringupError> {
    let (sensor, rows) = (SensorId::PreloadSensor, &motion.rows);
    Ok(level(sensor, rig, rows.iter().rev().take(100))? - level(sensor, rig, rows.iter().take(15))?)
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
    let shown =
        table::counted(counts.sum, "count") + &format!(", seen to turn: {eye}{}", fault(motion));
    if row::DRIVE_TURNS.has(counts.sum as f64) {
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
            row::DRIVE_TURNS.check(true, shown, ""),
            row::DRIVE_DIRECTION.check(seen == Seen::Outwards, eye.to_owned(), advice),
        ];
    }
    let was_seen = matches!(seen, Seen::Outwards | Seen::Inwards);
    let exchanged = format!(
        "the motors are exchanged: the drive's bridge moves the pre-tightener (preload \
         {preload_change:+.1} N)"
    );
    let advice = if row::DRIVE_TURNS.has(-counts.sum as f64) {
        match seen {
            Seen::Outwards => "the encoder's lines A and B are swapped",
            Seen::Inwards => "the drive motor's leads are swapped",
            _ => {
                "A and B of the encoder are swapped, or the drive motor's leads: if the wheel \
                 turns outwards, swap A (PA0) and B (PA1); if inwards, the motor's leads"
            }
        }
    } else if preload_change.abs() > CHANGED.0 && !was_seen {
        &exchanged
    } else if counts.changes > 5 {
        match lines.map(|levels| levels == [true; 2]) {
            [false, true] => "the encoder's line A (PA0) is missing: its level never changes",
            [true, false] => "the encoder's line B (PA1) is missing: its level never changes",
            _ => {
                "the encoder's line A or B is missing: measure PA0 and PA1 while the wheel turns; \
                 the one that does not change"
            }
        }
    } else if was_seen {
        "the wheel encoder is not connected: neither line changes although the wheel turns"
    } else {
        "the wheel is blocked, or the drive motor's leads are open: turn the motor by its crank; if \
         it is free, measure the motor's resistance at the bridge"
    };
    vec![row::DRIVE_TURNS.check(false, shown, advice)]
}
