//! What a rig's geometry and load make of a run over the corner; the same on both ways.

use super::centred;
use crate::numeric::{fraction, high, horner, inverse_sqrt_normalised, sqrt_fraction};
use crate::units::{Millimetres, MillimetresPerSecond, Newtons, Q16, Ratio};

/// A function of the centred run, a quartic.
pub(super) type Quartic = [i32; 5];

/// Fastest speed that vibration and impact tell apart, 2048 mm/s.
const MOST_SPEED: i32 = 2048 << 16;

/// Geometry, units and load of one rig. The run r is a part of the longest one.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub(super) struct Shape {
    /// Free run over R, Q32.
    pub(super) free: u32,
    /// Longest run over R, Q32.
    pub(super) longest: u32,
    /// Places that bring the longest run to one half or more, and the reciprocal of
    /// that, Q31.
    pub(super) longest_shift: u32,
    pub(super) longest_inverse: u32,
    /// Shortest run, Q31.
    pub(super) least: i32,
    /// R/2, mm, Q19, and 1/R, 1/mm, Q33.
    pub(super) half_radius: i32,
    pub(super) inverse_radius: i32,
    /// Relaxed force over `r^2`, Q29.
    pub(super) force: Quartic,
    /// Slope of the contact, axial over radial, Q30.
    pub(super) slope: Quartic,
    /// Radial reaction over the driven wheel's elastic force, `1 / (1 + s^2)`, Q30; 1 if
    /// pushed.
    pub(super) cosine: Quartic,
    /// `2 R gap / d^2`, Q30.
    pub(super) gap: Quartic,
    /// Depth over run, Q30.
    pub(super) depth: Quartic,
    /// Load, Q30.
    pub(super) load: i32,
    /// Largest slope and that in the middle times load, Q30: what the guess takes off every
    /// force, and what of it a scale changes.
    pub(super) most_lifting: i32,
    pub(super) middle_lifting: i32,
    /// Unit of force: its bits of Q16 are brought to 2^30 and more by this shift; these,
    /// and 2^61 over them.
    pub(super) unit_shift: u32,
    pub(super) unit: i32,
    pub(super) inverse_unit: i32,
    /// A quarter of the unit, Q16.
    pub(super) most_force: i32,
    /// Impact stress per speed, kPa s/mm, Q32.
    pub(super) stress: i32,
    /// `2 / (omega longest run)`, s/mm, Q32.
    pub(super) ramp: u32,
    /// Unit of force over the arm's stiffness, um: Q16 brought to 2^30 and more, and by
    /// how many places the product with a force and a part of a whole is too large.
    pub(super) deflection: i32,
    pub(super) deflection_shift: u32,
}

/// A force and twice its root.
#[derive(Clone, Copy, Debug)]
pub(super) struct Root {
    /// The force, Q30.
    force: i32,
    /// Twice its root, Q32.
    pub(super) root: u32,
    /// Inverse of the root, normalised by an even shift, Q29.
    inverse: u32,
    shift: u32,
}

impl Shape {
    /// Shortest run, Q32.
    pub(super) const fn least_run(&self) -> u32 {
        (self.least as u32) << 1
    }

    /// Longest run, Q32.
    pub(super) const fn most_run(&self) -> u32 {
        (i32::MAX as u32) << 1
    }

    /// A force as part of the unit, Q30, from 0 to a quarter: beyond what the longest run
    /// takes at rest.
    #[inline(always)]
    pub(super) fn part(&self, force: Newtons) -> i32 {
        let bits = force.to_bits().min(self.most_force).max(0);
        high(bits << self.unit_shift, self.inverse_unit) << 1
    }

    /// Whether a force exceeds what [`part`](Self::part) can tell.
    #[inline(always)]
    pub(super) fn is_beyond(&self, force: Newtons) -> bool {
        force.to_bits() > self.most_force
    }

    /// What force has the same run on the unscaled tread, Q30; what exceeds the format
    /// lies beyond the model anyway and saturates.
    #[inline(always)]
    pub(super) fn unscaled(&self, force: i32, inverse_scale: i32) -> i32 {
        (high(force - self.middle_lifting, inverse_scale) << 4).saturating_add(self.middle_lifting)
    }

