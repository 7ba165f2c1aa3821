//! The effective stiffness in one direction, for one rig, step and load.

use super::centred;
use crate::numeric::{
    high, horner, horner_with_curvature, inverse_sqrt_guess, part_of_sum, reciprocal_of_normalised,
};
use crate::units::{MillimetresPerSecond, Q16};

/// Coefficients of `(s - 1)/s E`, Q23: `u^i w^j` for i/5 + j/6 at most 1, by j and then i.
pub(super) const TERMS: usize = 22;

/// Equal parts of the range of x, and half octaves of the force, with a guess of the run
/// each; lowest octave of them as leading zeros of the force, Q30.
pub(super) const FAST_CELLS: usize = 4;
pub(super) const FORCE_CELLS: usize = 10;
pub(super) const LOWEST_OCTAVE: u32 = 8;

/// Coefficients of a guess of the run in its cell, Q14: `u^i m^j`, by the mantissa m of
/// the force and then the part u of the range of x: 4, 3 and 3 of them, two to a word.
pub(super) type RunCell = [Pair; 5];

/// What a force exceeds the lift of the load on the steepest slope by: it goes nearly with
/// the square of the run.
#[derive(Clone, Copy, Debug)]
pub(super) struct Excess {
    /// Leading zeros of its Q30, and that without them.
    pub(super) octave: u32,
    pub(super) normalised: u32,
}

/// Two numbers of 16 bits in a word: half the memory accesses. The upper one is read with the
/// lower one as its fraction, half a unit at most: no more than it was rounded by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub(super) struct Pair(#[serde(with = "postcard::fixint::le")] i32);

impl Pair {
    /// Of an upper and a lower number.
    pub(super) const fn new(upper: i16, lower: i16) -> Self {
        Self(((upper as i32) << 16).wrapping_add(lower as i32))
    }

    /// Both, 2^16 times.
    #[inline(always)]
    const fn both(self) -> (i32, i32) {
        (self.0, self.0 << 16)
    }
}

/// Equal parts of the range of the stiffness with a guess of the speed each.
pub(super) const STIFFNESS_CELLS: usize = 8;

/// Coefficients of a guess of the fast part in its cell, Q26: by the run and then the
/// stiffness, 3, 2 and 1 of them.
pub(super) type SpeedCell = [i32; 6];

/// What the square of a slope lacks to reach down to a stiffness, Q24, beyond which there is
/// no speed: 1/256, where the stiffness stays some 6e-4 of the instant one above it.
const NO_SPEED: i32 = (1 << 24) / 256;

/// Least mean slope of the stiffness by x, Q27, that a step is taken with.
const LEAST_SLOPE: i32 = 1 << 21;

/// One direction of one rig.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub(super) struct DirectionModel {
    /// Speed at which half the crossing is fast, mm/s, Q16; its normalised bits, and by
    /// how many places they were shifted.
    pub(super) half_speed: u32,
    pub(super) half_speed_normalised: u32,
    pub(super) half_speed_shift: u32,
    /// 1/s, Q26.
    pub(super) relaxed: i32,
    pub(super) stiffening: [i32; TERMS],
    pub(super) run_cells: [[RunCell; FORCE_CELLS]; FAST_CELLS],
    pub(super) speed_cells: [SpeedCell; STIFFNESS_CELLS],
}

/// Guess of the run.
#[derive(Clone, Copy, Debug)]
pub(super) struct Guess {
    /// The run, Q32.
    pub(super) run: u32,
    /// Its derivative by the mantissa of the force, a half octave being 1, Q30.
    pub(super) by_force: i32,
}

impl DirectionModel {
    /// Part of the crossing that is fast at the bits of a speed, `v / (v + v_half)`, Q32.
    #[inline(always)]
    pub(super) fn fast_part(&self, speed: u32) -> u32 {
        part_of_sum(speed, self.half_speed)
    }

    /// Effective over instant stiffness at a fast part and a centred run, Q26.
    #[inline(always)]
    pub(super) fn stiffness(&self, x: u32, w: i32) -> i32 {
        #[rustfmt::skip]
        let [a0, a1, a2, a3, a4, a5, b0, b1, b2, b3, b4, c0, c1, c2, c3, d0, d1, d2, e0, e1, f0,
            g0] = self.stiffening;
        let u = centred(x);
        let stiffening = horner!(
            w;
            horner!(u; a0, a1, a2, a3, a4, a5),
            horner!(u; b0, b1, b2, b3, b4),
            horner!(u; c0, c1, c2, c3),
            horner!(u; d0, d1, d2),
            horner!(u; e0, e1),
            f0,
            g0
        );
        self.relaxed + high(stiffening << 4, (x >> 1) as i32)
    }

