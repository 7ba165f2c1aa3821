//! Reciprocal of 32 significant bits, by one 32-bit division and one step of
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

#[cfg(test)]
#[allow(clippy::float_arithmetic, reason = "the reference is in f64")]
mod tests {
    use super::*;
    use crate::numeric::lattice;

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
