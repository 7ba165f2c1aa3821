//! A function of one variable as a table.

#![deny(clippy::float_arithmetic)]

use crate::units::Q16;

/// A function sampled at N evenly spaced points, at least 4, and interpolated by Catmull-Rom
/// splines: through every sample, continuous in slope, exact for parabolas.
///
/// `y(k + t) = p1 + t/2 ((p2 - p0) + t ((2 p0 - 5 p1 + 4 p2 - p3) + t (3 p1 - 3 p2 + p3 - p0)))`
/// over the four samples around the interval; beyond the ends the samples continue as the
/// parabola through the last three. The argument is clamped to the table's range.
///
/// Error: `0.017 h^3 max|f'''|` inside, six times that in the first and last interval, h being
/// the spacing, plus 1.5 LSB and `2^-32 (N - 1)` of the largest slope per interval. Source:
/// Catmull and Rom 1974; the constant is the central slope's `h^2 f'''/6` times `max
/// t(1-t)(1-2t) = 0.096`.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Table<const N: usize> {
    /// Least argument, bits of Q16.
    lo: i32,
    /// Largest argument, bits of Q16.
    hi: i32,
    /// Intervals per LSB of the argument, times 2^shift; top bit set.
    factor: u32,
    /// 32 to 62.
    shift: u32,
    /// Values at the points, bits of Q16.
    #[serde(with = "serde_big_array::BigArray")]
    samples: [i32; N],
}

/// Zero everywhere: room for a table to be read into.
impl<const N: usize> Default for Table<N> {
    fn default() -> Self {
        Self { lo: 0, hi: 0, factor: 0, shift: 32, samples: [0; N] }
    }
}

/// Bits of the position inside an interval.
const FRACTION: u32 = 30;

/// Half of what the interpolation's coefficients may reach, so that each fits 32
/// bits with its rounding.
const COEFFICIENT_LIMIT: i64 = 1 << 30;

impl<const N: usize> Table<N> {
    /// A table from bits of Q16; `None` if the range is narrower than its
    /// intervals, N is below 4, or neighbouring samples differ so much that the
    /// interpolation could overflow (second differences beyond 8000).
    pub(super) fn from_bits(lo: i32, hi: i32, samples: [i32; N]) -> Option<Self> {
        if N < 4 || hi <= lo {
            return None;
        }
        let width = hi.wrapping_sub(lo) as u32 as u64;
        let mut rest = (N - 1) as u64;
        if rest >= width {
            return None;
        }
        // Binary long division (N - 1) / width to 32 significant digits.
        let mut factor = 0_u32;
        let mut shift = 0;
        while factor >> 31 == 0 {
            rest <<= 1;
            factor <<= 1;
            if rest >= width {
                rest -= width;
                factor |= 1;
            }
            shift += 1;
        }
        let table = Self { lo, hi, factor, shift, samples };
        let tame = (0..N - 1).all(|index| {
            let [_, coefficients @ ..] = table.cubic(index);
            coefficients.iter().all(|coefficient| coefficient.abs() < COEFFICIENT_LIMIT)
        });
        tame.then_some(table)
    }

    /// Value at `x`; that of the nearer end outside.
    pub fn eval(&self, x: Q16) -> Q16 {
        let x = x.to_bits();
        if x <= self.lo {
            return Q16::from_bits(self.samples.first().copied().unwrap_or(0));
        }
        if x >= self.hi {
            return Q16::from_bits(self.samples.last().copied().unwrap_or(0));
        }
        let offset = x.wrapping_sub(self.lo) as u32;
        let position = u64::from(offset) * u64::from(self.factor);
        let index = (position >> self.shift) as usize;
        let t = (position << (64 - self.shift) >> (64 - FRACTION)) as i64;
        let [value, linear, square, cube] = self.cubic(index);
        let product = |a: i64| (a * t + (1 << (FRACTION - 1))) >> FRACTION;
        let slope = linear + product(square + product(cube));
        Q16::saturating_from_bits(value + ((slope * t + (1 << FRACTION)) >> (FRACTION + 1)))
    }

    /// Value, and twice the coefficients of t, t^2, t^3, of an interval.
    fn cubic(&self, index: usize) -> [i64; 4] {
        let p1 = self.sample(index);
        let p2 = self.sample(index + 1);
        let p0 = match index.checked_sub(1) {
            Some(before) => self.sample(before),
            None => 3 * (p1 - p2) + self.sample(2),
        };
        let p3 = if index + 2 < N { self.sample(index + 2) } else { 3 * (p2 - p1) + p0 };
        let square = 2 * p0 - 5 * p1 + 4 * p2 - p3;
        let cube = 3 * (p1 - p2) + p3 - p0;
        [p1, p2 - p0, square, cube]
    }

