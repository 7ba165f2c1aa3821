//! The three-parameter solid over a stride.

use crate::numeric::{divide, high, horner};
use crate::units::{Q16, Seconds};

/// Ratio of stride to relaxation time, Q23, from which the mean of the decay is a quotient.
const SERIES_BELOW: i32 = 1 << 19;
/// Ratio from which nothing is left, Q23.
const GONE_FROM: i32 = 20 << 23;
/// 1/ln 2, Q30.
const PER_OCTAVE: i32 = 1_549_082_005;
/// Coefficients of `2^(f - 1/2)` for f from -1/2 to 1/2, Q30: Taylor series.
const POWER: [i32; 7] =
    [759_250_125, 526_272_084, 182_392_038, 42_141_518, 7_302_526, 1_012_348, 116_951];

/// What a stride makes of an element's memory q and of its pressure, for a depth d that runs
/// linearly from d0: exact.
///
/// Equations: `q' = q e + d (1 - b) + d0 (b - e)` with `e = exp(-r)`, `b = (1 - e) / r` and
/// r the stride's duration over the relaxation time; the pressure over the relaxed stiffness is
/// `d + (s - 1)(d - q') = loads d - (s - 1)(q e + d0 (b - e))`, s being the stiffening.
/// Range: r from 0 to 255, s to 20. Error: 2e-8 of each factor; below r = 1e-4 the depths at both
/// ends are weighted to 1e-3.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Stride {
    /// Parts of memory, depth and earlier depth, Q31.
    pub(super) keeps: i32,
    pub(super) takes: i32,
    pub(super) took: i32,
    /// Pressure per depth, and what memory and earlier depth take off it, Q26.
    pub(super) loads: i32,
    pub(super) relieves: i32,
    pub(super) relieved: i32,
}

impl Stride {
    /// A stride of this duration over the relaxation time, Q23, of a tread with this excess
    /// `s - 1`, Q26.
    pub(super) fn new(ratio: i32, excess: i32) -> Self {
        let keeps = decay(ratio);
        let mean = mean_decay(ratio, keeps);
        let (takes, took) = (i32::MAX - mean, (mean - keeps).max(0));
        let part = |of: i32| high(excess, of) << 1;
        Self {
            keeps,
            takes,
            took,
            loads: (1 << 26) + part(mean),
            relieves: part(keeps),
            relieved: part(took),
        }
    }

    /// All the time that there is.
    pub(super) const RELAXED: Self =
        Self { keeps: 0, takes: i32::MAX, took: 0, loads: 1 << 26, relieves: 0, relieved: 0 };

    /// Duration over relaxation time, Q23, from 0 and saturating below 256.
    pub(super) fn ratio(duration: Seconds, per_tau: Q16) -> i32 {
        let product = i64::from(duration.to_bits()) * i64::from(per_tau.to_bits());
        i32::try_from(product.max(0) >> 9).unwrap_or(i32::MAX)
    }
}

/// `exp(-ratio)`, Q31 from a Q23.
fn decay(ratio: i32) -> i32 {
    if ratio <= 0 {
        return i32::MAX;
    }
    if ratio >= GONE_FROM {
        return 0;
    }
    // Octaves, Q53.
    let octaves = i64::from(ratio) * i64::from(PER_OCTAVE);
    let whole = octaves >> 53;
    // 2^-part = 2^(f - 1/2) with f = 1/2 - part, in -1/2 to 1/2 as Q32.
    let part = (octaves >> 21) as u32;
    let f = 0x8000_0000_u32.wrapping_sub(part) as i32;
    let [c0, c1, c2, c3, c4, c5, c6] = POWER;
    let power = horner!(f; c0, c1, c2, c3, c4, c5, c6);
    // Q30 to Q31: below one, for part is not zero where whole is, or it saturates.
    ((i64::from(power) << 1) >> whole).min(i64::from(i32::MAX)) as i32
}

/// `(1 - exp(-r)) / r`, Q31.
fn mean_decay(ratio: i32, keeps: i32) -> i32 {
    if ratio < SERIES_BELOW {
        // 1 - r/2 + r^2/6 - r^3/24, r in Q31.
        let r = ratio << 8;
        let third = i32::MAX / 24;
        let square = i32::MAX / 6 - (high(third, r) << 1);
        let half = i32::MAX / 2 - (high(square, r) << 1);
        i32::MAX - (high(half, r) << 1)
    } else {
        // Both in Q16 of their own: the quotient is below one.
        let quotient = divide(Q16::from_bits(i32::MAX - keeps), Q16::from_bits(ratio));
        // Q31 over Q23 with 16 places: Q24.
        quotient.to_bits().min((1 << 24) - 1) << 7
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_stride_is_that_of_the_solid(exponent in -4.0..2.4f64, excess in 0.0..19.0f64) {
            let r = 10f64.powf(exponent);
            let ratio = (r * f64::from(1 << 23)).round();
            let r = ratio / f64::from(1 << 23);
            let got = Stride::new(ratio as i32, (excess * f64::from(1 << 26)) as i32);
            let keeps = (-r).exp();
            let mean = -(-r).exp_m1() / r;
            let q31 = |bits: i32| f64::from(bits) / f64::from(i32::MAX);
            prop_assert!((q31(got.keeps) - keeps).abs() < 2e-6, "{} {keeps}", q31(got.keeps));
            prop_assert!((q31(got.takes) - (1.0 - mean)).abs() < 2e-6);
            prop_assert!((q31(got.took) - (mean - keeps)).abs() < 4e-6);
            let q26 = |bits: i32| f64::from(bits) / f64::from(1 << 26);
            prop_assert!((q26(got.loads) - 1.0 - excess * mean).abs() < 1e-4);
            prop_assert!((q26(got.relieves) - excess * keeps).abs() < 1e-4);
            prop_assert!((q26(got.relieved) - excess * (mean - keeps)).abs() < 1e-4);
        }
    }

    #[test]
    fn a_duration_that_is_none_is_no_time() {
        assert_eq!(Stride::ratio(Q16::from_bits(-65_536), Q16::MAX), 0);
        assert_eq!(Stride::ratio(Q16::MIN, Q16::MAX), 0);
        assert_eq!(Stride::ratio(Q16::MAX, Q16::MAX), i32::MAX);
    }

    #[test]
    fn no_time_changes_nothing_and_all_time_relaxes_it() {
        let [now, ever] = [0, i32::MAX].map(|ratio| Stride::new(ratio, 3 << 26));
        assert!(now.keeps == i32::MAX && now.takes < 4 && now.took < 4, "{now:?}");
        assert!(ever.keeps == 0 && ever.takes > i32::MAX - (1 << 24), "{ever:?}");
    }
}
