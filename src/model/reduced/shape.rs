//! What geometry and load of a rig make of a run over the corner; the same in both directions.

use super::centred;
use super::direction_model::{DirectionModel, Excess, Guess, LOWEST_OCTAVE};
use crate::numeric::{fraction, high, horner, horner_with_slope, sqrt_fraction};
use crate::units::{Millimetres, MillimetresPerSecond, Newtons, Q16, Ratio};

/// A function of the centred run, a quartic.
pub(super) type Quartic = [i32; 5];

/// Least excess of a guess, Q30: the lower end of its lowest octave.
const LEAST_EXCESS: i32 = 1 << (31 - LOWEST_OCTAVE);

/// Geometry, units and load of one rig. The run r is a part of the longest one.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
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
    pub(super) cosine: [i32; 4],
    /// Gap, mm, Q27.
    pub(super) gap: [i32; 6],
    /// Depth over run, Q30.
    pub(super) depth: Quartic,
    /// Load, Q30.
    pub(super) load: i32,
    /// Largest slope and that in the middle times load, Q30: what the guess takes off every
    /// force, and what of it a scale changes.
    pub(super) most_lifting: i32,
    pub(super) middle_lifting: i32,
    /// The unit of force is a power of two: places from Q16, N, to Q30 of the unit.
    pub(super) force_places: u32,
    /// A quarter of the unit, Q16.
    pub(super) most_force: i32,
    /// Impact stress per speed, kPa s/mm, Q32.
    pub(super) stress: u32,
    /// Deflection of the arm by the unit of force, um, Q15.
    pub(super) deflection: i32,
    /// Swing that the unit of force leaves after the longest run, um s/mm, Q28.
    pub(super) swing: i32,
}

