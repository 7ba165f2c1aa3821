//! What can be judged at rest: the board, and its sensors.

use interstage::log::{Flags, Record};
use interstage::sense::analog::{BROKEN_ABOVE, BROKEN_BELOW};
use interstage::sense::raw::AngleFrame;
use interstage::supervise::Mode;

use super::figures::{Scale, TURN, angle, counted, mean, output, part, stowed, turned};
use super::{Action, BringupError, Check, Sensor, Session, check};
use crate::table;

/// `FLASH_OPTR` with its bit `DBANK`. Source: RM0440, 3.7.8.
const OPTIONS: (u32, u32) = (0x4002_2020, 1 << 22);
/// Input data of port B, with the emergency stop's pins.
const PORT_B: u32 = 0x4800_0410;
const STOP_PINS: [(&str, u32); 2] = [("PB12", 12), ("PB7", 7)];
/// Rows that are judged.
const ROWS: u32 = 500;
/// Rows after a sensor is unplugged; the later half is judged.
const LEAD_ROWS: u32 = 100;
/// Codes by which the angle's zero may be off: 1.5 mm of the wheel's place.
const ZERO_CODES: f64 = 40.0;
/// Coded age of a sensor without a reading.
const NEVER: u8 = 255;

/// The board alone.
pub(super) fn board(session: &mut Session<'_, '_>) -> Result<Vec<Check>, BringupError> {
    let options = session.line.word(OPTIONS.0)?;
    let two = options & OPTIONS.1 != 0;
    let mut checks = vec![check(
        "option bytes",
        two,
        format!("FLASH_OPTR {options:#010x}"),
        "the flash is set up as one bank, and the firmware stays off: `STM32_Programmer_CLI -c \
         port=SWD -ob DBANK=1`, then `cargo rig flash`",
    )];
    if !two {
        return Ok(checks);
    }
    let rows = session.line.listen(ROWS)?;
    checks.push(check(
        "firmware",
        rows.len() >= ROWS as usize,
        table::counted(rows.len(), "tick"),
        "the firmware does not run: `cargo rig flash`; its text log names the reason",
    ));
    if rows.len() < ROWS as usize {
        return Ok(checks);
    }
    checks.push(contact(session.line.word(PORT_B)?));
    checks.push(readback(&rows));
    Ok(checks)
}

fn contact(port: u32) -> Check {
    let high = STOP_PINS.iter().filter(|(_, pin)| port >> pin & 1 != 0);
    let high: Vec<&str> = high.map(|(name, _)| *name).collect();
    let measured = match &high[..] {
        [] => "PB12 and PB7 low".to_owned(),
        names => format!("{} high", names.join(" and ")),
    };
    check(
        "stop contact",
        high.is_empty(),
        measured,
        "the emergency stop's contact is open: release it; join PB12 and PB7 and connect them to \
         ground through the opening contact. Without it the motors never turn",
    )
}

fn readback(rows: &[Record]) -> Check {
    let read = rows.iter().filter(|row| row.flags.has(Flags::READBACK)).count();
    let [drive, preload] =
        [0, 1].map(|bridge| mean(rows.iter().map(|row| output(row.bridges[bridge]))).0);
    let off = |value: f64| value.abs() > 0.03;
    let name = match (off(drive), off(preload)) {
        (true, false) => "the drive's readback (PB0)",
        (false, true) => "the pre-tightener's readback (PB1)",
        _ => "both readbacks (PB0, PB1)",
    };
    let lowest = drive.min(preload);
    let why = if read == 0 {
        "nothing is converted: the analogue supply of the board".to_owned()
    } else if lowest < -1.0 {
        format!("{name}: 0 V at rest. The reference of 1.65 V is missing at the amplifier")
    } else {
        format!("{name}: not 1.65 V at rest. Check the amplifier's resistors and its reference")
    };
    check(
        "readback at rest",
        read > 0 && !off(drive) && !off(preload),
        format!("drive {:.1} %, pre-tightener {:.1} %", 100.0 * drive, 100.0 * preload),
        &why,
    )
}

