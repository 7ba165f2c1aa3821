//! What an arithmetic has to offer, and four that do.

use core::ops::{Add, Div, Mul, Sub};

use fixed::types::I4F28;
use micromath::F32Ext;

/// A number as mantissa in a half octave.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HalfOctave<N> {
    /// Half octaves above 2^-7; what is below counts as there.
    pub row: usize,
    /// Where in the half octave, from -1 to 1.
    pub mantissa: N,
    /// Places that make a difference of numbers one of mantissas.
    pub places: u32,
}

/// Numbers that the model can be computed with.
pub trait Number:
    Copy
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
{
    /// 0.
    const ZERO: Self;
    /// 1.
    const ONE: Self;
    /// 1/2.
    const HALF: Self;
    /// From a coefficient; none if it is out of range.
    fn of(value: f64) -> Option<Self>;

    /// Square root of a number that is not negative.
    fn sqrt(self) -> Self;

    /// Which quarter of the numbers from 0 to 1, and where in it, from -1 to 1.
    fn quarter(self) -> (usize, Self);

    /// Which half octave between 2^-7 and 2^-2, held at these, and where in it.
    fn half_octave(self) -> HalfOctave<Self>;

    /// Times 2^`places`, from 2 to 29.
    fn by_places(self, places: u32) -> Self;

    /// From the bits of a Q15.16, over 2^`places`.
    fn input(bits: i32, places: u32) -> Self;

    /// To the bits of a Q15.16, times 2^`places`.
    fn output(self, places: u32) -> i32;

    /// The larger of two.
    #[inline(always)]
    fn at_least(self, other: Self) -> Self {
        if self < other { other } else { self }
    }

    /// The smaller of two.
    #[inline(always)]
    fn at_most(self, other: Self) -> Self {
        if self > other { other } else { self }
    }
}

/// Q3.28 of the `fixed` crate, with its own operators: range +-8, LSB 3.7e-9. Of its
/// formats the one with the least error: the model's numbers are below 8.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Fixed(I4F28);

/// f32 on the core's floating-point unit; the root is micromath's, brought to all bits by
/// Heron's steps.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Micro(f32);

/// f32 on the core's floating-point unit; the root is libm's.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Libm(f32);

/// f64, in software on the core; the root is libm's.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Double(f64);

macro_rules! operators {
    ($number:ident) => {
        operators!($number, Add, add, +);
        operators!($number, Sub, sub, -);
        operators!($number, Mul, mul, *);
        operators!($number, Div, div, /);
    };
    ($number:ident, $trait:ident, $name:ident, $sign:tt) => {
        impl $trait for $number {
            type Output = Self;

            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                Self(self.0 $sign other.0)
            }
        }
    };
}

operators!(Fixed);
operators!(Micro);
operators!(Libm);
operators!(Double);

impl Number for Fixed {
    const ZERO: Self = Self(I4F28::ZERO);
    const ONE: Self = Self(I4F28::ONE);
    const HALF: Self = Self(I4F28::from_bits(1 << 27));

    fn of(value: f64) -> Option<Self> {
        I4F28::checked_from_num(value).map(Self)
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.checked_sqrt().unwrap_or(I4F28::ZERO))
    }

    #[inline(always)]
    fn quarter(self) -> (usize, Self) {
        let part = (self.0.to_bits() as u32) << 4;
        // A quarter is 2^26: brought to one above -1.
        let centred = ((part << 2) ^ 0x8000_0000) as i32;
        ((part >> 30) as usize, Self(I4F28::from_bits(centred >> 3)))
    }

    #[inline(always)]
    fn half_octave(self) -> HalfOctave<Self> {
        let bits = self.0.to_bits().clamp(1 << 21, (1 << 26) - 1) as u32;
        let zeros = bits.leading_zeros();
        let normalised = bits << zeros;
        let centred = ((normalised << 2) ^ 0x8000_0000) as i32;
        HalfOctave {
            row: (2 * (10 - zeros) + (normalised >> 30 & 1)) as usize,
            mantissa: Self(I4F28::from_bits(centred >> 3)),
            places: zeros - 1,
        }
    }

    #[inline(always)]
    fn by_places(self, places: u32) -> Self {
        Self(I4F28::from_bits(self.0.to_bits() << places))
    }

    #[inline(always)]
    fn input(bits: i32, places: u32) -> Self {
        let places = 28 - 16 - places as i32;
        Self(I4F28::from_bits(if places < 0 { bits >> -places } else { bits << places }))
    }

    #[inline(always)]
    fn output(self, places: u32) -> i32 {
        let places = 28 - 16 - places;
        (self.0.to_bits() + (1 << places >> 1)) >> places
    }
}

