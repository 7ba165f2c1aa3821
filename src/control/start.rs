//! Boot, self-test and zero: what must hold before anything moves.

#![deny(clippy::float_arithmetic)]

use crate::sense::SensedState;
use crate::supervise::Fault;
use crate::units::{Millimetres, MillimetresPerSecond, Newtons, q16};

/// Ticks of rest that the self-test watches.
pub(super) const TEST_TICKS: u32 = 100;
/// Speed that still counts as rest, mm/s.
const REST: MillimetresPerSecond = q16(500_000);
/// Preload that still counts as none, N: the load cell's zero before calibration.
const UNLOADED: Newtons = q16(3_000_000);
/// Compression that still counts as none, mm.
const UNPRESSED: Millimetres = q16(100_000);

/// Whether all sensors have answered with good codes.
pub(super) fn all_answer(sensed: &SensedState) -> bool {
    sensed.speed.is_usable()
        && sensed.preload.is_usable()
        && sensed.compression.is_usable()
        && sensed.radius.is_usable()
}

/// The fault of the first sensor that has not answered.
pub(super) fn silent(sensed: &SensedState) -> Fault {
    if !sensed.speed.is_usable() {
        Fault::SpeedStale
    } else if !sensed.preload.is_usable() {
        Fault::PressureStale
    } else if !sensed.compression.is_usable() {
        Fault::DisplacementStale
    } else {
        Fault::AngleStale
    }
}

/// Whether the wheel rests.
pub(super) fn at_rest(sensed: &SensedState) -> bool {
    sensed.speed.value.abs() < REST
}

/// Whether the wheel lies unloaded on the outermost wall, so that zeros can be taken.
pub(super) fn stowed(sensed: &SensedState) -> bool {
    sensed.level == 0
        && sensed.preload_filtered.abs() < UNLOADED
        && sensed.compression_filtered.abs() < UNPRESSED
}
