//! Square root.

#![deny(clippy::float_arithmetic)]

use super::sqrt_fraction;
use crate::units::Q16;

/// Square root.
///
/// Range: 0 to 32768 gives 0 to 181.02; negative arguments give 0. Error: 0.51 LSB, the
/// root with eight more bits rounded once. Cost: about 40 cycles.
///
/// Source: as [`sqrt_fraction`].
#[inline]
#[must_use]
pub fn sqrt(x: Q16) -> Q16 {
    let bits = u32::try_from(x.to_bits()).unwrap_or(0);
    // 2^16 sqrt(bits) is the root in Q24; at most 1.5 LSB of that too small.
    Q16::from_bits(((sqrt_fraction(bits) + 129) >> 8) as i32)
}

#[cfg(test)]
#[allow(clippy::float_arithmetic, reason = "the reference is in f64")]
mod tests {
    use super::*;
    use crate::numeric::lattice;
    use proptest::prelude::*;

    fn q(bits: i32) -> Q16 {
        Q16::from_bits(bits)
    }

    #[test]
    fn roots_are_within_their_bound_on_a_lattice() {
        for bits in lattice(0, 4001) {
            let exact = (f64::from(bits as i32).max(0.0) * 65_536.0).sqrt();
            let error = f64::from(sqrt(q(bits as i32)).to_bits()) - exact;
            assert!(error.abs() <= 0.51, "{bits}: {error}");
        }
    }

    #[test]
    fn squares_have_exact_roots() {
        for n in 0..=181_i32 {
            assert_eq!(sqrt(Q16::from_num(n * n)), Q16::from_num(n));
        }
        assert_eq!(sqrt(q(-1)), Q16::ZERO);
        assert_eq!(sqrt(q(i32::MIN)), Q16::ZERO);
        assert_eq!(sqrt(q(1)).to_bits(), 256);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20_000))]

        #[test]
        fn roots_are_within_their_bound(bits in 0..i32::MAX, shift in 0_u32..31) {
            let x = q(bits >> shift);
            let got = sqrt(x).to_num::<f64>();
            prop_assert!((got - x.to_num::<f64>().sqrt()).abs() <= 0.51 / 65_536.0);
        }
    }
}
