//! Figures of what the board logs in a time.

use interstage::log::Record;
use interstage::rig::Rig;
use interstage::sense::raw::{BridgeCode, EncoderCount, SensorId};

use super::BringupError;
use super::line::silent;
use crate::plant::sensors::{Coding, SPAN, TURN, decode, encode};

/// Mean and standard deviation; none of nothing.
pub(super) fn mean(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    let all: Vec<f64> = values.collect();
    let count = all.len() as f64;
    let mean = all.iter().sum::<f64>() / count;
    let square = all.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / count;
    (!all.is_empty()).then(|| (mean, square.sqrt()))
}

/// What a sensor of this rig shows in a row, N or mm.
pub(super) fn shown(sensor: SensorId, rig: &Rig, row: &Record) -> f64 {
    decode(sensor, rig, row.codes[sensor as usize].into())
}

/// Mean of what it shows in these rows, of which there must be one.
pub(super) fn level<'a>(
    sensor: SensorId,
    rig: &Rig,
    rows: impl Iterator<Item = &'a Record>,
) -> Result<f64, BringupError> {
    let mean = mean(rows.map(|row| shown(sensor, rig, row)));
    mean.map(|(mean, _)| mean).ok_or_else(silent)
}

/// Travel of the tread over these rows, mm.
pub(super) fn travel_mm(rig: &Rig, rows: &[Record]) -> f64 {
    decode(SensorId::WheelEncoder, rig, counted(rows).sum as f64)
}

/// Part of the converter at which a sensor reads in these rows.
pub(super) fn part(sensor: SensorId, rows: &[Record]) -> Option<f64> {
    Some(mean(rows.iter().map(|row| f64::from(row.codes[sensor as usize])))?.0 / SPAN)
}

/// Output of a bridge, parts of the supply.
pub(super) fn output(code: u16) -> f64 {
    f64::from(BridgeCode::new(code).duty()) / 32_768.0
}

/// Code of the angle; none of an unsound frame.
pub(super) fn angle(row: &Record) -> Option<f64> {
    Coding::Angle.number(row.codes[SensorId::ArmAngle as usize])
}

/// Code of the arm with the wheel, uncompressed, on the outermost wall.
pub fn stowed(rig: &Rig) -> f64 {
    let sine = (rig.centre_radius_mm(0) - rig.rig.arm_pivot_radius_mm) / rig.rig.arm_length_mm;
    encode(SensorId::ArmAngle, rig, sine.asin().to_degrees())
}

/// Difference of two codes of the angle, the short way round.
pub(super) fn turned(from: f64, to: f64) -> f64 {
    (to - from + 1.5 * TURN).rem_euclid(TURN) - 0.5 * TURN
}

/// Counts of the wheel encoder from row to row: their sum, its range, and how many changed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Counted {
    pub sum: i64,
    pub range: i64,
    pub changes: usize,
}

pub(super) const fn count(row: &Record) -> EncoderCount {
    EncoderCount::new(row.codes[SensorId::WheelEncoder as usize])
}

pub(super) fn counted(rows: &[Record]) -> Counted {
    let (mut sum, mut low, mut high, mut changes) = (0_i64, 0, 0, 0);
    for pair in rows.windows(2) {
        let step = count(&pair[1]).since(count(&pair[0]));
        sum += i64::from(step);
        changes += usize::from(step != 0);
        (low, high) = (sum.min(low), sum.max(high));
    }
    Counted { sum, range: high - low, changes }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_angle_goes_the_short_way_round() {
        for (from, to, expected) in
            [(10.0, 20.0, 10.0), (16_380.0, 4.0, 8.0), (4.0, 16_380.0, -8.0), (0.0, 8000.0, 8000.0)]
        {
            let short = turned(from, to);
            assert!((short - expected).abs() < 1e-9, "{from} {to}: {short}");
        }
    }

    #[test]
    fn counts_go_on_across_the_wrap() {
        let mut rows = [Record::default(); 4];
        for (row, count) in rows.iter_mut().zip([65_530, 2, 1, 2]) {
            row.codes[SensorId::WheelEncoder as usize] = count;
        }
        assert_eq!(counted(&rows), Counted { sum: 8, range: 8, changes: 3 });
    }
}
