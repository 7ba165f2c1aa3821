//! The reduced model in fixed point: forward (speed and force to gap and what goes with
//! it) and inverse (gap to force, gap and force to speed).
//!
//! For one rig the fitted polynomial depends on two things only: how fast the crossing is
//! and how far the wheel runs over the corner. Both inverses are therefore one polynomial
//! in one variable, of which the zero is found from a good guess in two steps. No table,
//! no loop, at most four 32-bit divisions.
//!
//! Formats inside: lengths over R and parts of a whole in Q32 without sign, so that a
//! difference from one half is a Q32 with sign as `horner` wants it; forces over the
//! unit of `Shape` in Q30.

#![deny(clippy::float_arithmetic)]

#[allow(clippy::float_arithmetic, reason = "SI to machine units, once at start")]
mod build;
mod shape;
mod way;

use crate::numeric::{fraction, high, reciprocal_of_normalised};
use crate::supervise::Direction;
use crate::units::{Millimetres, MillimetresPerSecond, Newtons, Q16, Ratio};

use shape::Shape;
use way::Way;

/// Estimated over nominal stiffness of the tread, with its reciprocal: it changes once a
/// crossing and is used many times.
///
/// Range: 1/4 to 4, the nearer end outside. Error of the reciprocal: 1e-8 relative.
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
    #[must_use]
    pub fn new(ratio: Ratio) -> Self {
        let bits = ratio.to_bits().clamp(1 << 14, 1 << 18);
        let shift = (bits as u32).leading_zeros();
        let reciprocal = reciprocal_of_normalised((bits as u32) << shift);
        let inverse = (reciprocal.saturating_add(1 << (18 - shift)) >> (19 - shift)) as i32;
        Self { ratio: Ratio::from_bits(bits), inverse }
    }

    /// The ratio.
    #[must_use]
    pub const fn ratio(self) -> Ratio {
        self.ratio
    }
}

/// The reduced model of one rig under one load.
///
/// Range: speeds from 0, forces up to the unit of force over the scale; gaps and forces
/// beyond the fit give its nearer end. Error against [`Formula`](super::formula::Formula)
/// beyond one LSB of the result, relative: force of a gap 5e-6; gap of a force 2e-5 for
/// steps of 3 mm and more, 5e-3 for 2 mm, where 150 N all but close it.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ReducedModel {
    shape: Shape,
    ways: [Way; 2],
    /// Whether friction drives the wheel; else it is pushed and needs none.
    driven: bool,
    /// Friction of tread on wall.
    friction: Ratio,
}

/// A crossing's working point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Way.
    pub direction: Direction,
    /// Speed at lift-off, mm/s, not negative.
    pub speed: MillimetresPerSecond,
    /// Estimated over nominal stiffness of the tread.
    pub scale: Scale,
}