/// The sensors, each by itself; then their leads, and the controller's own test.
pub(super) fn sensors(session: &mut Session<'_, '_>) -> Result<Vec<Check>, BringupError> {
    let rig = &session.expected.rig;
    let scale = Scale::of(rig);
    let rows = session.line.listen(ROWS)?;
    let counts = counted(&rows);
    let mut checks = vec![check(
        "encoder at rest",
        counts.range <= 2,
        table::counted(counts.range, "count"),
        "the wheel turns, or its lines pick up noise: hold it still, look at the shields",
    )];
    let preload = mean(rows.iter().map(|row| scale.preload(row)));
    checks.extend(analogue(("preload", "PC2"), &rows, 1, preload, (3.0, 0.2), "N"));
    let compression = mean(rows.iter().map(|row| scale.compression(row)));
    checks.extend(analogue(("compression", "PC3"), &rows, 2, compression, (0.1, 0.008), "mm"));
    checks.extend(arm(session, &rows));
    if checks.iter().any(|check| !check.ok) {
        return Ok(checks);
    }
    for (sensor, place, name) in
        [(Sensor::Preload, 1, "preload lead"), (Sensor::Compression, 2, "compression lead")]
    {
        checks.push(lead(session, sensor, place, name)?);
        if checks.iter().any(|check| !check.ok) {
            session.line.reset()?;
            return Ok(checks);
        }
    }
    let mode = session.line.reset()?;
    let measured = match mode {
        Some(Mode::FaultHold(fault)) => format!("fault {}: {}", fault.code(), fault.sentence()),
        Some(mode) => format!("{mode:?}"),
        None => "no log".to_owned(),
    };
    let advice = "the controller does not come to idle although each sensor reads well: bring the \
                  wheel to the stow end, unloaded and at rest";
    checks.push(check("self-test", mode == Some(Mode::Idle), measured, advice));
    Ok(checks)
}

/// Range and noise of an analogue sensor.
fn analogue(
    (name, pin): (&str, &str),
    rows: &[Record],
    place: usize,
    (value, noise): (f64, f64),
    (most, most_noise): (f64, f64),
    unit: &str,
) -> Vec<Check> {
    let (code, _) = mean(rows.iter().map(|row| part(row.codes[place])));
    let silent = rows.iter().all(|row| row.ages[place] == NEVER);
    let advice = if silent {
        format!("the converter gives nothing for the {name} sensor")
    } else if code < BROKEN_BELOW {
        format!("the {name} sensor is open: its lead to {pin}, its supply, its amplifier")
    } else if code > BROKEN_ABOVE {
        format!("the {name} sensor is at the converter's end: {pin} shorted to 3.3 V, or overload")
    } else {
        format!(
            "the {name} sensor is not at its zero, 5 % of the converter: unload it; trim the \
             amplifier's zero"
        )
    };
    let good = !silent && value.abs() < most;
    let shown = format!("{:.1} % of the converter, {value:.3} {unit}", 100.0 * code);
    let mut checks = vec![check(&format!("{name} sensor"), good, shown, &advice)];
    if good {
        let advice = format!(
            "the {name} sensor's noise is too high: shield and ground of its lead, the 10 nF at \
             {pin}, the amplifier's supply"
        );
        let shown = format!("{noise:.4} {unit}");
        checks.push(check(&format!("{name} noise"), noise <= most_noise, shown, &advice));
    }
    checks
}

