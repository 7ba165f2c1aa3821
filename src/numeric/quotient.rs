//! Reciprocal and quotient of 32 significant bits, by one 32-bit division and one step of
//! Newton's iteration.

#![deny(clippy::float_arithmetic)]

use super::high;

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

/// Quotient `2^32 a / b` of a smaller by a larger number; what reaches 1 saturates, so does
/// division by zero. Error: 0 to 24 LSB too small, at most 6e-9 relative beyond 1 LSB.
pub const fn fraction(a: u32, b: u32) -> u32 {
    if a >= b {
        return u32::MAX;
    }
    // b > 0 here, so the shift is at most 31 and a below b keeps its bits.
    let shift = b.leading_zeros();
    let reciprocal = reciprocal_of_normalised(b << shift);
    (((a << shift) as u64 * reciprocal as u64) >> 31) as u32
}

/// Part `2^32 a / (a + b)` that one number is of a sum, for `b` from 1 and `a + b` below 2^32.
/// Error: 0 to 25 LSB too small.
pub const fn part_of_sum(a: u32, b: u32) -> u32 {
    let sum = a.wrapping_add(b);
    let shift = sum.leading_zeros() & 31;
    let reciprocal = reciprocal_of_normalised(sum << shift);
    let half = (((a << shift) as u64 * reciprocal as u64) >> 32) as u32;
    half << 1
}

#[cfg(test)]
#[allow(clippy::float_arithmetic, reason = "the reference is in f64")]
mod tests {
    use super::*;
    use crate::numeric::lattice;
    use proptest::prelude::*;

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
    fn hostile_arguments_have_an_answer() {
        assert_eq!(fraction(0, 0), u32::MAX);
        assert_eq!(fraction(5, 5), u32::MAX);
        assert_eq!(fraction(u32::MAX, 1), u32::MAX);
        assert_eq!(fraction(0, 1), 0);
        let _ = reciprocal_of_normalised(0);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20_000))]

        #[test]
        fn parts_of_sums_agree_with_f64(
            a in any::<u32>(),
            b in 1_u32..,
            a_shift in 1_u32..32,
            b_shift in 1_u32..31,
        ) {
            let (a, b) = (a >> a_shift, (b >> b_shift).max(1));
            let exact = f64::from(a) / (f64::from(a) + f64::from(b)) * 2f64.powi(32);
            let error = f64::from(part_of_sum(a, b)) - exact;
            prop_assert!((-25.0..=0.0).contains(&error), "{error}");
        }

        #[test]
        fn quotients_agree_with_f64(a in any::<u32>(), b in any::<u32>(), shift in 0_u32..31) {
            let (a, b) = (a >> shift, b >> (shift / 2));
            let (a, b) = (a.min(b), a.max(b).max(1));
            let a = a.min(b - 1);
            let exact = f64::from(a) / f64::from(b) * 2f64.powi(32);
            let error = f64::from(fraction(a, b)) - exact;
            prop_assert!((-24.0..=0.0).contains(&error), "{error}");
            prop_assert!(error >= -1.0 - 6e-9 * exact, "{error} {exact}");
        }
    }
}
