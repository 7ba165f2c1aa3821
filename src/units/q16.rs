//! The number of the control path.

use core::fmt;
use core::ops::{Add, AddAssign, Mul, MulAssign, Neg, Sub, SubAssign};

use fixed::traits::{FromFixed, ToFixed};
use fixed::types::{I16F16, I32F32};

/// Saturating Q15.16: range -32768 to 32767.99998, LSB 2^-16 = 15.3e-6. Sums are exact or
/// saturate; products are rounded towards minus infinity, then saturate. [`fixed`], whose
/// conversions it uses, takes three times as long.
#[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash, serde::Serialize)]
#[repr(transparent)]
#[serde(transparent)]
pub struct Q16(i32);

impl<'de> serde::Deserialize<'de> for Q16 {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        bits(deserializer).map(Self)
    }
}

/// Not inlined: a set of parameters holds a hundred of them, and each place would get a
/// decoder of its own.
fn bits<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<i32, D::Error> {
    serde::Deserialize::deserialize(deserializer)
}

impl Q16 {
    /// 0.
    pub const ZERO: Self = Self(0);
    /// 1.
    pub const ONE: Self = Self(1 << 16);
    /// The LSB, 2^-16.
    pub const DELTA: Self = Self(1);
    /// Largest number.
    pub const MAX: Self = Self(i32::MAX);
    /// Least number.
    pub const MIN: Self = Self(i32::MIN);

    /// The number of these bits, in units of 2^-16.
    pub const fn from_bits(bits: i32) -> Self {
        Self(bits)
    }

    /// In units of 2^-16.
    pub const fn to_bits(self) -> i32 {
        self.0
    }

    /// From units of 2^-16, saturating.
    pub const fn saturating_from_bits(bits: i64) -> Self {
        if bits as i32 as i64 == bits {
            Self(bits as i32)
        } else {
            Self(if bits < 0 { i32::MIN } else { i32::MAX })
        }
    }

    /// From any number, saturating, rounded to nearest; not for the tick.
    pub fn from_num<T: ToFixed>(number: T) -> Self {
        Self(I16F16::saturating_from_num(number).to_bits())
    }

    /// As any number, by the rules of [`fixed`].
    pub fn to_num<T: FromFixed>(self) -> T {
        I16F16::from_bits(self.0).to_num()
    }

    /// From Q31.32, rounded towards minus infinity, saturating.
    pub const fn narrow(wide: I32F32) -> Self {
        Self::saturating_from_bits(wide.to_bits() >> 16)
    }

    /// As Q31.32, exact.
    pub const fn widen(self) -> I32F32 {
        I32F32::from_bits((self.0 as i64) << 16)
    }

    /// Magnitude, saturating.
    pub const fn abs(self) -> Self {
        Self(self.0.saturating_abs())
    }

    /// Half, rounded towards minus infinity.
    pub const fn half(self) -> Self {
        Self(self.0 >> 1)
    }

    /// The integer nearest to it, halves away from zero.
    pub const fn round(self) -> i32 {
        let magnitude = ((self.0.unsigned_abs() >> 15) + 1) >> 1;
        if self.0 < 0 { -(magnitude as i32) } else { magnitude as i32 }
    }

    /// The integer at or below it.
    pub const fn floor(self) -> i32 {
        self.0 >> 16
    }
}

/// Implements an operator, and the one that assigns its result.
macro_rules! operators {
    ($($on:ident $name:ident $assigns:ident $assign:ident($a:ident, $b:ident) $of:expr;)*) => {$(
        impl $on for Q16 {
            type Output = Self;

            fn $name(self, $b: Self) -> Self {
                let $a = self;
                $of
            }
        }

        impl $assigns for Q16 {
            fn $assign(&mut self, $b: Self) {
                *self = (*self).$name($b);
            }
        }
    )*};
}

operators! {
    Add add AddAssign add_assign(a, b) Self(a.0.saturating_add(b.0));
    Sub sub SubAssign sub_assign(a, b) Self(a.0.saturating_sub(b.0));
    Mul mul MulAssign mul_assign(a, b) {
        Self::saturating_from_bits((i64::from(a.0) * i64::from(b.0)) >> 16)
    };
}

impl Neg for Q16 {
    type Output = Self;

    fn neg(self) -> Self {
        Self(self.0.saturating_neg())
    }
}

impl fmt::Display for Q16 {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        I16F16::from_bits(self.0).fmt(f)
    }
}

impl fmt::Debug for Q16 {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fixed::Saturating;
    use proptest::prelude::*;

    fn library(bits: i32) -> Saturating<I16F16> {
        Saturating(I16F16::from_bits(bits))
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20_000))]

        #[test]
        fn gives_the_same_bits_as_the_library(
            a in any::<i32>(),
            b in any::<i32>(),
            a_shift in 0_u32..31,
            b_shift in 0_u32..31,
        ) {
            let (a, b) = (a >> a_shift, b >> b_shift);
            let (x, y, p, q) = (Q16(a), Q16(b), library(a), library(b));
            prop_assert_eq!((x + y).0, (p + q).0.to_bits());
            prop_assert_eq!((x - y).0, (p - q).0.to_bits());
            prop_assert_eq!((x * y).0, (p * q).0.to_bits());
            prop_assert_eq!((-x).0, (-p).0.to_bits());
            let (mut sum, mut difference) = (x, x);
            sum += y;
            difference -= y;
            prop_assert_eq!((sum, difference), (x + y, x - y));
            prop_assert_eq!(x.abs().0, p.abs().0.to_bits());
            prop_assert_eq!(x.round(), p.0.to_num::<f64>().round() as i32);
            prop_assert_eq!(x.floor(), p.0.to_num::<f64>().floor() as i32);
            prop_assert_eq!(x.to_num::<f64>(), f64::from(a) / 65_536.0);
            prop_assert_eq!(Q16::from_num(x.to_num::<f64>()), x);
            prop_assert_eq!(Q16::narrow(x.widen()), x);
            prop_assert_eq!(x.widen().to_num::<f64>(), x.to_num::<f64>());
        }
    }

    #[test]
    fn numbers_read_as_they_are() {
        let value = Q16::from_num(-3.25);
        assert_eq!((value.to_string(), format!("{value:?}")), ("-3.25".into(), "-3.25".into()));
    }

    #[test]
    fn the_ends_saturate() {
        assert_eq!(Q16::MAX + Q16::DELTA, Q16::MAX);
        assert_eq!(Q16::MIN - Q16::DELTA, Q16::MIN);
        assert_eq!(-Q16::MIN, Q16::MAX);
        assert_eq!(Q16::MIN.abs(), Q16::MAX);
        assert_eq!(Q16::MIN * Q16::MIN, Q16::MAX);
        assert_eq!(Q16::MIN * Q16::MAX, Q16::MIN);
        assert_eq!(Q16::from_num(1e9), Q16::MAX);
        assert_eq!(Q16::from_num(-1e9), Q16::MIN);
        assert_eq!(Q16::saturating_from_bits(1 << 40), Q16::MAX);
        assert_eq!(Q16::saturating_from_bits(-(1 << 40)), Q16::MIN);
    }
}