    fn sample(&self, index: usize) -> i64 {
        // The index is below N by construction; the check spares a panic.
        if index < N { self.samples[index] as i64 } else { self.samples[N - 1] as i64 }
    }
}

#[cfg(test)]
#[allow(clippy::float_arithmetic, reason = "the reference is in f64")]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const LSB: f64 = 1.0 / 65_536.0;

    fn q(bits: i32) -> Q16 {
        Q16::from_bits(bits)
    }

    /// Largest errors in units of `h^3 max|f'''|` beyond 1.5 LSB, inside and at
    /// the two end intervals.
    fn constants<const N: usize>(
        lo: f64,
        hi: f64,
        third: f64,
        f: impl Fn(f64) -> f64 + Copy,
    ) -> (f64, f64) {
        let table = Table::<N>::build(lo, hi, f).expect("a smooth function");
        let h = (hi - lo) / (N - 1) as f64;
        let (mut inside, mut ends) = (0.0_f64, 0.0_f64);
        for step in 0..=50_000 {
            let x = Q16::from_num(lo + (hi - lo) * f64::from(step) / 50_000.0);
            let exact = x.to_num::<f64>();
            let error = (table.eval(x).to_num::<f64>() - f(exact)).abs() - 1.5 * LSB;
            let constant = error / (h * h * h * third);
            if exact < lo + h || exact > hi - h {
                ends = ends.max(constant);
            } else {
                inside = inside.max(constant);
            }
        }
        (inside, ends)
    }

    #[test]
    fn the_error_constants_hold() {
        let (inside, ends) = constants::<17>(0.0, 3.0, 1000.0, |x| 1000.0 * x.sin());
        assert!((0.012..=0.017).contains(&inside), "{inside}");
        assert!((0.017..=6.0 * 0.017).contains(&ends), "{ends}");
        let (inside, ends) = constants::<9>(0.5, 2.5, 200.0 * 2.5_f64.exp(), |x| 200.0 * x.exp());
        assert!(inside <= 0.017, "{inside}");
        assert!(ends <= 6.0 * 0.017, "{ends}");
    }

    #[test]
    fn samples_are_met_exactly() {
        let samples = [5, -70_000, 1_000_000, 3_000_000, -2, 7, 65_536, 0, 12];
        let table = Table::from_bits(-8 * 65_536, 8 * 65_536, samples).expect("tame");
        for (index, &sample) in samples.iter().enumerate() {
            let x = Q16::from_num(2 * index as i32 - 8);
            assert_eq!(table.eval(x), q(sample));
        }
    }

    #[test]
    fn the_full_range_is_served() {
        let table = Table::<5>::build(-32_768.0, 32_767.0, |x| x / 4.0).expect("a line");
        for bits in [i32::MIN, i32::MIN + 1, -1, 0, 1, 0x1234_5678, i32::MAX - 1, i32::MAX] {
            let exact = q(bits).to_num::<f64>().min(32_767.0) / 4.0;
            assert!((table.eval(q(bits)).to_num::<f64>() - exact).abs() <= 2.5 * LSB);
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2_000))]

        #[test]
        fn parabolas_are_exact(
            a in -20.0_f64..20.0,
            b in -50.0_f64..50.0,
            c in -500.0_f64..500.0,
            x in -5.0_f64..5.0,
        ) {
            let table = Table::<12>::build(-4.0, 4.0, |x| a * x * x + b * x + c)
                .expect("a parabola");
            let x = Q16::from_num(x);
            let inside = x.to_num::<f64>().clamp(-4.0, 4.0);
            let exact = a * inside * inside + b * inside + c;
            // The samples' own rounding, through the ghost points' weights.
            prop_assert!((table.eval(x).to_num::<f64>() - exact).abs() <= 2.5 * LSB);
        }

        #[test]
        fn any_bits_stay_without_panic(
            samples in prop::array::uniform8(-0x0400_0000..0x0400_0000_i32),
            lo in any::<i32>(),
            hi in any::<i32>(),
            x in any::<i32>(),
        ) {
            if let Some(table) = Table::from_bits(lo, hi, samples) {
                let _ = table.eval(q(x));
            }
        }
    }
}