    /// What force has the same run on the scaled tread, Q30, below one half.
    #[inline(always)]
    pub(super) fn scaled(&self, force: i32, scale: Ratio) -> i32 {
        let wide = i64::from(force - self.middle_lifting) * i64::from(scale.to_bits());
        // At most 4 times 3/4, over 16 places.
        (((wide >> 18) as i32).min((1 << 27) - 1) << 2) + self.middle_lifting
    }

    /// A part of the unit, Q30, as a force.
    #[inline(always)]
    pub(super) fn newtons(&self, part: i32) -> Newtons {
        Q16::from_bits(high(part, self.unit) >> (self.unit_shift - 2))
    }

    /// Run with this gap, Q32, within the model.
    #[inline(always)]
    pub(super) fn run(&self, gap: Millimetres) -> u32 {
        // Gaps up to 32 mm; the ends below hold what is beyond.
        let bits = gap.to_bits().clamp(0, (32 << 16) - 1);
        let part = (high(bits << 10, self.inverse_radius) as u32).min((1 << 26) - 1) << 5;
        let square = ((u64::from(part) * u64::from(part)) >> 32) as u32;
        let distance = sqrt_fraction(square.saturating_add(part << 1));
        let run = self.free.saturating_sub(distance).min(self.longest - 1);
        let normalised = run << self.longest_shift;
        let part = (u64::from(normalised) * u64::from(self.longest_inverse)) >> 31;
        (part.min(u64::from(self.most_run())) as u32).max(self.least_run())
    }

    /// Distance of the wheel's centre from the face over R, Q32.
    #[inline(always)]
    fn distance(&self, run: u32) -> u32 {
        self.free - ((u64::from(run) * u64::from(self.longest)) >> 32) as u32
    }

    /// Gap after this run, mm.
    #[inline(always)]
    pub(super) fn gap(&self, run: u32) -> Millimetres {
        let [c0, c1, c2, c3, c4] = self.gap;
        let distance = self.distance(run);
        let square = ((u64::from(distance) * u64::from(distance)) >> 33) as i32;
        let twice = high(square, horner!(centred(run); c0, c1, c2, c3, c4));
        Q16::from_bits(((i64::from(twice) * i64::from(self.half_radius) + (1 << 31)) >> 32) as i32)
    }

    /// Depth after this run, mm.
    pub(super) fn depth(&self, run: u32) -> Millimetres {
        let [c0, c1, c2, c3, c4] = self.depth;
        let over_radius = ((u64::from(run) * u64::from(self.longest)) >> 33) as i32;
        let depth = high(over_radius, horner!(centred(run); c0, c1, c2, c3, c4));
        Q16::from_bits(high(depth, self.half_radius) << 1)
    }

    /// Slope of the contact, Q30.
    #[inline(always)]
    pub(super) fn slope(&self, w: i32) -> i32 {
        let [c0, c1, c2, c3, c4] = self.slope;
        horner!(w; c0, c1, c2, c3, c4)
    }

    /// Radial reaction over elastic force, Q30.
    #[inline(always)]
    pub(super) fn cosine(&self, w: i32) -> i32 {
        let [c0, c1, c2, c3, c4] = self.cosine;
        horner!(w; c0, c1, c2, c3, c4)
    }

    /// What the lift of the load adds to the radial force, Q30.
    #[inline(always)]
    pub(super) fn lifting(&self, w: i32) -> i32 {
        high(self.load, self.slope(w)) << 2
    }

    /// Radial reaction under this force, Q30, not negative.
    #[inline(always)]
    pub(super) fn radial_part(&self, force: i32, slope: i32, w: i32) -> i32 {
        let elastic = force - (high(self.load, slope) << 2);
        high(elastic.max(0), self.cosine(w)) << 2
    }

    /// `T / C + s` of a driven wheel, from the radial reaction.
    #[inline(always)]
    pub(super) fn utilisation(&self, radial: i32, slope: i32) -> Ratio {
        // Q30 to Q34 over Q18. A reaction below 4e-6 is none.
        let lifting = ((self.load as u32) << 4) / ((radial >> 12) as u32 | 1);
        Q16::from_bits((lifting.min(1 << 24) as i32) + (slope >> 14))
    }

