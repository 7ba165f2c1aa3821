//! What can be judged at rest: the board, and its sensors.

use interstage::log::{Flags, Record};
use interstage::rig::Rig;
use interstage::sense::analog::{BROKEN_ABOVE, BROKEN_BELOW};
use interstage::sense::raw::{AngleFrame, SensorId};
use interstage::supervise::Mode;

use super::figures::{angle, counted, mean, output, part, shown, stowed, turned};
use super::operator::name;
use super::{Action, BringupError, Check, Row, Session, row};
use crate::plant::sensors::TURN;
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
/// Coded age of a sensor without a reading.
const NEVER: u8 = 255;

/// A sensor at a converter with its pin and unit; the rows of its zero, its noise and its lead.
type Analogue = (SensorId, &'static str, &'static str, [Row; 3]);
const PRELOAD: [Row; 3] = [row::PRELOAD_SENSOR, row::PRELOAD_NOISE, row::PRELOAD_LEAD];
const COMPRESSION: [Row; 3] =
    [row::COMPRESSION_SENSOR, row::COMPRESSION_NOISE, row::COMPRESSION_LEAD];
const ANALOGUE: [Analogue; 2] = [
    (SensorId::PreloadSensor, "PC2", "N", PRELOAD),
    (SensorId::CompressionSensor, "PC3", "mm", COMPRESSION),
];

/// The board alone.
pub(super) fn board(session: &mut Session<'_, '_>) -> Result<Vec<Check>, BringupError> {
    let options = session.line.word(OPTIONS.0)?;
    let two = options & OPTIONS.1 != 0;
    let mut checks = vec![row::OPTION_BYTES.check(
        two,
        format!("FLASH_OPTR {options:#010x}"),
        "the flash is set up as one bank, and the firmware stays off: `STM32_Programmer_CLI -c \
         port=SWD -ob DBANK=1`, then `cargo rig flash`",
    )];
    if !two {
        return Ok(checks);
    }
    let rows = session.line.listen(ROWS)?;
    checks.push(row::FIRMWARE.by(
        Some(rows.len() as f64),
        table::counted(rows.len(), "tick"),
        "the firmware does not run: `cargo rig flash`; its text log names the reason",
    ));
    if checks.iter().all(|check| check.ok) {
        checks.extend([contact(session.line.word(PORT_B)?), readback(&rows)]);
    }
    Ok(checks)
}

fn contact(port: u32) -> Check {
    let high = STOP_PINS.iter().filter(|(_, pin)| port >> pin & 1 != 0);
    let high: Vec<&str> = high.map(|(name, _)| *name).collect();
    let measured = match &high[..] {
        [] => "PB12 and PB7 low".to_owned(),
        names => format!("{} high", names.join(" and ")),
    };
    row::STOP_CONTACT.check(
        high.is_empty(),
        measured,
        "the emergency stop's contact is open: release it; join PB12 and PB7 and connect them to \
         ground through the opening contact. Without it the motors never turn",
    )
}

fn readback(rows: &[Record]) -> Check {
    let read = rows.iter().filter(|row| row.flags.has(Flags::READBACK)).count();
    let [drive, preload] = [0, 1].map(|bridge| {
        mean(rows.iter().map(|row| output(row.bridges[bridge]))).map_or(f64::NAN, |(mean, _)| mean)
    });
    let off = |value: f64| !row::READBACK_AT_REST.has(value.abs());
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
    row::READBACK_AT_REST.check(
        read > 0 && !off(drive) && !off(preload),
        format!("drive {:.1} %, pre-tightener {:.1} %", 100.0 * drive, 100.0 * preload),
        &why,
    )
}