/// A run with the slope of the contact there, Q30.
#[derive(Clone, Copy, Debug)]
pub(super) struct Refined {
    pub(super) run: u32,
    pub(super) slope: i32,
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
        let bits = force.to_bits().max(0);
        bits.min(self.most_force) << self.force_places
    }

    /// Whether a force, its unscaled value or its run is beyond the model: one of four
    /// differences is negative.
    #[inline(always)]
    pub(super) fn is_at_end(&self, force: Newtons, sought: i32, run: u32) -> bool {
        let half = (run >> 1) as i32;
        let force = self.most_force.saturating_sub(force.to_bits());
        let excess = sought - self.most_lifting - LEAST_EXCESS;
        let (short, long) = (half - self.least - 1, i32::MAX - 1 - half);
        (force | excess | short | long) < 0
    }

    /// The force with the same run on the unscaled tread, Q30. A value that exceeds the format
    /// is beyond the model and saturates.
    #[inline(always)]
    pub(super) fn unscaled(&self, force: i32, inverse_scale: i32) -> i32 {
        (high(force - self.middle_lifting, inverse_scale) << 4).saturating_add(self.middle_lifting)
    }

    /// The force with the same run on the scaled tread, Q30, below one half.
    #[inline(always)]
    pub(super) fn scaled(&self, force: i32, scale: Ratio) -> i32 {
        let wide = i64::from(force - self.middle_lifting) * i64::from(scale.to_bits());
        // At most 4 times 3/4, over 16 places.
        (((wide >> 18) as i32).min((1 << 27) - 1) << 2) + self.middle_lifting
    }

    /// A part of the unit, Q30, as a force.
    #[inline(always)]
    pub(super) fn newtons(&self, part: i32) -> Newtons {
        Q16::from_bits(part >> self.force_places)
    }

    /// Run with this gap, Q32, within the model.
    #[inline(always)]
    pub(super) fn run(&self, gap: Millimetres) -> u32 {
        // Gaps up to 32 mm; the ends below bound the rest.
        let bits = gap.to_bits().clamp(0, (32 << 16) - 1);
        let part = (high(bits << 10, self.inverse_radius) as u32).min((1 << 26) - 1) << 5;
        let square = ((u64::from(part) * u64::from(part)) >> 32) as u32;
        let distance = sqrt_fraction(square.saturating_add(part << 1));
        let run = self.free.saturating_sub(distance).min(self.longest - 1);
        let normalised = run << self.longest_shift;
        let half = (u64::from(normalised) * u64::from(self.longest_inverse)) >> 32;
        ((half as u32).min(i32::MAX as u32) << 1).max(self.least_run())
    }

    /// Gap after this run, mm.
    #[inline(always)]
    pub(super) fn gap(&self, run: u32) -> Millimetres {
        let [c0, c1, c2, c3, c4, c5] = self.gap;
        let gap = horner!(centred(run); c0, c1, c2, c3, c4, c5);
        Q16::from_bits((gap + (1 << 10)) >> 11)
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
        let [c0, c1, c2, c3] = self.cosine;
        horner!(w; c0, c1, c2, c3)
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

    /// `T / C + s` of a driven wheel, from the radial reaction; a lift of more than twice the
    /// reaction counts as twice.
    #[inline(always)]
    pub(super) fn utilisation(&self, radial: i32, slope: i32) -> Ratio {
        let least = self.load >> 1;
        let radial = (radial.max(least) | 1) as u32;
        // To 15 bits, rounded; the load below four times 2^30, so that the quotient is Q15.
        let places = radial.leading_zeros();
        let divisor = ((radial << places >> 16) + 1) >> 1;
        let lifting = ((self.load as u32) << (places - 2)) / divisor;
        Q16::from_bits(((lifting << 1) as i32) + (slope >> 14))
    }

    /// Elastic force after this run with a stiffness, Q26, over the instant one; Q30, not
    /// negative.
    #[inline(always)]
    pub(super) fn elastic(&self, run: u32, stiffness: i32) -> i32 {
        let stiffness = stiffness.clamp(0, (1 << 27) - 1);
        high(self.relaxed(run) << 3, stiffness << 4) << 1
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

    /// The force beyond the lift of the load on the steepest slope, from 2^-7 to a quarter of
    /// the unit.
    #[inline(always)]
    pub(super) fn beyond_lift(&self, sought: i32) -> Excess {
        let force = (sought - self.most_lifting).clamp(LEAST_EXCESS, (1 << 28) - 1);
        let octave = (force as u32).leading_zeros();
        Excess { octave, normalised: (force as u32) << octave }
    }

    /// From a guess of the run to the run of the force `sought`, Q30.
    ///
    /// Equation: the guess and its derivative times the residual of the force there. A
    /// guess within 0.2 % with a derivative within 2 % leaves 1e-5 of the run.
    #[inline(always)]
    pub(super) fn refine(
        &self,
        model: &DirectionModel,
        x: u32,
        guess: &Guess,
        sought: i32,
        excess: &Excess,
    ) -> Refined {
        let w = centred(guess.run);
        let elastic = self.elastic(guess.run, model.stiffness(x, w));
        let [s0, s1, s2, s3, s4] = self.slope;
        let (slope, tilt) = horner_with_slope!(w; s0, s1, s2, s3, s4);
        let lacking = sought - elastic - (high(self.load, slope) << 2);
        // Less than the excess itself, which fits with one place less.
        let lacking = lacking << (excess.octave - 1);
        // Q31, as the run's half.
        let step = high(guess.by_force, lacking) << 4;
        let half = ((guess.run >> 1) as i32).saturating_add(step).max(self.least);
        let run = (half as u32) << 1;
        Refined { run, slope: slope + high(tilt, run.wrapping_sub(guess.run) as i32) }
    }

    /// Impact stress, kPa, at a speed of [`speed`].
    #[inline(always)]
    pub(super) fn impact_stress(&self, speed: u32) -> Q16 {
        Q16::from_bits(((u64::from(speed) * u64::from(self.stress)) >> 32) as i32)
    }

    /// Vibration that is left, um, at a speed of [`speed`].
    #[inline(always)]
    pub(super) fn vibration(&self, speed: u32, radial: i32, run: u32) -> Q16 {
        // Normalised; divided by 18 bits of the run, Q(p - 2), rounded to the middle.
        let speed = speed | 1;
        let places = speed.leading_zeros();
        let pace = (speed << places) / (run >> 14 | 1);
        let pace = pace << 12 | 1 << 11;
        // Q16 by 9 places for the fastest speed and one more for each half of it.
        let swing = high(radial << 3, self.swing).max(0) as u32;
        let swing = ((u64::from(swing) * u64::from(pace)) >> 32) as u32;
        let swing = (swing >> (places - 9)) as i32;
        // No more than a sudden force.
        let sudden = high(radial << 2, self.deflection) << 1;
        Q16::from_bits(swing.min(sudden))
    }
}

/// Bits of a speed, mm/s, from 0 to 128, the nearer end outside.
#[inline(always)]
pub(super) fn speed(speed: MillimetresPerSecond) -> u32 {
    speed.to_bits().clamp(0, (1 << 23) - 1) as u32
}

#[cfg(test)]
#[allow(clippy::float_arithmetic, reason = "the reference is in f64")]
mod tests {
    use super::super::ReducedModel;
    use super::*;
    use crate::model::formula::Formula;
    use crate::rig::Rig;

    fn shape_of(rig: &Rig) -> Shape {
        ReducedModel::try_build(rig).expect("a sound rig").shape
    }

    #[test]
    fn each_end_of_the_model_is_reported_alone_and_together() {
        let shape = shape_of(&Rig::prototype());
        let force = |beyond: i32| Q16::from_bits(shape.most_force + beyond);
        let sought = |beyond: i32| shape.most_lifting + LEAST_EXCESS + beyond;
        let run = |half: i32| (half as u32) << 1;
        let (short, long) = (shape.least + 1, i32::MAX - 1);
        for half in [short, 1 << 30, long] {
            assert!(!shape.is_at_end(force(0), sought(0), run(half)), "{half}");
            assert!(!shape.is_at_end(Q16::ZERO, sought(1 << 20), run(half)), "{half}");
            // The force, what is sought, or both.
            assert!(shape.is_at_end(force(1), sought(0), run(half)));
            assert!(shape.is_at_end(force(0), sought(-1), run(half)));
            assert!(shape.is_at_end(force(1), sought(-1), run(half)));
        }
        for half in [short - 1, long + 1] {
            assert!(shape.is_at_end(force(0), sought(0), run(half)), "{half}");
            assert!(shape.is_at_end(force(1), sought(0), run(half)), "{half}");
            assert!(shape.is_at_end(force(0), sought(-1), run(half)), "{half}");
            assert!(shape.is_at_end(force(1), sought(-1), run(half)), "{half}");
        }
    }

    /// The vibration after a run that is this part of the longest, by the model and by the
    /// formulas, um.
    fn vibrations(rig: &Rig, speed_bits: u32, part: f64) -> (f64, f64) {
        let shape = shape_of(rig);
        let run = (part * 4_294_967_296.0) as u32;
        let radial = 1 << 26;
        let got = shape.vibration(speed_bits, radial, run).to_num::<f64>();
        let radial_n = f64::from(radial) / f64::from(1 << shape.force_places) / 65_536.0;
        let longest_mm = f64::from(shape.longest) / 4_294_967_296.0 * rig.rig.wheel_radius_mm;
        let run_mm = f64::from(run) / 4_294_967_296.0 * longest_mm;
        let speed = f64::from(speed_bits) / 65_536.0;
        (got, 1e3 * Formula::new(rig).impact.vibration_mm(speed, radial_n, run_mm))
    }

    #[test]
    fn no_crossing_swings_more_than_a_sudden_force() {
        let mut slow = Rig::prototype();
        // An arm that swings slowly: at the fastest speed the corner is a blow to it.
        slow.drive.modes_hz = [60.0].into_iter().collect();
        let mut most = Vec::new();
        for speed in [5 << 16, 20 << 16, 60 << 16, 90 << 16, 127 << 16] {
            let (got, exact) = vibrations(&slow, speed, 0.0625);
            assert!((got / exact - 1.0).abs() < 1e-3, "{got} {exact}");
            most.push(exact);
        }
        assert!(most[3] < most[4] * 1.01 && most[0] < 0.1 * most[4], "{most:?}");
        let (blow, _) = vibrations(&slow, 127 << 16, 0.0625);
        let (same, _) = vibrations(&slow, 120 << 16, 0.0625);
        assert!((blow - same).abs() < 1e-9, "{blow} {same}");
    }

    #[test]
    fn gaps_beyond_the_model_have_the_runs_at_its_ends() {
        let shape = shape_of(&Rig::prototype());
        for wide in [20, 31, 32, 1000, 32_767] {
            assert_eq!(shape.run(Q16::from_num(wide)), shape.least_run(), "{wide}");
        }
        assert_eq!(shape.run(Q16::MAX), shape.least_run());
        assert_eq!(shape.run(Q16::MIN), shape.run(Q16::ZERO));
        assert!(shape.run(Q16::ZERO) > shape.run(Q16::ONE));
    }

    #[test]
    fn a_lift_of_more_than_twice_the_reaction_counts_as_twice() {
        let shape = shape_of(&Rig::prototype());
        for radial in [0, 1, shape.load / 4, shape.load / 2] {
            let used = shape.utilisation(radial, 0).to_num::<f64>();
            assert!((used - 2.0).abs() < 1e-3, "{radial} {used}");
        }
        let used = shape.utilisation(shape.load, 0).to_num::<f64>();
        assert!((used - 1.0).abs() < 1e-3, "{used}");
    }

    #[test]
    fn without_load_nothing_is_used_to_lift_it() {
        let mut rig = Rig::prototype();
        rig.plant.top_load_n = 0.0;
        let shape = shape_of(&rig);
        for radial in [0, 1, 2, 1 << 20, 1 << 28] {
            assert_eq!(shape.utilisation(radial, 0), Q16::ZERO, "{radial}");
        }
    }
}
