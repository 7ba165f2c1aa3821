//! Square root.

#![deny(clippy::float_arithmetic)]

use crate::units::Q16;

/// Square root, rounded to nearest.
///
/// Range: 0 to 32768 gives 0 to 181.02; negative arguments give 0. Error: 0.5 LSB,
/// the exact root rounded once. Cost: at most 24 rounds of shift, compare and
/// subtract on 32-bit numbers; no division.
///
/// Source: the binary digit-by-digit method, e.g. Warren, Hacker's Delight, 11-1.
#[must_use]
pub fn sqrt(x: Q16) -> Q16 {
    let Ok(bits) = u32::try_from(x.to_bits()) else {
        return Q16::ZERO;
    };
    // The root of x in Q16 is the integer root of bits 2^16: 24 binary digits,
    // each from two bits of the radicand. Leading pairs of zeros give leading
    // zero digits and are skipped.
    let radicand = u64::from(bits) << 16;
    let skipped = (radicand.leading_zeros() & !1).min(62);
    let mut feed = radicand << skipped;
    let mut root = 0_u32;
    let mut rest = 0_u32;
    for _ in 0..(64 - skipped) / 2 {
        rest = rest << 2 | (feed >> 62) as u32;
        feed <<= 2;
        let trial = root << 2 | 1;
        root <<= 1;
        if rest >= trial {
            rest -= trial;
            root |= 1;
        }
    }
    // rest = radicand - root^2; above root, the next integer is nearer.
    if rest > root {
        root += 1;
    }
    Q16::from_bits(i32::try_from(root).unwrap_or(i32::MAX))
}

#[cfg(test)]
#[allow(clippy::float_arithmetic, reason = "the reference is in f64")]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn q(bits: i32) -> Q16 {
        Q16::from_bits(bits)
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
        fn roots_are_the_exact_ones_rounded_once(bits in 0..i32::MAX, shift in 0_u32..31) {
            let x = q(bits >> shift);
            let got = sqrt(x).to_num::<f64>();
            prop_assert!((got - x.to_num::<f64>().sqrt()).abs() <= 0.501 / 65_536.0);
        }
    }
}