/// The arm's angle sensor: frames, magnet, zero.
fn arm(session: &mut Session<'_, '_>, rows: &[Record]) -> Vec<Check> {
    let rig = &session.expected.rig;
    let sound = |row: &&Record| {
        let frame = row.codes[3];
        row.ages[3] != NEVER && frame & 1 << 14 == 0 && frame.count_ones().is_multiple_of(2)
    };
    let good: Vec<&Record> = rows.iter().filter(sound).collect();
    let no_field = rows.iter().filter(|row| row.codes[3] == AngleFrame::NO_FIELD.get()).count();
    let measured = format!("{} of {} frames sound", good.len(), rows.len());
    if no_field > rows.len() / 2 {
        let advice = "the angle encoder's magnet is missing, too far or too near: centred, 0.5 to \
                      2.5 mm from the package";
        return vec![check("angle sensor", false, "no field".to_owned(), advice)];
    }
    let answers = good.len() * 100 >= rows.len() * 99;
    let advice = "the angle encoder does not answer: its leads to PB3, PA6, PA7 and PB10, its \
                  supply of 3.3 V";
    let mut checks = vec![check("angle sensor", answers, measured, advice)];
    if !answers {
        return checks;
    }
    let wanted = stowed(rig);
    let off = turned(wanted, mean(good.iter().map(|row| turned(wanted, angle(row)))).0 + wanted);
    let zero = (rig.sense.angle_zero_code + off).round().rem_euclid(TURN);
    let near = off.abs() <= ZERO_CODES;
    let shown = format!("code {:.1}, {off:+.1} from {wanted:.0}", wanted + off);
    let advice = format!(
        "the angle's zero code is far off, or the arm is not at the stow end, or its codes grow \
         inwards. Bring it to the stow end, then move it outwards by hand: if the code grows, set \
         sense.angle_zero_code = {zero:.0}; if it falls, put the chip at the pivot's other end"
    );
    if near {
        session.proposed.rig.sense.angle_zero_code = zero;
        // Half a code, and a wall machined to 0.05 mm.
        let wall = 0.05 / rig.rig.arm_length_mm / std::f64::consts::TAU * TURN;
        session.measured("sense.angle_zero_code", zero, 0.5 + wall, "the stow end");
    }
    checks.push(check("angle zero", near, shown, &advice));
    checks
}

/// A sensor's plug, pulled: the pull-down at the pin has to show.
fn lead(
    session: &mut Session<'_, '_>,
    sensor: Sensor,
    place: usize,
    name: &str,
) -> Result<Check, BringupError> {
    session.operator.act(Action::Unplug(sensor))?;
    let rows = session.line.listen(LEAD_ROWS)?;
    let (code, _) = mean(rows.iter().skip(50).map(|row| part(row.codes[place])));
    session.operator.act(Action::Plug(sensor))?;
    session.line.listen(LEAD_ROWS)?;
    if rows.len() < LEAD_ROWS as usize {
        let advice = "the log fell silent while the sensor was unplugged: the board, its supply and \
                      the probe's cable";
        let measured = format!("{} ticks of {LEAD_ROWS}", rows.len());
        return Ok(check(name, false, measured, advice));
    }
    let (other, _) = mean(rows.iter().skip(50).map(|row| part(row.codes[3 - place])));
    let pin = if sensor == Sensor::Preload { "PC2" } else { "PC3" };
    let advice = if code > BROKEN_BELOW && other < BROKEN_BELOW {
        "preload and compression sensor are exchanged: swap PC2 and PC3".to_owned()
    } else {
        format!(
            "the pull-down of 100 kOhm at {pin} is missing: a {sensor} that is torn off is not \
             noticed"
        )
    };
    Ok(check(name, code < BROKEN_BELOW, format!("{:.1} % of the converter", 100.0 * code), &advice))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bringup::{Line, Stdin};
    use crate::probe::Mute;
    use crate::scenario::Scenario;

    #[test]
    fn a_silent_log_proves_no_pull_down() {
        let (mut port, expected) = (Mute::new(), Scenario::default());
        let mut session = Session {
            line: &mut Line::new(&mut port),
            // The plug is pulled, and put in again.
            operator: &mut Stdin::new(&b"\n\n"[..], Vec::new(), true),
            expected: &expected,
            proposed: &mut expected.clone(),
            say: &mut |_| {},
        };
        let found = lead(&mut session, Sensor::Preload, 1, "preload lead").expect("a verdict");
        assert!(!found.ok && found.advice.contains("silent"), "{found:?}");
    }
}
