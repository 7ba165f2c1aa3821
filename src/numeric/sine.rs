//! Sine and cosine.

use super::{high, horner};

/// `sin(pi x / 4) / x` in powers of `x^2 / 4` for x from 0 to 1, Q30: interpolated at the
/// Chebyshev nodes, within 2.5e-9.
const SINE: [i32; 4] = [843_314_854, -346_799_001, 42_777_991, -2_470_760];

/// `cos(pi x / 4)` likewise, within 5e-11.
const COSINE: [i32; 5] = [1_073_741_824, -1_324_675_869, 272_375_233, -22_398_329, 970_263];

/// Sine and cosine of an angle in turns / 2^32, both Q30, wrapping. Error: at most 7 LSB,
/// 6.6e-9. Source: Chebyshev interpolation on an eighth of a turn on both sides of each axis.
pub const fn sin_cos(angle: u32) -> (i32, i32) {
    // The nearest axis, and the angle from it in eighths of a turn, Q31.
    let quadrant = angle.wrapping_add(1 << 29) >> 30;
    let x = (angle.wrapping_sub(quadrant << 30) as i32) << 2;
    // x^2 / 4, Q32.
    let w = high(x, x);
    let [s0, s1, s2, s3] = SINE;
    let [c0, c1, c2, c3, c4] = COSINE;
    let sine = high(x, horner!(w; s0, s1, s2, s3)) << 1;
    let cosine = horner!(w; c0, c1, c2, c3, c4);
    match quadrant {
        0 => (sine, cosine),
        1 => (cosine, -sine),
        2 => (-sine, -cosine),
        _ => (-cosine, sine),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::lattice;

    #[test]
    fn both_are_within_their_bound_on_a_lattice() {
        let mut worst = 0.0_f64;
        for angle in lattice(0, 997) {
            let exact = f64::from(angle) / 4_294_967_296.0 * core::f64::consts::TAU;
            let (sine, cosine) = sin_cos(angle);
            let scale = f64::from(1 << 30);
            worst = worst.max((f64::from(sine) - scale * exact.sin()).abs());
            worst = worst.max((f64::from(cosine) - scale * exact.cos()).abs());
        }
        assert!((3.0..=7.0).contains(&worst), "{worst}");
    }

    #[test]
    fn the_axes_are_met() {
        let one = 1 << 30;
        for (turns, sine, cosine) in [(0_u32, 0, one), (1, one, 0), (2, 0, -one), (3, -one, 0)] {
            let got = sin_cos(turns << 30);
            assert!((got.0 - sine).abs() <= 1 && (got.1 - cosine).abs() <= 1, "{turns} {got:?}");
        }
    }
}
