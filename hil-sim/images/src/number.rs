//! Floating-point numbers that the reduced model is computed with.

use core::ops::{Add, Div, Mul, Sub};

/// A floating-point number, on the core and on the host.
pub trait Number:
    Copy
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
{
    /// The nearest number.
    fn of(value: f64) -> Self;

    /// Square root; not a number below 0.
    fn sqrt(self) -> Self;

    fn value(self) -> f64;

    /// From the bits of a Q15.16.
    fn input(bits: i32) -> Self;

    /// To the bits of a Q15.16, rounded, saturating.
    fn output(self) -> i32;
}

macro_rules! number {
    ($float:ident, $sqrt:ident) => {
        impl Number for $float {
            #[inline(always)]
            fn of(value: f64) -> Self {
                value as Self
            }

            #[inline(always)]
            fn sqrt(self) -> Self {
                libm::$sqrt(self)
            }

            #[inline(always)]
            fn value(self) -> f64 {
                self.into()
            }

            #[inline(always)]
            fn input(bits: i32) -> Self {
                bits as Self * (1.0 / 65_536.0)
            }

            #[inline(always)]
            fn output(self) -> i32 {
                let scaled = self * 65_536.0;
                (if scaled < 0.0 { scaled - 0.5 } else { scaled + 0.5 }) as i32
            }
        }
    };
}

number!(f32, sqrtf);
number!(f64, sqrt);
