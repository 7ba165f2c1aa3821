//! The reduced model in fixed point: forward (speed and force to gap and what follows from it)
//! and inverse (gap to force, gap and force to speed).
//!
//! For one rig the fitted polynomial depends on speed and run alone. Both inverses are the zero
//! of one polynomial, found in one step from a guess: a low polynomial in its cell of speed and
//! force, or of stiffness. Lengths over R and parts are unsigned Q32, forces over the unit of
//! `Shape` Q30.

#![deny(clippy::float_arithmetic)]

#[allow(clippy::float_arithmetic, reason = "SI to machine units, once at start")]
mod build;
mod direction_model;
mod shape;

use crate::numeric::{divide, fraction, high};
use crate::units::{Direction, Millimetres, MillimetresPerSecond, Newtons, Q16, Ratio};

use direction_model::DirectionModel;
use shape::{Refined, Shape};

/// Estimated over nominal stiffness of the tread, 1/4 to 4, with its reciprocal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Scale {
    ratio: Ratio,
    /// Q28.
    inverse: i32,
}

impl Scale {
    /// Nominal stiffness.
    pub const NOMINAL: Self = Self { ratio: Ratio::ONE, inverse: 1 << 28 };

    /// From the ratio.
    pub fn new(ratio: Ratio) -> Self {
        let bits = ratio.to_bits().clamp(1 << 14, 1 << 18);
        // 2^44 over the bits, in two digits of 31 and 13 places.
        let divisor = bits as u32;
        let (digit, rest) = ((1 << 31) / divisor, (1 << 31) % divisor);
        let inverse = ((digit << 13) + (rest << 13) / divisor) as i32;
        Self { ratio: Ratio::from_bits(bits), inverse }
    }

    /// The ratio.
    pub const fn ratio(self) -> Ratio {
        self.ratio
    }
}

/// The reduced model of one rig under one load.
///
/// Range: 0 to 128 mm/s; forces from 2^-7 to a quarter of the unit, 8 to 256 N, beyond the
/// lift of the load; the nearer end outside. Error against
/// [`Formula`](super::formula::Formula) over 1 to
/// 100 mm/s, 15 to 150 N and steps of 2 to 6 mm, beyond one LSB, relative: force of a gap 5e-6, gap
/// of a force 1e-5, corner force 5e-5, vibration 1e-4; utilisation 1e-4 absolute; force at the
/// speed of the inverse 0.2 %. Pushed over 2 mm: gap 1e-3, speed 0.4 %.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ReducedModel {
    shape: Shape,
    directions: [DirectionModel; 2],
    /// Friction drives the wheel; a wheel that is pushed needs none.
    driven: bool,
    /// Friction of tread on wall.
    friction: Ratio,
}

/// A crossing's working point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Direction.
    pub direction: Direction,
    /// Speed at lift-off, mm/s, not negative.
    pub speed: MillimetresPerSecond,
    /// Estimated over nominal stiffness of the tread.
    pub scale: Scale,
    /// Axial load beyond that of the model, N. Its lift is in the equations, its part in the
    /// fitted stiffness is not.
    pub extra_load: Newtons,
}

impl Point {
    /// A point of the rig as known.
    pub const fn nominal(direction: Direction, speed: MillimetresPerSecond) -> Self {
        Self { direction, speed, scale: Scale::NOMINAL, extra_load: Newtons::ZERO }
    }
}

/// A crossing by the model, see [`formula::Crossing`](super::formula::Crossing).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// Clearance at the root of the step, mm.
    pub gap: Millimetres,
    /// Axial force of the step's contact on the wheel, N.
    pub corner_force: Newtons,
    /// Stress increment of the first touch, kPa.
    pub impact_stress_kpa: Q16,
    /// Amplitude of the arm's first mode afterwards, um.
    pub vibration_um: Q16,
    /// Friction that lifting the load uses; 0 if pushed.
    pub utilisation: Ratio,
    /// Friction left unused.
    pub slip_margin: Ratio,
    /// Whether the gap is that at an end of the model, not that of the force.
    pub at_end: bool,
}

impl ReducedModel {
    /// Least and largest gap of the model, mm.
    pub fn gap_range(&self) -> (Millimetres, Millimetres) {
        (self.shape.gap(self.shape.most_run()), self.shape.gap(self.shape.least_run()))
    }