    /// Elastic force after this run with a stiffness, Q26, over the instant one; Q30, not
    /// negative.
    #[inline(always)]
    pub(super) fn elastic(&self, run: u32, stiffness: i32) -> i32 {
        let wide = i64::from(self.relaxed(run)) * i64::from(stiffness.clamp(0, (1 << 27) - 1));
        ((wide >> 24) as i32).clamp(0, (1 << 29) - 1)
    }

    /// Stiffness over the instant one that carries an elastic force, Q30, after this run;
    /// Q26, 2 at most.
    #[inline(always)]
    pub(super) fn stiffness_for(&self, elastic: i32, run: u32) -> i32 {
        let relaxed = self.relaxed(run).max(1) as u32;
        (fraction(elastic.max(0) as u32, relaxed << 3) >> 5) as i32
    }

    /// Relaxed force after this run, Q28, below 1.
    #[inline(always)]
    fn relaxed(&self, run: u32) -> i32 {
        let [a0, a1, a2, a3, a4] = self.force;
        let half = (run >> 1) as i32;
        let quartic = horner!(centred(run); a0, a1, a2, a3, a4);
        high(high(half, half) << 1, quartic).clamp(0, (1 << 28) - 1)
    }

    /// The force beyond the lift of the load on the steepest slope, which goes nearly with
    /// the square of the run; up to a quarter of the unit.
    #[inline(always)]
    pub(super) fn beyond_lift(&self, sought: i32) -> Root {
        // From 0.06 N on the published wheel, so that the shifts below stay small.
        let force = (sought - self.most_lifting).clamp(1 << 16, (1 << 28) - 1);
        let (shift, inverse) = inverse_sqrt_normalised((force as u32) << 4);
        let normalised = (force as u32) << 4 << shift;
        let root = ((u64::from(normalised) * u64::from(inverse << 1)) >> 32) as u32;
        Root { force, root: (root << 2) >> (shift / 2), inverse, shift }
    }

    /// From a guess of the run to the run of the force `sought`, Q30.
    ///
    /// With the relative residual y of the force and what run and force change in
    /// proportion by, N, a power law gives `dr/r = N y (1 + (1 + N)/2 y)` to third order.
    #[inline(always)]
    pub(super) fn refine(
        &self,
        guess: u32,
        sought: i32,
        beyond: &Root,
        stiffness: i32,
        yielding: i32,
    ) -> u32 {
        let w = centred(guess);
        let lacking = sought - self.elastic(guess, stiffness) - self.lifting(w);
        let limit = beyond.force >> 2;
        let lacking = lacking.clamp(-limit, limit);
        // Over four times the force, whose inverse is that of the root, squared. Q30.
        let inverse = ((u64::from(beyond.inverse) * u64::from(beyond.inverse)) >> 32) as i32;
        let residual = high(lacking, inverse) << (8 + beyond.shift);
        let first = high(residual, yielding);
        let second = high(residual, -(1 << 30) - (yielding >> 1));
        let part = first - (high(first << 2, second) << 1);
        // Q31, which saturates where the run ends.
        let half = (guess >> 1) as i32;
        let half = half.saturating_add(high(part, half) << 3);
        (half.max(self.least) as u32) << 1
    }

    /// Impact stress, kPa.
    #[inline(always)]
    pub(super) fn impact_stress(&self, speed: MillimetresPerSecond) -> Q16 {
        Q16::from_bits(high(speed.to_bits().clamp(0, MOST_SPEED), self.stress))
    }

    /// Vibration that is left, um.
    #[inline(always)]
    pub(super) fn vibration(&self, speed: MillimetresPerSecond, radial: i32, run: u32) -> Q16 {
        // From 0.008 mm/s, brought to the top; over the run, Q16, that leaves 23 bits.
        let speed = speed.to_bits().clamp(1 << 9, MOST_SPEED) as u32;
        let places = speed.leading_zeros();
        let pace = (speed << places) / (run >> 16 | 1);
        let ramp = ((u64::from(pace << 9) * u64::from(self.ramp)) >> 32) as u32;
        // Times 2^(9 + places); what is left of a sudden force, Q31.
        let ramp = (ramp.min((1 << (9 + places)) - 1) << (22 - places)) as i32;
        let still = high(radial, self.deflection);
        Q16::from_bits((high(still, ramp) << 4) >> self.deflection_shift)
    }
}
