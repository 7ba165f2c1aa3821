//! The felt stiffening of one way, for one rig, step and load.

use super::centred;
use crate::numeric::{fraction, high, horner, horner_with_slope, reciprocal_of_normalised};
use crate::units::{MillimetresPerSecond, Q16};

/// Coefficients of `(s - 1)/s E`, Q23: `u^i w^j` for i/5 + j/6 at most 1, by j and then i.
pub(super) const TERMS: usize = 22;

/// Coefficients of a surface of total degree 3, by the second variable and then the first.
pub(super) const CUBIC_TERMS: usize = 10;

/// The same of total degree 5.
pub(super) const QUINTIC_TERMS: usize = 21;

/// Residual of the stiffness, Q26, beyond which there is no speed: 1 % of the instant one.
const NO_SPEED: i32 = (1 << 26) / 100;

/// Least slope of the stiffness by x that a step is taken with, Q24.
const LEAST_SLOPE: i32 = (1 << 24) / 64;

/// One way of one rig.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub(super) struct Way {
    /// Speed at which half the crossing is fast, mm/s, Q16; its normalised bits, and by
    /// how many places they were shifted.
    pub(super) half_speed: u32,
    pub(super) half_speed_normalised: u32,
    pub(super) half_speed_shift: u32,
    /// 1/s, Q26.
    pub(super) relaxed: i32,
    pub(super) felt: [i32; TERMS],
    /// Run over the root of the force by centred x and root, Q26.
    pub(super) run_guess: [i32; QUINTIC_TERMS],
    /// Relative change of the run by that of the force by centred x and root, Q26.
    pub(super) yielding: [i32; CUBIC_TERMS],
    /// Fast part by centred stiffness and run, Q26.
    pub(super) speed_guess: [i32; QUINTIC_TERMS],
}

impl Way {
    /// Part of the crossing that is fast, `v / (v + v_half)`, Q32.
    #[inline(always)]
    pub(super) fn fast_part(&self, speed: MillimetresPerSecond) -> u32 {
        let speed = speed.to_bits().max(0) as u32;
        fraction(speed, speed + self.half_speed)
    }

    /// Effective over instant stiffness at a fast part and a centred run, Q26.
    #[inline(always)]
    pub(super) fn stiffness(&self, x: u32, w: i32) -> i32 {
        #[rustfmt::skip]
        let [a0, a1, a2, a3, a4, a5, b0, b1, b2, b3, b4, c0, c1, c2, c3, d0, d1, d2, e0, e1, f0,
            g0] = self.felt;
        let u = centred(x);
        let felt = horner!(
            w;
            horner!(u; a0, a1, a2, a3, a4, a5),
            horner!(u; b0, b1, b2, b3, b4),
            horner!(u; c0, c1, c2, c3),
            horner!(u; d0, d1, d2),
            horner!(u; e0, e1),
            f0,
            g0
        );
        self.relaxed + high(felt << 4, (x >> 1) as i32)
    }

    /// The stiffening after one run, by the centred fast part.
    #[inline(always)]
    fn along_speed(&self, w: i32) -> [i32; 6] {
        #[rustfmt::skip]
        let [a0, a1, a2, a3, a4, a5, b0, b1, b2, b3, b4, c0, c1, c2, c3, d0, d1, d2, e0, e1, f0,
            g0] = self.felt;
        [
            horner!(w; a0, b0, c0, d0, e0, f0, g0),
            horner!(w; a1, b1, c1, d1, e1),
            horner!(w; a2, b2, c2, d2),
            horner!(w; a3, b3, c3),
            horner!(w; a4, b4),
            a5,
        ]
    }

    /// Guess of the run, Q32, from the fast part and the root of the force.
    #[inline(always)]
    pub(super) fn guess_run(&self, x: u32, root: u32) -> u32 {
        let per_root = quintic(&self.run_guess, centred(x), centred(root)).max(0) as u32;
        // Q26, below 1.
        let run = ((u64::from(per_root) * u64::from(root)) >> 32) as u32;
        run.min((1 << 26) - 1) << 6
    }

