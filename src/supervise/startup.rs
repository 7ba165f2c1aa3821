//! Conditions of boot, self-test and zero.

use super::monitor::sensor_fault;
use crate::fault::Fault;
use crate::sense::SensedState;
use crate::units::{Millimetres, MillimetresPerSecond, Newtons, q16};

/// Ticks of rest that the self-test watches.
pub const TEST_TICKS: u32 = 100;
/// The same where a preload sensor that is off by more than [`UNLOADED`] is believed less than a tread,
/// which takes time to be pressed: five times those in which the published one relaxes.
pub const SETTLED_TICKS: u32 = 500;
/// Speed that still counts as rest, mm/s.
const REST: MillimetresPerSecond = q16(500_000);
/// Preload that still counts as none, N: the preload sensor's zero before calibration.
pub const UNLOADED: Newtons = q16(3_000_000);
/// Compression that still counts as none, mm.
const UNPRESSED: Millimetres = q16(100_000);
/// The same with zeros of a record, N and mm: 1 % of the published limit, and what that compresses.
const KNOWN: (Newtons, Millimetres) = (q16(500_000), q16(20_000));

/// The fault of the first sensor that has not answered with good codes; none if all have.
pub fn silent(sensed: &SensedState) -> Option<Fault> {
    sensor_fault(sensed, false)
}

/// Whether a wheel of this speed rests, mm/s.
pub fn at_rest(speed: MillimetresPerSecond) -> bool {
    speed.abs() < REST
}

/// Whether the wheel lies unloaded on the outermost wall, so that zeros can be taken. A preload
/// sensor farther off is believed less than a tread that is pressed by less than half of what it
/// shows: this compression means `pressed`, N. Its zero is taken as far as `zero_limit`, N. Sensors whose
/// zeros are `known` by a record show what presses them.
pub fn stowed(sensed: &SensedState, pressed: Newtons, zero_limit: Newtons, known: bool) -> bool {
    let shown = sensed.preload_filtered.abs();
    let off = !known && shown <= zero_limit && pressed < shown.half();
    let (unloaded, unpressed) = if known { KNOWN } else { (UNLOADED, UNPRESSED) };
    let none = (shown < unloaded || off) && sensed.compression_filtered.abs() < unpressed;
    sensed.level == 0 && none
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sense::{Reason, Validity};
    use crate::units::Q16;

    /// Sensor values on this wall, at this speed, preload and compression.
    fn sensed(level: u8, speed: f64, preload: f64, compression: f64) -> SensedState {
        let mut sensed = crate::estimate::sensed(level, 0.0, compression);
        sensed.speed.value = Q16::from_num(speed);
        sensed.preload_filtered = Q16::from_num(preload);
        sensed
    }

    #[test]
    fn stowed_is_unloaded_and_on_the_outermost_wall() {
        for (level, preload, compression, expected) in [
            (0, 0.0, 0.0, true),
            (0, 2.9, 0.09, true),
            (0, -2.9, -0.09, true),
            (1, 0.0, 0.0, false),
            (0, 3.0, 0.06, false),
            (0, -3.1, 0.0, true),
            // Of a cell that shows 4 N with a tread that is not pressed; 2 N press it by 0.05 mm.
            (0, 4.0, 0.0, true),
            (0, 4.0, 0.04, true),
            (0, 4.0, 0.06, false),
            (0, 6.1, 0.0, false),
            (0, 0.0, 0.11, false),
            (0, 0.0, -0.11, false),
        ] {
            let seen = sensed(level, 0.0, preload, compression);
            let pressed = Q16::from_num(159.5 * compression.max(0.0).powf(1.5));
            assert_eq!(
                stowed(&seen, pressed, q16(6_000_000), false),
                expected,
                "{level} {preload} {compression}"
            );
        }
        let mut edge = sensed(0, 0.0, 0.0, 0.0);
        edge.compression_filtered = UNPRESSED;
        assert!(!stowed(&edge, Q16::ZERO, q16(6_000_000), false));
        // A reset under a preload that rises: its tread does not show all of it yet.
        for (preload, compression, expected) in
            [(0.4, 0.01, true), (0.6, 0.0, false), (0.0, 0.03, false), (5.5, 0.06, false)]
        {
            let seen = sensed(0, 0.0, preload, compression);
            assert_eq!(stowed(&seen, Q16::ZERO, q16(6_000_000), true), expected, "{preload}");
        }
    }

    #[test]
    fn rest_is_less_than_half_a_millimetre_a_second() {
        for (speed, expected) in
            [(0.0, true), (0.49, true), (-0.49, true), (0.5, false), (-0.5, false)]
        {
            assert_eq!(at_rest(Q16::from_num(speed)), expected, "{speed}");
        }
    }

    #[test]
    fn each_sensor_that_has_not_answered_is_named() {
        let mut all = sensed(0, 0.0, 0.0, 0.0);
        all.validities_mut().into_iter().for_each(|validity| *validity = Validity::Valid);
        all.compression.validity = Validity::Held(Reason::OutOfRange);
        assert_eq!(silent(&all), None);
        let missing = [
            Fault::WheelEncoderStale,
            Fault::PreloadSensorStale,
            Fault::CompressionSensorStale,
            Fault::ArmAngleStale,
        ];
        for (sensor, fault) in missing.into_iter().enumerate() {
            let mut seen = all;
            *seen.validities_mut()[sensor] = Validity::Absent;
            assert_eq!(silent(&seen), Some(fault));
        }
        all.radius.validity = Validity::Invalid(Reason::NoField);
        assert_eq!(silent(&all), Some(Fault::ArmAngleMagnet));
    }
}
