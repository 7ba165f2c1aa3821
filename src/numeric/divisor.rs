//! Division by a constant.

#![deny(clippy::float_arithmetic)]

use crate::units::Q16;

/// A positive number to divide by, as its reciprocal with 31 significant bits.
///
/// `x / d = x m / 2^shift`. Any units. Range: d from 2^-14 to 2^15, all of [`Q16`]
/// for x; what exceeds it saturates. Error: 0.5 LSB of rounding and 2^-31 relative, so
/// at most 1.5 LSB. Cost: one wide multiply and about ten other instructions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Divisor {
    /// m, from 2^30 to 2^31.
    factor: i32,
    /// Places to the right, 16 to 46.
    shift: u32,
}

impl Divisor {
    /// From the bits of m and the shift.
    pub(super) const fn from_parts(factor: i32, shift: u32) -> Self {
        Self { factor, shift }
    }

    /// `x` over this number.
    pub fn divide(&self, x: Q16) -> Q16 {
        let product = i64::from(x.to_bits()) * i64::from(self.factor);
        Q16::saturating_from_bits((product + (1 << (self.shift - 1))) >> self.shift)
    }
}

#[cfg(test)]
#[allow(clippy::float_arithmetic, reason = "the reference is in f64")]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20_000))]

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
}
