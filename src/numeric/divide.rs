//! Division and reciprocal on the 32-bit divider, and division by a constant.

use super::high;
use crate::units::Q16;

/// Quotient `a / b`, rounded to nearest, halves away from zero.
///
/// Range: all of [`Q16`]; what exceeds it saturates, so does division by zero, towards the sign of
/// `a` (0 / 0 is 0). Error: 0.5 LSB. Source: schoolbook division in base 2^16, Knuth, TAOCP 2,
/// 4.3.1, algorithm D.
pub fn divide(a: Q16, b: Q16) -> Q16 {
    let (a, b) = (a.to_bits(), b.to_bits());
    if a == 0 {
        return Q16::ZERO;
    }
    let divisor = b.unsigned_abs();
    // |a| 2^16 plus half a divisor: less than 2^48 + 2^31.
    let numerator = (u64::from(a.unsigned_abs()) << 16) + u64::from(divisor >> 1);
    let negative = (a < 0) != (b < 0);
    let magnitude =
        if ((numerator >> 32) as u32) < divisor { quotient(numerator, divisor) } else { u32::MAX };
    let bits = if negative {
        i32::try_from(-i64::from(magnitude)).unwrap_or(i32::MIN)
    } else {
        i32::try_from(magnitude).unwrap_or(i32::MAX)
    };
    Q16::from_bits(bits)
}

/// Quotient `a / b` of numbers that are not negative, with one 32-bit division where `a` is not
/// above `b`, rounded down; else as [`divide`].
///
/// Error: within `[-1, 0]` LSB and 2^-15 relative upwards: `b` is cut to the bits that the
/// quotient resolves.
pub fn part(a: Q16, b: Q16) -> Q16 {
    let (Ok(a_bits), Ok(b_bits)) = (u32::try_from(a.to_bits()), u32::try_from(b.to_bits())) else {
        return divide(a, b);
    };
    if a_bits > b_bits {
        return divide(a, b);
    }
    // a is at most 2^31: as far up as it goes, b down by the rest of the 16 places.
    let up = a_bits.leading_zeros().min(16);
    let divisor = b_bits >> (16 - up);
    // b is not below a, so that the divisor keeps at least 16 bits, or b is zero.
    let bits = (a_bits << up).checked_div(divisor).unwrap_or(0);
    Q16::from_bits(bits as i32)
}

/// `numerator / divisor` rounded down. Needs `numerator < divisor * 2^32`, so that
/// the quotient fits.
fn quotient(numerator: u64, divisor: u32) -> u32 {
    let shift = divisor.leading_zeros();
    let divisor = divisor << shift;
    let numerator = numerator << shift;
    let (high, low) = ((numerator >> 32) as u32, numerator as u32);
    let first = digit(high, low >> 16, divisor);
    let rest = (high << 16 | low >> 16).wrapping_sub(first.wrapping_mul(divisor));
    let second = digit(rest, low & 0xFFFF, divisor);
    first << 16 | second
}

/// One base-2^16 digit of `(high 2^16 + next) / divisor`, `divisor` normalised and above `high`.
/// The estimate from the leading halves is at most two too large.
fn digit(high: u32, next: u32, divisor: u32) -> u32 {
    // The top bit is set already; said again, the division cannot be by zero.
    let (upper, lower) = (divisor >> 16 | 0x8000, divisor & 0xFFFF);
    let mut estimate = high / upper;
    let mut rest = high - estimate * upper;
    for _ in 0..2 {
        if estimate >> 16 == 0 && estimate * lower <= (rest << 16 | next) {
            break;
        }
        estimate -= 1;
        rest += upper;
        if rest >> 16 != 0 {
            break;
        }
    }
    estimate
}

/// A positive number to divide by, as its reciprocal with 31 significant bits: `x m / 2^shift`.
///
/// Range: d from 2^-14 to 2^15, all of [`Q16`] for x; what exceeds it saturates. Error: at most
/// 1.5 LSB.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Divisor {
    /// m, from 2^30 to 2^31.
    pub(super) factor: i32,
    /// Places to the right, 16 to 46.
    pub(super) shift: u32,
}

impl Divisor {
    /// `x` over this number.
    pub fn divide(&self, x: Q16) -> Q16 {
        let product = i64::from(x.to_bits()) * i64::from(self.factor);
        Q16::saturating_from_bits((product + (1 << (self.shift - 1))) >> self.shift)
    }
}