    /// The stiffening after one run, by the centred fast part.
    #[inline(always)]
    fn along_speed(&self, w: i32) -> [i32; 6] {
        #[rustfmt::skip]
        let [a0, a1, a2, a3, a4, a5, b0, b1, b2, b3, b4, c0, c1, c2, c3, d0, d1, d2, e0, e1, f0,
            g0] = self.stiffening;
        [
            horner!(w; a0, b0, c0, d0, e0, f0, g0),
            horner!(w; a1, b1, c1, d1, e1),
            horner!(w; a2, b2, c2, d2),
            horner!(w; a3, b3, c3),
            horner!(w; a4, b4),
            a5,
        ]
    }

    /// Guess of the run, Q32, from the fast part and what the force exceeds the lift by.
    #[inline(always)]
    pub(super) fn guess_run(&self, x: u32, excess: &Excess) -> Guess {
        let half = excess.normalised >> 30 & 1;
        let row = (2 * (LOWEST_OCTAVE - excess.octave) + half) as usize;
        // Both are in range; the bounds are for the compiler.
        let cells = &self.run_cells[(x >> 30) as usize % FAST_CELLS];
        let [p, q, r, s, t] = cells[row.min(FORCE_CELLS - 1)];
        let (u, m) = (centred(x << 2), centred(excess.normalised << 2));
        let ((a0, a1), (a2, a3)) = (p.both(), q.both());
        let level = horner!(u; a0, a1, a2, a3);
        let ((b0, b1), (b2, c0), (c1, c2)) = (r.both(), s.both(), t.both());
        let bend = high(horner!(u; c0, c1, c2), m);
        let rise = horner!(u; b0, b1, b2) + bend;
        let run = level + high(rise, m);
        Guess { run: (run.clamp(0, (1 << 30) - 1) as u32) << 2, by_force: rise + bend }
    }

    /// Speed at which the stiffness after this run is the given one, Q26; none if it is
    /// not reached. Where it is reached twice, the larger.
    ///
    /// Equation: from a guess, the step `2 d / (S' + sqrt(S'^2 + 2 S'' d))` to where the
    /// parabola has the residual d made up for, which holds up to where the stiffness is
    /// least.
    #[inline(always)]
    pub(super) fn speed(&self, stiffness: i32, w: i32) -> Option<MillimetresPerSecond> {
        let [c0, c1, c2, c3, c4, c5] = self.along_speed(w);
        let guess = self.guess_fast_part(stiffness, w);
        let (value, slope, bend) = horner_with_curvature!(centred(guess); c0, c1, c2, c3, c4, c5);
        let half = (guess >> 1) as i32;
        let lacking = stiffness - self.relaxed - high(value << 4, half);
        // Of the stiffness by x: derivative, Q24, and half the second, Q23.
        let bend = slope + (high(bend, half) << 1);
        let slope = (value << 1) + (high(slope, half) << 2);
        let half = half.saturating_add(step(slope, bend, lacking)?).max(1 << 15);
        Some(self.speed_of((half as u32) << 1))
    }

    /// Guess of the fast part, Q32, from the stiffness and the run.
    #[inline(always)]
    fn guess_fast_part(&self, stiffness: i32, w: i32) -> u32 {
        // Stiffnesses up to the instant one.
        let part = (stiffness.clamp(0, (1 << 26) - 1) as u32) << 6;
        let [a0, a1, a2, b0, b1, c0] = self.speed_cells[(part >> 29) as usize % STIFFNESS_CELLS];
        let p = centred(part << 3);
        let x = horner!(w; horner!(p; a0, a1, a2), horner!(p; b0, b1), c0);
        (x.clamp(1 << 10, (1 << 26) - (1 << 10)) as u32) << 6
    }