macro_rules! float {
    ($number:ident, $float:ident, $bits:ident, $mantissa:literal, $sqrt:expr) => {
        impl Number for $number {
            const ZERO: Self = Self(0.0);
            const ONE: Self = Self(1.0);
            const HALF: Self = Self(0.5);

            fn of(value: f64) -> Option<Self> {
                Some(Self(value as $float))
            }

            #[inline(always)]
            fn sqrt(self) -> Self {
                Self($sqrt(self.0))
            }

            #[inline(always)]
            fn quarter(self) -> (usize, Self) {
                let fourfold = 4.0 * self.0;
                let whole = fourfold as i32;
                (whole as usize, Self(2.0 * (fourfold - whole as $float) - 1.0))
            }

            #[inline(always)]
            fn half_octave(self) -> HalfOctave<Self> {
                const ONE: $bits = (1.0 as $float).to_bits();
                let bits = self.0.clamp(1.0 / 128.0, 0.249_999_99).to_bits();
                // Exponent and upper bit of the mantissa count half octaves.
                let row = (bits >> ($mantissa - 1)) - ((ONE >> ($mantissa - 1)) - 14);
                let within = (bits << 1 & ((1 << $mantissa) - 1)) | ONE;
                HalfOctave {
                    row: row as usize,
                    mantissa: Self(2.0 * $float::from_bits(within) - 3.0),
                    places: 9 - (row >> 1) as u32,
                }
            }

            #[inline(always)]
            fn by_places(self, places: u32) -> Self {
                let bits = (1.0 as $float).to_bits() + ((places as $bits) << $mantissa);
                Self(self.0 * $float::from_bits(bits))
            }

            #[inline(always)]
            fn input(bits: i32, places: u32) -> Self {
                // A power of two as a constant, where `places` is one.
                Self(bits as $float * (1.0 / (1_u64 << (16 + places)) as $float))
            }

            #[inline(always)]
            fn output(self, places: u32) -> i32 {
                // To the nearest, for what is not negative.
                (self.0 * (1_u64 << (16 + places)) as $float + 0.5) as i32
            }
        }
    };
}

float!(Micro, f32, u32, 23, |x: f32| {
    // 5 % off; each of Heron's steps squares that.
    let guess = F32Ext::sqrt(x);
    let better = 0.5 * (guess + x / guess);
    0.5 * (better + x / better)
});
float!(Libm, f32, u32, 23, libm::sqrtf);
float!(Double, f64, u64, 52, libm::sqrt);

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Largest relative error of products, quotients and roots of numbers around 1.
    fn holds<N: Number>(a: f64, b: f64, within: f64) -> Result<(), TestCaseError> {
        let (x, y) = (N::of(a).unwrap(), N::of(b).unwrap());
        let value = |n: N| f64::from(n.output(3)) / 65_536.0 / 8.0;
        // What an output can tell apart.
        let told = 1.0 / 65_536.0 / 8.0;
        // Outputs are to the nearest for what is not negative.
        let difference = if a < b { (y - x, b - a) } else { (x - y, a - b) };
        for (got, exact) in
            [(x + y, a + b), difference, (x * y, a * b), (x / y, a / b), (x.sqrt(), a.sqrt())]
        {
            let got = value(got);
            prop_assert!((got - exact).abs() <= told + within * exact.abs(), "{got} {exact}");
        }
        Ok(())
    }

    proptest! {
        #[test]
        fn every_arithmetic_computes(a in 0.3..2.5f64, b in 0.5..2.5f64) {
            holds::<Fixed>(a, b, 3e-8)?;
            holds::<Micro>(a, b, 1e-5)?;
            holds::<Libm>(a, b, 4e-7)?;
            holds::<Double>(a, b, 1e-12)?;
        }

        #[test]
        fn what_goes_in_comes_out(bits in 0..400_000i32) {
            prop_assert_eq!(Fixed::input(bits, 0).output(0), bits);
            prop_assert_eq!(Double::input(bits, 7).output(7), bits);
            prop_assert_eq!(Libm::input(bits, 4).output(4), bits);
            prop_assert_eq!(Micro::input(bits, 4).output(4), bits);
        }
    }

    #[test]
    fn a_coefficient_beyond_the_format_is_refused() {
        assert!(Fixed::of(8.0).is_none());
        assert!(Fixed::of(-7.9).is_some());
    }
}
