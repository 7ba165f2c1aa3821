//! The wheel's speed as the tread remembers it.

#![deny(clippy::float_arithmetic)]

use crate::numeric::divide;
use crate::units::{MillimetresPerSecond, Q16, Seconds, Travel, q16};

/// Gain of a tick, 1 / 500 in 2^-16: a millisecond over the travel that the tread remembers, 0.5 mm.
/// With it a wheel that speeds up or slows down over a corner opens the gap of one that crosses
/// at the remembered speed throughout, to 6 % of the speed (one deviation, 130 crossings of the
/// ring).
const GAIN: i64 = 131;
/// The same as a rate, 1/s times mm/s: 1 / 0.5 mm.
const RATE: Q16 = q16(2_000_000);
/// Longest time per travel, s/mm: a wheel at rest.
const MOST: Travel = Travel::lit("8");
/// Shortest, s/mm: beyond every drive's speed.
const LEAST: Travel = Travel::lit("0.005");

/// Time per travel of the last 0.5 mm, s/mm, Q31.32: its mean, with a weight that falls by e in
/// that travel. It is what the rubber had to relax in, so the time is averaged and not the speed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct CrossingSpeed(Travel);

impl Default for CrossingSpeed {
    fn default() -> Self {
        Self(MOST)
    }
}

impl CrossingSpeed {
    /// One tick at this speed, of either sign.
    pub(super) fn step(&mut self, speed: MillimetresPerSecond) {
        let missing = Q16::ONE - Q16::narrow(self.0) * speed.abs();
        let change = Travel::from_bits(i64::from(missing.to_bits()) * GAIN);
        self.0 = self.0.saturating_add(change).clamp(LEAST, MOST);
    }

    /// The remembered speed, mm/s, as it was `ago` before, if the wheel has had this speed since.
    pub(super) fn speed(&self, ago: Seconds, speed: MillimetresPerSecond) -> MillimetresPerSecond {
        let slowness = Q16::narrow(self.0);
        let then = slowness + (slowness * speed.abs() - Q16::ONE) * (ago * RATE);
        divide(Q16::ONE, then.max(Q16::narrow(LEAST)))
    }
}

#[cfg(test)]
#[allow(clippy::float_arithmetic, reason = "the reference is in f64")]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The same filter in f64, one tick.
    fn exact(slowness: f64, speed: f64) -> f64 {
        (slowness + (1.0 - slowness * speed) / 500.0).clamp(0.005, 8.0)
    }

    #[test]
    fn of_a_dip_the_slowest_part_counts_most() {
        let mut crossing = CrossingSpeed::default();
        let mut last = 0.0;
        // 30 mm/s down to 10 and up to 18 again, as over a corner.
        let dip = (0..200).map(|_| 30.0).chain((0..80).map(|t| 30.0 - 0.25 * f64::from(t)));
        for speed in dip.chain((0..40).map(|t| 10.0 + 0.2 * f64::from(t))) {
            crossing.step(Q16::from_num(speed));
            last = speed;
        }
        let remembered: f64 = crossing.speed(Q16::ZERO, Q16::from_num(last)).to_num();
        assert!((14.8..15.4).contains(&remembered), "{remembered}");
    }

    proptest! {
        #[test]
        fn it_follows_the_same_filter_in_f64(
            speeds in proptest::collection::vec(-60.0..60.0f64, 1..5),
            ticks in 1..400usize,
        ) {
            let (mut crossing, mut reference) = (CrossingSpeed::default(), 8.0);
            for speed in &speeds {
                for _ in 0..ticks {
                    crossing.step(Q16::from_num(*speed));
                    reference = exact(reference, speed.abs());
                }
            }
            let got: f64 = Q16::narrow(crossing.0).to_num();
            prop_assert!((got - reference).abs() < 2e-4 + 4e-3 * reference, "{got} {reference}");
        }

        #[test]
        fn a_constant_speed_is_remembered_as_it_is(speed in 1.0..60.0f64, ago in 0.0..0.01f64) {
            let mut crossing = CrossingSpeed::default();
            for _ in 0..4000 {
                crossing.step(Q16::from_num(speed));
            }
            let got: f64 = crossing.speed(Q16::from_num(ago), Q16::from_num(speed)).to_num();
            // Time per travel, what it lacks and its product are off by 2^-16 s/mm each.
            let off = 3.0 * speed * speed / 65_536.0;
            prop_assert!((got - speed).abs() < 0.01 + off, "{got}");
        }

        #[test]
        fn what_was_a_few_ticks_ago_is_found_again(
            from in 5.0..20.0f64,
            to in 5.0..20.0f64,
            ticks in 1..8u32,
        ) {
            let mut crossing = CrossingSpeed::default();
            for _ in 0..1000 {
                crossing.step(Q16::from_num(from));
            }
            for _ in 0..ticks {
                crossing.step(Q16::from_num(to));
            }
            let ago = Q16::from_num(f64::from(ticks) * 1e-3);
            let got: f64 = crossing.speed(ago, Q16::from_num(to)).to_num();
            prop_assert!((got - from).abs() < 0.05 * from + 0.1 * (to - from).abs(), "{got}");
        }
    }
}
