//! What a motion in the service mode shows of its bridge.

use interstage::log::Record;
use interstage::rig::Rig;
use interstage::supervise::Mode;

use super::figures::{output, travel_mm};
use super::line::Motion;
use super::{Check, row};

/// Changes that count as one: preload, N, and compression, mm. A tread that was rolled creeps by
/// less for a second.
pub(super) const CHANGED: (f64, f64) = (0.7, 0.025);

/// Rows in which a bridge was given a duty.
pub(super) fn driven(motion: &Motion, bridge: usize) -> &[Record] {
    let given = |row: &Record| {
        let duties = [row.telemetry.drive, row.telemetry.pretightener];
        duties[bridge].to_bits() != 0
    };
    let first = motion.rows.iter().position(given).unwrap_or(0);
    let last = motion.rows.iter().rposition(given).map_or(first, |last| last + 1);
    &motion.rows[first..last]
}

/// Speed of the tread in the later half of a motion of the drive, mm/s.
pub(super) fn speed(motion: &Motion, rig: &Rig) -> f64 {
    let rows = driven(motion, 0);
    let steady = &rows[rows.len() / 2..];
    travel_mm(rig, steady) / (1e-3 * steady.len().saturating_sub(1).max(1) as f64)
}

/// The fault that ended a motion, in words.
pub(super) fn fault(motion: &Motion) -> String {
    match motion.mode {
        Mode::FaultHold(fault) => format!("; fault {}: {}", fault.code(), fault.sentence()),
        _ => String::new(),
    }
}

/// What a bridge and the other one put out under a duty; and whether neither put out anything.
pub(super) fn bridge(motion: &Motion, which: usize, duty: f64) -> (Check, bool) {
    let rows = driven(motion, which);
    let first = motion.rows.iter().position(|row| rows.first() == Some(row)).unwrap_or(0);
    // A fault ends it after some milliseconds: the largest output of those tells.
    let end = (first + rows.len() + 2).min(motion.rows.len());
    let largest = |bridge: usize| {
        let outputs = motion.rows[first..end].iter().map(|row| output(row.bridges[bridge]));
        outputs.fold(0.0, |most: f64, now| if now.abs() > most.abs() { now } else { most })
    };
    let (own, other) = (largest(which), largest(1 - which));
    let row = &[row::DRIVE_BRIDGE, row::PRETIGHTENER_BRIDGE][which];
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
    (row.check(sound, shown, &advice), silent && !rows.is_empty())
}