/// What the model says of a crossing, see [`formula::Crossing`](super::formula::Crossing).
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
    #[must_use]
    pub fn gap_range(&self) -> (Millimetres, Millimetres) {
        (self.shape.gap(self.shape.most_run()), self.shape.gap(self.shape.least_run()))
    }

    /// Everything about the crossing at this radial force, N.
    ///
    /// Equation: the run r with `F(x, r) + T s(r) = P` by two steps from a
    /// polynomial guess; then [`Formula::crossing`](super::formula::Formula::crossing). A
    /// scale multiplies what the force exceeds the lift of the load on the mean slope by.
    #[must_use]
    #[inline]
    pub fn crossing(&self, point: &Point, force: Newtons) -> Crossing {
        let (shape, way) = (&self.shape, self.way(point.direction));
        let wanted = shape.part(force);
        let sought = shape.unscaled(wanted, point.scale.inverse);
        let x = way.fast_part(point.speed);
        let beyond = shape.beyond_lift(sought);
        let guess = way.guess_run(x, beyond.root);
        let yielding = way.yielding(x, beyond.root);
        let stiffness = way.stiffness(x, centred(guess));
        let run = shape.refine(guess, sought, &beyond, stiffness, yielding);
        let stiffness = way.stiffness(x, centred(run));
        let run = shape.refine(run, sought, &beyond, stiffness, yielding);
        let w = centred(run);
        let slope = shape.slope(w);
        let radial = shape.radial_part(wanted, slope, w);
        let used = self.used(radial, slope);
        Crossing {
            gap: shape.gap(run),
            corner_force: shape.newtons(high(radial, slope) << 2),
            impact_stress_kpa: shape.impact_stress(point.speed),
            vibration_um: shape.vibration(point.speed, radial, run),
            utilisation: used,
            slip_margin: self.friction - used,
            at_end: run == shape.least_run() || run == shape.most_run() || shape.is_beyond(force),
        }
    }

    /// Gap under this radial force, mm.
    #[must_use]
    pub fn gap(&self, point: &Point, force: Newtons) -> Millimetres {
        self.crossing(point, force).gap
    }

    /// Radial force that gives this gap, N: `F + T s`, scaled.
    #[must_use]
    #[inline]
    pub fn force(&self, point: &Point, gap: Millimetres) -> Newtons {
        self.shape.newtons(self.force_part(point, self.shape.run(gap)))
    }

    /// Friction that lifting the load uses at this gap: `T / C + s`; 0 if pushed.
    #[must_use]
    pub fn utilisation(&self, point: &Point, gap: Millimetres) -> Ratio {
        let run = self.shape.run(gap);
        let force = self.force_part(point, run);
        let slope = self.shape.slope(centred(run));
        self.used(self.shape.radial_part(force, slope, centred(run)), slope)
    }

    /// Largest speed from `floor` to `ceiling` at which `force` still holds the gap, mm/s;
    /// `floor` if none does.
    ///
    /// Equation: the fast part x with `F(x, r) = P - T s`, by two steps of Newton's
    /// method from a polynomial guess; then `v = v_half x / (1 - x)`.
    #[must_use]
    #[inline]
    pub fn speed(
        &self,
        point: &Point,
        gap: Millimetres,
        force: Newtons,
        floor: MillimetresPerSecond,
        ceiling: MillimetresPerSecond,
    ) -> MillimetresPerSecond {
        let (shape, way) = (&self.shape, self.way(point.direction));
        let run = shape.run(gap);
        let w = centred(run);
        let sought = shape.unscaled(shape.part(force), point.scale.inverse);
        let stiffness = shape.stiffness_for(sought - shape.lifting(w), run);
        match way.speed(stiffness, w) {
            Some(speed) => speed.min(ceiling).max(floor),
            None => floor,
        }
    }

    /// Scale of the stiffness that explains this gap under this radial force.
    #[must_use]
    pub fn observed_scale(&self, point: &Point, gap: Millimetres, force: Newtons) -> Ratio {
        let nominal = Point { scale: Scale::NOMINAL, ..*point };
        let shape = &self.shape;
        let nominal = self.force_part(&nominal, shape.run(gap)) - shape.middle_lifting;
        let excess = (shape.part(force) - shape.middle_lifting).max(0);
        // Of four times the nominal force, so up to 4.
        let part = fraction((excess as u32) >> 2, nominal.max(1) as u32);
        Q16::from_bits((part >> 14) as i32)
    }

    /// Tread depth at the corner at lift-off, mm.
    #[must_use]
    pub fn depth(&self, gap: Millimetres) -> Millimetres {
        self.shape.depth(self.shape.run(gap))
    }

    /// Radial force after this run, Q30.
    #[inline(always)]
    fn force_part(&self, point: &Point, run: u32) -> i32 {
        let (shape, way) = (&self.shape, self.way(point.direction));
        let w = centred(run);
        let stiffness = way.stiffness(way.fast_part(point.speed), w);
        let force = shape.elastic(run, stiffness) + shape.lifting(w);
        shape.scaled(force, point.scale.ratio)
    }

    /// Friction used under a radial reaction on this slope, both Q30.
    #[inline(always)]
    fn used(&self, radial: i32, slope: i32) -> Ratio {
        if self.driven { self.shape.utilisation(radial, slope) } else { Ratio::ZERO }
    }

    fn way(&self, direction: Direction) -> &Way {
        match direction {
            Direction::Deploy => &self.ways[0],
            Direction::Retract => &self.ways[1],
        }
    }
}

/// A part of a whole, Q32 without sign, as its difference from one half, Q32 with sign.
#[inline(always)]
const fn centred(part: u32) -> i32 {
    (part ^ 0x8000_0000) as i32
}
