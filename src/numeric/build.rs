//! From SI numbers to machine units: the only floats of this module, used once at start.

use super::{Divisor, LowPass};
use crate::rig::RigError;
use crate::units::{Q16, TICK_HZ};
use fixed::types::I16F16;

/// `value` as a [`Q16`], rounded to nearest.
pub fn checked(key: &'static str, value: f64) -> Result<Q16, RigError> {
    let number = I16F16::checked_from_num(value);
    number.map(|n| Q16::from_bits(n.to_bits())).ok_or(RigError::OutOfRange {
        key,
        value,
        min: I16F16::MIN.to_num(),
        max: I16F16::MAX.to_num(),
    })
}

/// Cosine of an angle in turns by its series, within 1e-14 up to a few turns: the
/// library's, for angles of any size, would take 5 kB of the image.
pub fn cosine_of_turns(turns: f64) -> f64 {
    let angle = core::f64::consts::TAU * (turns - libm::round(turns));
    let square = angle * angle;
    let (mut term, mut sum) = (1.0, 1.0);
    for n in 1..14 {
        term *= -square / f64::from((2 * n - 1) * 2 * n);
        sum += term;
    }
    sum
}

impl Divisor {
    /// A division by `value`.
    pub fn build(key: &'static str, value: f64) -> Result<Self, RigError> {
        let (min, max) = (1.0 / 16_384.0, 32_768.0);
        if !(value >= min && value <= max) {
            return Err(RigError::OutOfRange { key, value, min, max });
        }
        // 1/d = part 2^exponent with a part of at least a half.
        let (part, exponent) = libm::frexp(1.0 / value);
        let factor = libm::round(libm::ldexp(part, 31)).min(2_147_483_647.0) as i32;
        Ok(Self { factor, shift: (31 - exponent) as u32 })
    }
}

impl LowPass {
    /// A low-pass of time constant `tau_s`, s; none at all if it is not positive.
    /// Longest useful: 20 s, where the gain is three LSB.
    pub fn build(tau_s: f64) -> Self {
        let a = if tau_s > 0.0 { -libm::expm1(-1.0 / (f64::from(TICK_HZ) * tau_s)) } else { 1.0 };
        Self { gain: libm::round(a * 65_536.0).clamp(1.0, 65_536.0) as u32 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cosines_are_those_of_the_library() {
        for step in -3000..=3000 {
            let turns = f64::from(step) * 1e-3;
            let exact = (core::f64::consts::TAU * turns).cos();
            assert!((cosine_of_turns(turns) - exact).abs() < 1e-14, "{turns}");
        }
    }

    #[test]
    fn numbers_outside_the_format_are_refused_by_name() {
        assert_eq!(checked("a.b", 1.5), Ok(Q16::from_num(1.5)));
        for value in [40_000.0, -40_000.0, f64::NAN, f64::INFINITY] {
            let error = checked("a.b", value).expect_err("refused");
            assert!(matches!(error, RigError::OutOfRange { key: "a.b", .. }));
        }
    }
}