    /// Speed at this fast part, `v_half x / (1 - x)`, saturating.
    #[inline(always)]
    fn speed_of(&self, x: u32) -> MillimetresPerSecond {
        let slow = (!x).max(1);
        let shift = slow.leading_zeros();
        let inverse = reciprocal_of_normalised(slow << shift);
        let upper = |a: u32, b: u32| ((u64::from(a) * u64::from(b)) >> 32) as u32;
        let bits = upper(upper(self.half_speed_normalised, x), inverse);
        let places = self.half_speed_shift as i32 - 1 - shift as i32;
        let bits = if places >= 0 { bits >> places } else { u32::MAX };
        Q16::from_bits(bits.min(i32::MAX as u32) as i32)
    }
}

/// The step of x, Q31, that makes up for a lacking stiffness, Q26, from its slope, Q24, and
/// half its second derivative, Q23; by a quarter at most. None where the parabola stays
/// above.
#[inline(always)]
fn step(slope: i32, bend: i32, lacking: i32) -> Option<i32> {
    // Up to 8, 32 and a quarter: to the next power of two, which takes one instruction.
    let slope = slope.clamp(-(1 << 27), (1 << 27) - 1) << 4;
    let bend = bend.clamp(-(1 << 28), (1 << 28) - 1) << 2;
    let lacking = lacking.clamp(-(1 << 24), (1 << 24) - 1) << 6;
    // Q24.
    let square = high(slope, slope) + (high(bend, lacking) << 1);
    if square < -NO_SPEED {
        return None;
    }
    let square = square.max(0) as u32;
    let (shift, inverse) = inverse_sqrt_guess(square);
    let root = ((u64::from(square << shift) * u64::from(inverse << 1)) >> 32) as u32;
    // Half the sum, Q27, then Q14.
    let mean = ((slope >> 2) + (root >> (shift / 2)) as i32).max(LEAST_SLOPE) as u32 >> 13;
    Some((lacking / mean as i32).clamp(-(1 << 16), (1 << 16) - 1) << 13)
}

#[cfg(test)]
#[allow(clippy::float_arithmetic, reason = "the reference is in f64")]
mod tests {
    use super::*;

    #[test]
    fn a_steeper_stiffness_takes_a_smaller_step() {
        // Of x, Q31, to make up for 1/64 of the instant stiffness.
        let lacking = 1 << 20;
        let steps: Vec<i32> = [1 << 22, 1 << 24, 1 << 26, (1 << 27) - 1, 1 << 27, i32::MAX]
            .map(|slope| step(slope, 0, lacking).expect("a step"))
            .into();
        assert!(
            steps.iter().all(|step| *step > 0) && steps.is_sorted_by(|a, b| a >= b),
            "{steps:?}"
        );
        // A line: what lacks over its slope, 2^20 / 2^26 over 2^26 / 2^24, Q31.
        let exact = 1 << 23;
        assert!((steps[2] - exact).abs() < exact / 100, "{steps:?}");
    }

    #[test]
    fn no_step_is_longer_than_a_quarter() {
        for lacking in [i32::MAX, 1 << 24, -(1 << 24), i32::MIN] {
            let taken = step(1 << 10, 0, lacking).expect("a step");
            assert_eq!(taken > 0, lacking > 0);
            assert!(taken.unsigned_abs() <= 1 << 29, "{taken}");
            assert!(taken.unsigned_abs() > (1 << 29) - (1 << 14), "{taken}");
        }
    }

    #[test]
    fn a_stiffness_that_the_parabola_does_not_reach_takes_none() {
        assert_eq!(step(0, -(1 << 24), 1 << 22), None);
        assert_eq!(step(1 << 20, -(1 << 26), 1 << 23), None);
        assert!(step(0, 1 << 24, 1 << 22).is_some());
    }

    #[test]
    fn where_the_stiffness_falls_with_speed_the_parabola_s_other_side_is_taken() {
        // Slope S', half the second derivative S''/2, and what lacks; the step by its equation.
        for (slope, bend, lacking) in [(-0.25, 2.0, 0.03125), (-0.5, 4.0, 0.03125)] {
            let bits = |value: f64, places: i32| (value * f64::powi(2.0, places)) as i32;
            let taken = step(bits(slope, 24), bits(bend, 23), bits(lacking, 26));
            let taken = f64::from(taken.expect("a step")) / f64::powi(2.0, 31);
            let root = f64::sqrt(slope * slope + 4.0 * bend * lacking);
            let exact = 2.0 * lacking / (slope + root);
            assert!((taken / exact - 1.0).abs() < 0.02, "{taken} {exact}");
        }
    }
}