/// Reciprocal `2^63 / n` of a number whose top bit is set; without it, a number without meaning.
///
/// Error: 0 to 16 LSB too small, at most 6e-9 relative. Source: Newton's iteration `r (2 - n r)`
/// from a quotient of 16 bits.
pub const fn reciprocal_of_normalised(n: u32) -> u32 {
    // Odd, so never zero; within 2^-15 of n 2^-16.
    let upper = n >> 16 | 1;
    let guess = 0x8000_0000 / upper;
    // What n times guess lacks to 2^47, Q45 relative. The leading bits cancel.
    let lacking = 0_u32.wrapping_sub((n >> 2).wrapping_mul(guess)) as i32;
    let step = high((guess << 14) as i32, lacking) >> 11;
    // The two bits of n that are left out make it at most 6 too large.
    (guess << 16).wrapping_add_signed(step - 6)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::lattice;
    use proptest::prelude::*;

    fn q(bits: i32) -> Q16 {
        Q16::from_bits(bits)
    }

    /// The quotient in 128 bits, rounded to nearest, saturated.
    fn exact(a: i32, b: i32) -> i32 {
        if a == 0 {
            return 0;
        }
        if b == 0 {
            return if a > 0 { i32::MAX } else { i32::MIN };
        }
        let (n, d) = ((i128::from(a) << 16).abs(), i128::from(b).abs());
        let magnitude = (2 * n + d) / (2 * d);
        let signed = if (a < 0) != (b < 0) { -magnitude } else { magnitude };
        signed.clamp(i128::from(i32::MIN), i128::from(i32::MAX)) as i32
    }

    #[test]
    fn corners_are_exact() {
        let corners = [i32::MIN, i32::MIN + 1, -65_537, -65_536, -65_535, -3, -1, 0, 1, 2, 3]
            .into_iter()
            .chain([32_767, 32_768, 65_535, 65_536, 65_537, 0x7FFF_0000, 0x7FFF_FFFE, i32::MAX])
            .collect::<Vec<_>>();
        for &a in &corners {
            for &b in &corners {
                assert_eq!(divide(q(a), q(b)).to_bits(), exact(a, b), "{a} / {b}");
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20_000))]

        #[test]
        fn parts_stay_in_their_bound(
            a in 0..=i32::MAX,
            b in 0..=i32::MAX,
            a_shift in 0_u32..31,
            b_shift in 0_u32..31,
        ) {
            let (a, b) = (a >> a_shift, b >> b_shift);
            let got = part(q(a), q(b)).to_bits();
            if a > b || b == 0 {
                prop_assert_eq!(got, exact(a, b));
            } else {
                let quotient = f64::from(a) / f64::from(b) * 65_536.0;
                let got = f64::from(got);
                prop_assert!(got > quotient - 1.0, "{got} {quotient}");
                prop_assert!(got <= quotient * (1.0 + 1.0 / 32_768.0), "{got} {quotient}");
            }
        }

        #[test]
        fn quotients_are_the_exact_ones_rounded_once(
            a in any::<i32>(),
            b in any::<i32>(),
            a_shift in 0_u32..31,
            b_shift in 0_u32..31,
        ) {
            let (a, b) = (a >> a_shift, b >> b_shift);
            prop_assert_eq!(divide(q(a), q(b)).to_bits(), exact(a, b));
        }

        #[test]
        fn quotients_are_within_their_bound(
            bits in any::<i32>(),
            places in 0_u32..31,
            exponent in -14.0..14.99_f64,
        ) {
            let (x, d) = (Q16::from_bits(bits >> places), exponent.exp2());
            let got = Divisor::build("k", d).unwrap().divide(x);
            let exact = x.to_num::<f64>() / d;
            if exact.abs() < 32_767.0 {
                prop_assert!((got.to_num::<f64>() - exact).abs() <= 1.5 / 65_536.0, "{got} {exact}");
            } else {
                prop_assert!(got.abs() >= Q16::from_num(32_766), "{got} {exact}");
            }
        }
    }

    #[test]
    fn what_is_no_divisor_is_refused() {
        for value in [0.0, -1.0, 1e-5, 40_000.0, f64::NAN, f64::INFINITY] {
            assert!(Divisor::build("k", value).is_err(), "{value}");
        }
    }

    fn reciprocal_error(n: u32) -> f64 {
        f64::from(reciprocal_of_normalised(n)) - 2f64.powi(63) / f64::from(n)
    }

    #[test]
    fn reciprocals_are_within_their_bound_on_a_lattice() {
        let (mut least, mut most) = (0.0f64, f64::MIN);
        for n in lattice(1 << 31, 1009).chain([(1 << 31) + 1]) {
            let error = reciprocal_error(n);
            (least, most) = (least.min(error), most.max(error));
        }
        assert!((-16.0..-8.0).contains(&least), "{least}");
        assert!(most <= 0.0 && most > -1.0, "{most}");
    }

    #[test]
    fn a_number_that_is_not_normalised_has_an_answer() {
        let _ = reciprocal_of_normalised(0);
    }
}
