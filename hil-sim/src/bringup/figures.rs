//! Figures of what the board logs in a time.

use interstage::log::Record;
use interstage::rig::Rig;
use interstage::sense::analog::{FULL_AT, ZERO_AT};
use interstage::sense::raw::BridgeCode;

/// Codes between a sensor's zero and its full scale.
const SPAN: f64 = (FULL_AT - ZERO_AT) * 65_535.0;
/// Codes of an angle sensor's turn.
pub(super) const TURN: f64 = 16_384.0;

/// Mean and standard deviation; zero of nothing.
pub(super) fn mean(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let all: Vec<f64> = values.collect();
    let count = all.len().max(1) as f64;
    let mean = all.iter().sum::<f64>() / count;
    let square = all.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / count;
    (mean, square.sqrt())
}

/// The sensors of a rig in its quantities.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scale {
    pub preload_n: f64,
    pub compression_mm: f64,
    pub count_mm: f64,
}

impl Scale {
    pub(super) fn of(rig: &Rig) -> Self {
        let around = std::f64::consts::TAU * rig.rig.wheel_radius_mm;
        Self {
            preload_n: rig.sense.preload_full_scale_n / SPAN,
            compression_mm: rig.sense.tread_full_scale_mm / SPAN,
            count_mm: around / rig.sense.encoder_counts,
        }
    }

    pub(super) fn preload(&self, row: &Record) -> f64 {
        (f64::from(row.codes[1]) - ZERO_AT * 65_535.0) * self.preload_n
    }

    pub(super) fn compression(&self, row: &Record) -> f64 {
        (f64::from(row.codes[2]) - ZERO_AT * 65_535.0) * self.compression_mm
    }
}

/// Part of the converter at which an analogue sensor reads.
pub(super) fn part(code: u16) -> f64 {
    f64::from(code) / 65_535.0
}

/// Output of a bridge, parts of the supply.
pub(super) fn output(code: u16) -> f64 {
    f64::from(BridgeCode::new(code).duty()) / 32_768.0
}

/// Code of the angle without parity and flag.
pub(super) fn angle(row: &Record) -> f64 {
    f64::from(row.codes[3] & 0x3FFF)
}

/// Code of the arm with the wheel, uncompressed, on the outermost wall.
pub fn stowed(rig: &Rig) -> f64 {
    let sine = (rig.centre_radius_mm(0) - rig.rig.arm_pivot_radius_mm) / rig.rig.arm_length_mm;
    rig.sense.angle_zero_code + sine.asin() / std::f64::consts::TAU * TURN
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

pub(super) fn counted(rows: &[Record]) -> Counted {
    let (mut sum, mut low, mut high, mut changes) = (0_i64, 0, 0, 0);
    for pair in rows.windows(2) {
        let step = pair[1].codes[0].wrapping_sub(pair[0].codes[0]) as i16;
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
            assert!(
                (turned(from, to) - expected).abs() < 1e-9,
                "{from} {to}: {}",
                turned(from, to)
            );
        }
    }

    #[test]
    fn counts_go_on_across_the_wrap() {
        let mut rows = [Record::default(); 4];
        for (row, count) in rows.iter_mut().zip([65_530, 2, 1, 2]) {
            row.codes[0] = count;
        }
        assert_eq!(counted(&rows), Counted { sum: 8, range: 8, changes: 3 });
    }
}
