//! Square roots without division.

use super::{high, horner};
use crate::units::Q16;

/// Coefficients of the reciprocal root around 0.625, Q29: least relative error, 0.21 %,
/// on a quarter to one.
const GUESS: [i32; 5] = [679_478_306, -525_378_519, 603_510_535, -1_321_966_887, 2_042_483_520];

/// 0.625 in Q32.
const MIDDLE: u32 = 0xA000_0000;

/// Square root of `x / 2^32` in the same format, `2^16 sqrt(x)`; 0 gives 0.
///
/// Error: 0 to 1.5 LSB too small. Source: Heron's step with [`inverse_sqrt_normalised`] in place
/// of the division.
const fn sqrt_fraction(x: u32) -> u32 {
    let (shift, inverse) = inverse_sqrt_normalised(x);
    let m = x << shift;
    let root = upper(m, inverse << 1);
    // Q60 cancels to Q40, which half the inverse turns into what the root lacks.
    let lacking = (((m as u64) << 28).wrapping_sub(root as u64 * root as u64) as i64) >> 20;
    let step = high(lacking as i32, inverse as i32) >> 6;
    (root << 2).wrapping_add_signed(step) >> (shift / 2)
}

/// The even shift that brings `x / 2^32` to `m` between a quarter and one, and `1 / sqrt(m)` in
/// Q29, from 2^29 to 2^30, also for 0. Error: 1e-5 relative. Source: one step of Newton's
/// iteration from [`inverse_sqrt_guess`].
const fn inverse_sqrt_normalised(x: u32) -> (u32, u32) {
    let (shift, guess) = inverse_sqrt_guess(x);
    // Q30, from 1 to 2, as is what follows from it.
    let (m, guess) = (x << shift, guess << 1);
    // m guess^2 is 1; 3 less that is 2. Q28.
    let twice = (3 << 28) - upper(m, upper(guess, guess));
    (shift, upper(guess, twice << 2))
}

/// The same within 0.22 %, relative. Source: a quartic of least relative error.
const fn inverse_sqrt_guess(x: u32) -> (u32, u32) {
    let shift = (x | 1).leading_zeros() & !1;
    let t = (x << shift).wrapping_sub(MIDDLE) as i32;
    let [c0, c1, c2, c3, c4] = GUESS;
    (shift, horner!(t; c0, c1, c2, c3, c4) as u32)
}

/// Square root; negative arguments give 0. Error: 0.51 LSB. Source: as `sqrt_fraction`.
pub fn sqrt(x: Q16) -> Q16 {
    let bits = u32::try_from(x.to_bits()).unwrap_or(0);
    // 2^16 sqrt(bits) is the root in Q24; at most 1.5 LSB of that too small.
    Q16::from_bits(((sqrt_fraction(bits) + 129) >> 8) as i32)
}

/// Upper half of an unsigned product.
const fn upper(a: u32, b: u32) -> u32 {
    ((a as u64 * b as u64) >> 32) as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::lattice;

    fn error(x: u32) -> f64 {
        f64::from(sqrt_fraction(x)) - 65_536.0 * f64::from(x).sqrt()
    }

    #[test]
    fn roots_are_within_their_bound_on_a_lattice() {
        let (mut least, mut most) = (0.0f64, f64::MIN);
        for x in lattice(0, 2003).chain(1..5000) {
            let error = error(x);
            (least, most) = (least.min(error), most.max(error));
        }
        assert!(least > -1.5 && least < -1.0, "{least}");
        assert!(most <= 0.0 && most > -0.5, "{most}");
    }

    #[test]
    fn inverse_roots_are_within_their_bound_on_a_lattice() {
        let (mut most, mut guessed) = (0.0f64, 0.0f64);
        for x in lattice(1, 2003).chain(1..5000) {
            let (shift, inverse) = inverse_sqrt_normalised(x);
            assert!(shift % 2 == 0 && (x << shift) >> 30 != 0, "{x}");
            let exact = 2f64.powi(45) / f64::from(x << shift).sqrt();
            most = most.max((f64::from(inverse) / exact - 1.0).abs());
            let (same, guess) = inverse_sqrt_guess(x);
            assert_eq!(shift, same);
            guessed = guessed.max((f64::from(guess) / exact - 1.0).abs());
        }
        assert!(most < 1e-5 && most > 3e-6, "{most}");
        assert!(guessed < 2.2e-3 && guessed > 2e-3, "{guessed}");
    }

    #[test]
    fn roots_of_quantities_are_within_their_bound_on_a_lattice() {
        for bits in lattice(0, 4001).chain(1..5000) {
            let exact = (f64::from(bits as i32).max(0.0) * 65_536.0).sqrt();
            let error = f64::from(sqrt(Q16::from_bits(bits as i32)).to_bits()) - exact;
            assert!(error.abs() <= 0.51, "{bits}: {error}");
        }
        for n in 0..=181_i32 {
            assert_eq!(sqrt(Q16::from_num(n * n)), Q16::from_num(n));
        }
        assert_eq!((sqrt(-Q16::DELTA), sqrt(Q16::MIN)), (Q16::ZERO, Q16::ZERO));
    }
}
