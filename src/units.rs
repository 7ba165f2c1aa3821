//! Fixed-point quantities, named by what they measure, and the drive's commands.
//!
//! Every quantity of the control path is a [`Q16`]: 32 bits, 16 of them fraction, saturating. One
//! format keeps the tick in 32 x 32 -> 64 multiplies, bit-identical on host and target. Quantities
//! that need more resolution have a format of their own (see [`Travel`]).

mod motion;
mod q16;

use fixed::types::I32F32;

pub use motion::{Direction, Duty, MotorCommand};
pub use q16::Q16;

/// Length or position, mm. LSB 15 nm; the rig spans 0.4 m, headroom 80-fold.
pub type Millimetres = Q16;

/// Speed, mm/s. LSB 15 nm/s; the drive ends at 100 mm/s, headroom 300-fold.
pub type MillimetresPerSecond = Q16;

/// Acceleration, mm/s^2. LSB 15 nm/s^2; limits lie below 2000, headroom 16-fold.
pub type MillimetresPerSecond2 = Q16;

/// Force, N. LSB 15 uN; sensors end at 200 N, headroom 160-fold.
pub type Newtons = Q16;

/// Rate of force, N/s. LSB 15 uN/s; slews lie below 200 N/s, headroom 160-fold.
pub type NewtonsPerSecond = Q16;

/// Duration, s. LSB 15 us; horizons lie below 600 s, headroom 50-fold.
pub type Seconds = Q16;

/// Dimensionless ratio: friction, utilisation, stiffness scale, Deborah number.
pub type Ratio = Q16;

/// Accumulated position, mm, Q31.32: LSB 0.23 pm, so that a millisecond at 1 mm/s is integrated
/// without drift. Never wraps: 2^31 mm is 2000 km.
pub type Travel = I32F32;

/// Time in control ticks of one millisecond since boot; wraps after 49.7 days,
/// compared by wrapping difference only.
pub type Tick = u32;

/// Control ticks in a second, the rate of the motor task.
pub const TICK_HZ: u32 = 1000;

/// A constant [`Q16`] from millionths, rounded towards zero: `q16(1_500_000)` is 1.5. Out of
/// range the build fails.
pub const fn q16(millionths: i64) -> Q16 {
    let bits = millionths * 65_536 / 1_000_000;
    assert!(bits >= i32::MIN as i64 && bits <= i32::MAX as i64);
    Q16::from_bits(bits as i32)
}

/// Distance covered in one tick at `speed`, mm, exact to half an LSB of [`Travel`].
pub fn per_tick(speed: MillimetresPerSecond) -> Travel {
    // 2^32 / 1000 rounded: Q16 x Q32 -> Q48, shifted to Q32.
    const TICK_Q32: i64 = 4_294_967;
    Travel::from_bits((i64::from(speed.to_bits()) * TICK_Q32) >> 16)
}

/// A duration in whole ticks as seconds, saturating at 32767 s.
pub fn ticks_to_seconds(ticks: u32) -> Seconds {
    // 2^16 / 1000 = 65.536 = 1_099_511_628 / 2^24 within 3e-10.
    let bits = (u64::from(ticks) * 1_099_511_628) >> 24;
    Q16::from_bits(i32::try_from(bits).unwrap_or(i32::MAX))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn constants_are_exact_where_they_can_be() {
        assert_eq!(q16(1_500_000).to_num::<f64>(), 1.5);
        assert_eq!(q16(-250_000).to_num::<f64>(), -0.25);
    }

    proptest! {
        #[test]
        fn a_tick_of_travel_is_speed_times_a_millisecond(bits in any::<i32>()) {
            let speed = Q16::from_bits(bits);
            let exact = speed.to_num::<f64>() * 1e-3;
            let got = per_tick(speed).to_num::<f64>();
            // The reciprocal is 7e-8 short of 2^32/1000; the shift floors.
            prop_assert!((got - exact).abs() <= exact.abs() * 8e-8 + 2.4e-10);
        }

        #[test]
        fn seconds_of_ticks_are_right_or_saturated(ticks in any::<u32>()) {
            let exact = f64::from(ticks) * 1e-3;
            let got = ticks_to_seconds(ticks).to_num::<f64>();
            if exact < 32_767.0 {
                prop_assert!((got - exact).abs() <= 1.6e-5 + exact * 1e-9);
            } else {
                prop_assert!(got >= 32_767.0 - 0.01);
            }
        }
    }
}