    /// Relative change of the run by that of the force, Q31.
    #[inline(always)]
    pub(super) fn yielding(&self, x: u32, root: u32) -> i32 {
        cubic(&self.yielding, centred(x), centred(root)) << 5
    }

    /// Speed at which the stiffness after this run is the given one, Q26; none if it is
    /// not reached. Where it is reached twice, the larger.
    #[inline(always)]
    pub(super) fn speed(&self, stiffness: i32, w: i32) -> Option<MillimetresPerSecond> {
        let terms = self.along_speed(w);
        // Stiffnesses up to that at no pause for relaxation.
        let part = (stiffness.clamp(0, (1 << 26) - 1) as u32) << 6;
        let first =
            quintic(&self.speed_guess, centred(part), w).clamp(1 << 16, (1 << 26) - (1 << 16));
        let first = (first as u32) << 6;
        let (second, _) = self.nearer(&terms, first, stiffness);
        let (x, lacking) = self.nearer(&terms, second, stiffness);
        if lacking < -NO_SPEED { None } else { Some(self.speed_of(x)) }
    }

    /// One step of Newton's method towards a stiffness, by at most a quarter, and what was
    /// lacking before it, Q26.
    #[inline(always)]
    fn nearer(&self, terms: &[i32; 6], x: u32, stiffness: i32) -> (u32, i32) {
        let (value, slope) = self.at(terms, x);
        let lacking = stiffness - value;
        let slope = slope.max(LEAST_SLOPE);
        let shift = (slope as u32).leading_zeros();
        let inverse = (reciprocal_of_normalised((slope as u32) << shift) >> 1) as i32;
        // Q26 over Q24, as Q32.
        let step = high(lacking.clamp(-slope, slope), inverse) << shift;
        (bounded(x, step), lacking)
    }

    /// Stiffness at a fast part, Q26, and its derivative by it, Q24.
    #[inline(always)]
    fn at(&self, terms: &[i32; 6], x: u32) -> (i32, i32) {
        let [c0, c1, c2, c3, c4, c5] = *terms;
        let (felt, slope) = horner_with_slope!(centred(x); c0, c1, c2, c3, c4, c5);
        let half = (x >> 1) as i32;
        (self.relaxed + high(felt << 4, half), (felt << 1) + (high(slope, half) << 2))
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

/// A fast part after a step, away from the ends.
#[inline(always)]
fn bounded(x: u32, step: i32) -> u32 {
    x.saturating_add_signed(step).clamp(1 << 16, u32::MAX - (1 << 16))
}

/// A polynomial of total degree 3 in two centred variables.
#[inline(always)]
fn cubic(terms: &[i32; CUBIC_TERMS], p: i32, q: i32) -> i32 {
    let [a0, a1, a2, a3, b0, b1, b2, c0, c1, d0] = *terms;
    horner!(
        q;
        horner!(p; a0, a1, a2, a3),
        horner!(p; b0, b1, b2),
        horner!(p; c0, c1),
        d0
    )
}

/// A polynomial of total degree 5 in two centred variables.
#[inline(always)]
fn quintic(terms: &[i32; QUINTIC_TERMS], p: i32, q: i32) -> i32 {
    #[rustfmt::skip]
    let [a0, a1, a2, a3, a4, a5, b0, b1, b2, b3, b4, c0, c1, c2, c3, d0, d1, d2, e0, e1, f0] =
        *terms;
    horner!(
        q;
        horner!(p; a0, a1, a2, a3, a4, a5),
        horner!(p; b0, b1, b2, b3, b4),
        horner!(p; c0, c1, c2, c3),
        horner!(p; d0, d1, d2),
        horner!(p; e0, e1),
        f0
    )
}