    /// Everything about the crossing at this radial force, N: the run r with `F(x, r) + T s(r)
    /// = P` by one step from a guess; then
    /// [`Formula::crossing`](super::formula::Formula::crossing).
    pub fn crossing(&self, point: &Point, force: Newtons) -> Crossing {
        let (shape, model) = (&self.shape, self.direction(point.direction));
        // The slope of the contact changes by 0.04 from 1.9 to 2.7 mm of gap.
        let force = force - point.extra_load * slope_q16(shape.slope(0));
        let wanted = shape.part(force);
        let sought = shape.unscaled(wanted, point.scale.inverse);
        let speed = shape::speed(point.speed);
        let x = model.fast_part(speed);
        let excess = shape.beyond_lift(sought);
        let guess = model.guess_run(x, &excess);
        let Refined { run, slope } = shape.refine(model, x, &guess, sought, &excess);
        let w = centred(run);
        let radial = shape.radial_part(wanted, slope, w);
        let corner_force = shape.newtons(high(radial, slope) << 2);
        let utilisation = self.used(point, radial, slope);
        let vibration_um = shape.vibration(speed, radial, run);
        Crossing {
            gap: shape.gap(run),
            corner_force,
            impact_stress_kpa: shape.impact_stress(speed),
            vibration_um,
            utilisation,
            slip_margin: self.friction - utilisation,
            at_end: shape.is_at_end(force, sought, run),
        }
    }

    /// Gap under this radial force, mm.
    pub fn gap(&self, point: &Point, force: Newtons) -> Millimetres {
        self.crossing(point, force).gap
    }

    /// Radial force that gives this gap, N: `F + T s`, scaled.
    pub fn force(&self, point: &Point, gap: Millimetres) -> Newtons {
        let run = self.shape.run(gap);
        self.shape.newtons(self.force_part(point, run)) + self.extra_lift(point, run)
    }

    /// Friction that lifting the load uses at this gap: `T / C + s`; 0 if pushed.
    pub fn utilisation(&self, point: &Point, gap: Millimetres) -> Ratio {
        let run = self.shape.run(gap);
        let force = self.force_part(point, run);
        let slope = self.shape.slope(centred(run));
        self.used(point, self.shape.radial_part(force, slope, centred(run)), slope)
    }

    /// Largest speed from `floor` to `ceiling` at which `force` still holds the gap, mm/s;
    /// `floor` if none does. Equation: the fast part x with `F(x, r) = P - T s` by one step
    /// from a polynomial guess; then `v = v_half x / (1 - x)`.
    pub fn speed(
        &self,
        point: &Point,
        gap: Millimetres,
        force: Newtons,
        floor: MillimetresPerSecond,
        ceiling: MillimetresPerSecond,
    ) -> MillimetresPerSecond {
        let (shape, model) = (&self.shape, self.direction(point.direction));
        let run = shape.run(gap);
        let w = centred(run);
        let force = force - self.extra_lift(point, run);
        let sought = shape.unscaled(shape.part(force), point.scale.inverse);
        let stiffness = shape.stiffness_for(sought - shape.lifting(w), run);
        match model.speed(stiffness, w) {
            Some(speed) => speed.min(ceiling).max(floor),
            None => floor,
        }
    }

    /// Scale of the stiffness that explains this gap under this radial force.
    pub fn observed_scale(&self, point: &Point, gap: Millimetres, force: Newtons) -> Ratio {
        let nominal = Point { scale: Scale::NOMINAL, ..*point };
        let shape = &self.shape;
        let run = shape.run(gap);
        let force = force - self.extra_lift(point, run);
        let nominal = self.force_part(&nominal, run) - shape.middle_lifting;
        let excess = (shape.part(force) - shape.middle_lifting).max(0);
        // Of four times the nominal force, so up to 4.
        let part = fraction((excess as u32) >> 2, nominal.max(1) as u32);
        Q16::from_bits((part >> 14) as i32)
    }

    /// Tread depth at the corner at lift-off, mm.
    pub fn depth(&self, gap: Millimetres) -> Millimetres {
        self.shape.depth(self.shape.run(gap))
    }

    /// Radial force after this run, Q30.
    #[inline(always)]
    fn force_part(&self, point: &Point, run: u32) -> i32 {
        let (shape, model) = (&self.shape, self.direction(point.direction));
        let w = centred(run);
        let stiffness = model.stiffness(model.fast_part(shape::speed(point.speed)), w);
        let force = shape.elastic(run, stiffness) + shape.lifting(w);
        shape.scaled(force, point.scale.ratio)
    }

    /// What the lift of the load beyond the model's adds to the radial force, N.
    fn extra_lift(&self, point: &Point, run: u32) -> Newtons {
        point.extra_load * slope_q16(self.shape.slope(centred(run)))
    }

    /// Friction used under a radial reaction on this slope, both Q30.
    #[inline(always)]
    fn used(&self, point: &Point, radial: i32, slope: i32) -> Ratio {
        if !self.driven {
            return Ratio::ZERO;
        }
        let more = divide(point.extra_load, self.shape.newtons(radial));
        self.shape.utilisation(radial, slope) + more
    }

    /// Coefficients of a direction.
    #[inline(always)]
    fn direction(&self, direction: Direction) -> &DirectionModel {
        &self.directions[direction as usize % 2]
    }
}

/// A slope, Q30, as the control path has it.
#[inline(always)]
const fn slope_q16(slope: i32) -> Ratio {
    Q16::from_bits(slope >> 14)
}

/// A part, unsigned Q32, as its difference from one half, signed Q32.
#[inline(always)]
const fn centred(part: u32) -> i32 {
    (part ^ 0x8000_0000) as i32
}
