//! Products and polynomials on the upper half of a 32 x 32 bit product, the one
//! multiplication of the core that keeps all 32 bits of its operands.

#![deny(clippy::float_arithmetic)]

/// Upper half of a product, `floor(a b / 2^32)`.
///
/// A factor `t` that stands for `t / 2^32`, so from -1/2 to 1/2, leaves the format of
/// the other factor as it is. Range: all arguments. Error: below 1 LSB, downwards.
/// Cost: one instruction (SMMUL; with an addition behind it SMMLA).
#[inline(always)]
pub const fn high(a: i32, b: i32) -> i32 {
    ((a as i64 * b as i64) >> 32) as i32
}

/// Polynomial `c0 + c1 t + c2 t^2 + ...` for `t / 2^32` from -1/2 to 1/2, by Horner's rule.
///
/// Coefficients and value in one format of the caller's choice. Range: all `t`; every
/// sum of `|c_i| 2^(k-i)` over i from k up must stay below 2^31, see [`fits`]. Error: below 2 LSB, as
/// each step's truncation is at least halved by the next. Cost: one instruction a
/// degree, and one or two more to load each coefficient.
macro_rules! horner {
    ($t:expr; $c:expr) => { $c };
    ($t:expr; $c:expr, $($rest:expr),+) => {
        $c + $crate::numeric::high($crate::numeric::horner!($t; $($rest),+), $t)
    };
}

/// The same polynomial and its derivative by `t`, as a pair.
///
/// Range: as [`horner`], and the derivative's sums must fit as well, see
/// [`fits_with_slope`]. Error: below 2 LSB for the
/// value, below 6 LSB for the derivative. Cost: two instructions a degree less one, and
/// the loads.
macro_rules! horner_with_slope {
    ($t:expr; $c:expr, $last:expr) => {
        ($c + $crate::numeric::high($last, $t), $last)
    };
    ($t:expr; $c:expr, $($rest:expr),+) => {{
        let (value, slope) = $crate::numeric::horner_with_slope!($t; $($rest),+);
        ($c + $crate::numeric::high(value, $t), value + $crate::numeric::high(slope, $t))
    }};
}

/// The same polynomial, its derivative and half its second derivative by `t`.
///
/// Range: as [`horner_with_slope`], and half the second derivative's sums must fit, which
/// they do where those of the derivative stay below a quarter of the range. Error: below 2,
/// 6 and 14 LSB. Cost: three instructions a degree less three, and the loads.
macro_rules! horner_with_curvature {
    ($t:expr; $c0:expr, $c1:expr, $c2:expr) => {{
        let (value, slope) = $crate::numeric::horner_with_slope!($t; $c0, $c1, $c2);
        (value, slope, $c2)
    }};
    ($t:expr; $c:expr, $($rest:expr),+) => {{
        let (value, slope, bend) = $crate::numeric::horner_with_curvature!($t; $($rest),+);
        (
            $c + $crate::numeric::high(value, $t),
            value + $crate::numeric::high(slope, $t),
            slope + $crate::numeric::high(bend, $t),
        )
    }};
}

pub(crate) use {horner, horner_with_curvature, horner_with_slope};

/// Whether no `t` makes `horner` overflow with these coefficients, in any step.
pub fn fits(coefficients: &[i32]) -> bool {
    bounds(coefficients).0
}

/// Whether no `t` makes `horner_with_slope` overflow with these coefficients.
pub fn fits_with_slope(coefficients: &[i32]) -> bool {
    let (value, slope) = bounds(coefficients);
    value && slope
}

/// Whether the largest sums that the value's and the slope's recursion can reach fit.
fn bounds(coefficients: &[i32]) -> (bool, bool) {
    const ROOM: u64 = 1 << 31;
    let (mut value, mut slope) = (0_u64, 0_u64);
    let mut fit = (true, true);
    for c in coefficients.iter().rev() {
        slope = value + slope.div_ceil(2);
        value = u64::from(c.unsigned_abs()) + value.div_ceil(2);
        fit = (fit.0 && value < ROOM, fit.1 && slope < ROOM);
    }
    fit
}

#[cfg(test)]
#[allow(clippy::float_arithmetic, reason = "the reference is in f64")]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(5_000))]

        #[test]
        fn the_upper_half_is_the_floor(a in any::<i32>(), b in any::<i32>()) {
            let exact = (i128::from(a) * i128::from(b)).div_euclid(1 << 32);
            prop_assert_eq!(i128::from(high(a, b)), exact);
        }

        #[test]
        fn polynomials_are_within_their_bounds(
            c in prop::array::uniform7(any::<i32>()),
            shift in 1_u32..8,
            t in any::<i32>(),
        ) {
            let c = c.map(|x| x >> shift);
            prop_assume!(fits_with_slope(&c));
            let [a, b, d, e, f, g, h] = c;
            let x = f64::from(t) / 2f64.powi(32);
            let exact = c.iter().rev().fold(0.0, |sum, &c| sum * x + f64::from(c));
            let slope = (1..7).rev().fold(0.0, |sum, i| sum * x + i as f64 * f64::from(c[i]));
            let got = f64::from(horner!(t; a, b, d, e, f, g, h));
            prop_assert!((got - exact).abs() < 2.0, "{got} {exact}");
            let (value, rise) = horner_with_slope!(t; a, b, d, e, f, g, h);
            prop_assert_eq!(f64::from(value), got);
            prop_assert!((f64::from(rise) - slope).abs() < 6.0, "{rise} {slope}");
        }

        #[test]
        fn curvatures_are_within_their_bounds(
            c in prop::array::uniform6(any::<i32>()),
            shift in 4_u32..10,
            t in any::<i32>(),
        ) {
            let c = c.map(|x| x >> shift);
            prop_assume!(fits_with_slope(&c.map(|x| x.saturating_mul(4))));
            let [a, b, d, e, f, g] = c;
            let x = f64::from(t) / 2f64.powi(32);
            let bend = (2..6).rev().fold(0.0, |sum, i| {
                sum * x + 0.5 * (i * (i - 1)) as f64 * f64::from(c[i])
            });
            let (value, rise, half) = horner_with_curvature!(t; a, b, d, e, f, g);
            let (same, slope) = horner_with_slope!(t; a, b, d, e, f, g);
            prop_assert_eq!((value, rise), (same, slope));
            prop_assert!((f64::from(half) - bend).abs() < 14.0, "{half} {bend}");
        }

        #[test]
        fn what_fits_never_overflows(
            c in prop::array::uniform5(any::<i32>()),
            shift in 0_u32..4,
            t in prop_oneof![Just(i32::MIN), Just(i32::MAX), any::<i32>()],
        ) {
            let c = c.map(|x| x >> shift);
            let [a, b, d, e, f] = c;
            // An overflow panics here.
            if fits(&c) {
                let _ = horner!(t; a, b, d, e, f);
            }
            if fits_with_slope(&c) {
                let _ = horner_with_slope!(t; a, b, d, e, f);
            }
        }
    }

    #[test]
    fn too_large_coefficients_are_refused() {
        assert!(fits(&[i32::MAX, 0, 0]));
        assert!(!fits(&[i32::MIN, 0, 0]));
        assert!(!fits(&[i32::MAX, 2, 0]));
        assert!(!fits(&[1 << 30, i32::MAX, 0]));
        assert!(!fits_with_slope(&[0, 1 << 29, i32::MAX]));
    }
}
