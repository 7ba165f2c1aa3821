//! Products and polynomials on the upper half of a 32 x 32 bit product, the one
//! multiplication of the core that keeps all 32 bits of its operands.

/// Upper half of a product, `floor(a b / 2^32)`. A factor `t` that represents `t / 2^32` leaves
/// the format of the other factor as it is.
#[inline(always)]
pub const fn high(a: i32, b: i32) -> i32 {
    ((a as i64 * b as i64) >> 32) as i32
}

/// The same of two numbers without a sign.
#[inline(always)]
pub const fn high_unsigned(a: u32, b: u32) -> u32 {
    ((a as u64 * b as u64) >> 32) as u32
}

/// Polynomial `c0 + c1 t + c2 t^2 + ...` for `t / 2^32` from -1/2 to 1/2, by Horner's rule.
///
/// Coefficients and value in one format. Range: the sum `|c0| + |c1|/2 + |c2|/4` and so on is
/// below 2^31, from each coefficient on. Error: below 2 LSB, as each step's truncation is at least
/// halved by the next.
macro_rules! horner {
    ($t:expr; $c:expr) => { $c };
    ($t:expr; $c:expr, $($rest:expr),+) => {
        $c + $crate::numeric::high($crate::numeric::horner!($t; $($rest),+), $t)
    };
}

pub(crate) use horner;

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(5_000))]

        #[test]
        fn the_upper_half_is_the_floor(a in any::<i32>(), b in any::<i32>()) {
            let exact = (i128::from(a) * i128::from(b)).div_euclid(1 << 32);
            prop_assert_eq!(i128::from(high(a, b)), exact);
        }

        #[test]
        fn polynomials_are_within_their_bounds(
            c in prop::array::uniform7(any::<i32>()),
            shift in 1_u32..8,
            t in prop_oneof![Just(i32::MIN), Just(i32::MAX), any::<i32>()],
        ) {
            let c = c.map(|x| x >> shift);
            let reach = |from: usize| {
                c[from..].iter().rev().fold(0.0, |sum, &c| 0.5 * sum + f64::from(c).abs())
            };
            prop_assume!((0..7).all(|from| reach(from) < 2f64.powi(31) - 2.0));
            let [a, b, d, e, f, g, h] = c;
            let x = f64::from(t) / 2f64.powi(32);
            let exact = c.iter().rev().fold(0.0, |sum, &c| sum * x + f64::from(c));
            let got = f64::from(horner!(t; a, b, d, e, f, g, h));
            prop_assert!((got - exact).abs() < 2.0, "{got} {exact}");
        }
    }
}