/// The sensors, each by itself; then their leads, and the controller's own test.
pub(super) fn sensors(session: &mut Session<'_, '_>) -> Result<Vec<Check>, BringupError> {
    let rows = session.line.listen(ROWS)?;
    let range = counted(&rows).range;
    let mut checks = vec![row::ENCODER_AT_REST.by(
        rows.last().map(|_| range as f64),
        table::counted(range, "count"),
        "the wheel turns, or its lines pick up noise: hold it still, look at the shields",
    )];
    checks.extend(ANALOGUE.iter().flat_map(|of| analogue(of, &session.expected.rig, &rows)));
    checks.extend(arm(session, &rows));
    if checks.iter().any(|check| !check.ok) {
        return Ok(checks);
    }
    for of in &ANALOGUE {
        checks.push(lead(session, of)?);
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
    checks.push(row::SELF_TEST.check(mode == Some(Mode::Idle), measured, advice));
    Ok(checks)
}

/// Range and noise of an analogue sensor.
fn analogue(of: &Analogue, rig: &Rig, rows: &[Record]) -> Vec<Check> {
    let &(sensor, pin, unit, [ref zero, ref spread, _]) = of;
    let name = name(sensor);
    let read = rows.iter().filter(|row| row.ages[sensor as usize] != NEVER);
    let (Some((value, noise)), Some(code)) =
        (mean(read.map(|row| shown(sensor, rig, row))), part(sensor, rows))
    else {
        let advice = format!("the converter gives nothing for the {name}");
        return vec![zero.check(false, "no reading".to_owned(), &advice)];
    };
    let advice = if code < BROKEN_BELOW {
        format!("the {name} is open: its lead to {pin}, its supply, its amplifier")
    } else if code > BROKEN_ABOVE {
        format!("the {name} is at the converter's end: {pin} shorted to 3.3 V, or overload")
    } else {
        format!(
            "the {name} is not at its zero, 5 % of the converter: unload it; trim the amplifier's \
             zero"
        )
    };
    let shown = format!("{:.1} % of the converter, {value:.3} {unit}", 100.0 * code);
    let mut checks = vec![zero.by(Some(value.abs()), shown, &advice)];
    if checks[0].ok {
        let advice = format!(
            "the {name}'s noise is too high: shield and ground of its lead, the 10 nF at \
             {pin}, the amplifier's supply"
        );
        let shown = format!("{noise:.4} {unit}");
        checks.push(spread.by(Some(noise), shown, &advice));
    }
    checks
}

/// The arm's angle sensor: frames, magnet, zero.
fn arm(session: &mut Session<'_, '_>, rows: &[Record]) -> Vec<Check> {
    let rig = &session.expected.rig;
    let arm = SensorId::ArmAngle as usize;
    let read = rows.iter().filter(|row| row.ages[arm] != NEVER);
    let good: Vec<f64> = read.filter_map(angle).collect();
    let no_field = rows.iter().filter(|row| row.codes[arm] == AngleFrame::NO_FIELD.get()).count();
    let measured = format!("{} of {} frames sound", good.len(), rows.len());
    if no_field > rows.len() / 2 {
        let advice = "the angle encoder's magnet is missing, too far or too near: centred, 0.5 to \
                      2.5 mm from the package";
        return vec![row::ANGLE_SENSOR.check(false, "no field".to_owned(), advice)];
    }
    let sound = good.len() as f64 / rows.len() as f64;
    let advice = "the angle encoder does not answer: its leads to PB3, PA6, PA7 and PB10, its \
                  supply of 3.3 V";
    let mut checks = vec![row::ANGLE_SENSOR.by(Some(sound), measured, advice)];
    let wanted = stowed(rig);
    let Some((off, _)) = mean(good.iter().map(|angle| turned(wanted, *angle))) else {
        return checks;
    };
    if !checks[0].ok {
        return checks;
    }
    let off = turned(wanted, off + wanted);
    let zero = (rig.sense.angle_zero_code + off).round().rem_euclid(TURN);
    let shown = format!("code {:.1}, {off:+.1} from {wanted:.0}", wanted + off);
    let advice = format!(
        "the angle's zero code is far off, or the arm is not at the stow end, or its codes grow \
         inwards. Bring it to the stow end, then move it outwards by hand: if the code grows, set \
         sense.angle_zero_code = {zero:.0}; if it falls, put the chip at the pivot's other end"
    );
    if row::ANGLE_ZERO.has(off.abs()) {
        session.proposed.rig.sense.angle_zero_code = zero;
        // Half a code, and a wall machined to 0.05 mm.
        let wall = 0.05 / rig.rig.arm_length_mm / std::f64::consts::TAU * TURN;
        session.measured("sense.angle_zero_code", zero, 0.5 + wall, "the stow end");
    }
    checks.push(row::ANGLE_ZERO.by(Some(off.abs()), shown, &advice));
    checks
}

/// A sensor's plug, pulled: the pull-down at the pin has to show.
fn lead(session: &mut Session<'_, '_>, of: &Analogue) -> Result<Check, BringupError> {
    let &(sensor, pin, _, [.., ref lead]) = of;
    session.operator.act(Action::Unplug(sensor))?;
    let rows = session.line.listen(LEAD_ROWS)?;
    session.operator.act(Action::Plug(sensor))?;
    session.line.listen(LEAD_ROWS)?;
    let settled = rows.get(LEAD_ROWS as usize / 2..).unwrap_or_default();
    let parts = SensorId::ANALOG.map(|sensor| part(sensor, settled));
    let (Some(code), LEAD_ROWS..) = (part(sensor, settled), rows.len() as u32) else {
        let advice = "the log fell silent while the sensor was unplugged: the board, its supply and \
                      the probe's cable";
        let measured = format!("{} ticks of {LEAD_ROWS}", rows.len());
        return Ok(lead.check(false, measured, advice));
    };
    let advice = if !lead.has(code) && parts.into_iter().flatten().any(|part| lead.has(part)) {
        "preload and compression sensor are exchanged: swap PC2 and PC3".to_owned()
    } else {
        format!(
            "the pull-down of 100 kOhm at {pin} is missing: a {} that is torn off is not noticed",
            name(sensor)
        )
    };
    Ok(lead.by(Some(code), format!("{:.1} % of the converter", 100.0 * code), &advice))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bringup::tests::on_a_silent_log;

    #[test]
    fn a_silent_log_proves_no_sensor_and_no_pull_down() {
        let found = on_a_silent_log(sensors).expect("a verdict");
        assert!(found.len() == 4 && found.iter().all(|check| !check.ok), "{found:?}");
        let found = on_a_silent_log(|session| lead(session, &ANALOGUE[0])).expect("a verdict");
        assert!(!found.ok && found.advice.contains("silent"), "{found:?}");
    }
}
