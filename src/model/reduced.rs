//! The reduced model in fixed point: forward (speed and force to gap) and inverse
//! (gap to force, force to speed).

#![deny(clippy::float_arithmetic)]

#[allow(clippy::float_arithmetic, reason = "SI to machine units, once at start")]
mod build;

use crate::numeric::{Table, divide};
use crate::supervise::Direction;
use crate::units::{Millimetres, MillimetresPerSecond, Newtons, Q16, Ratio, q16};

/// Points of the tables over the gap.
pub const GAP_POINTS: usize = 65;

/// Tables over the gap and over the Deborah number for one rig.
///
/// The gap's range is that from a quarter of the unloaded gap to where the run over
/// the corner is 0.25 mm; outside it the nearer end holds.
#[derive(Clone, Debug)]
pub struct ReducedModel {
    /// k_inf times the radial contact integral, N.
    radial: Table<GAP_POINTS>,
    /// k_inf times radial plus slope times axial integral, N: the driven wheel.
    driven: Table<GAP_POINTS>,
    /// Axial over radial integral: tangent of the contact's mean inclination.
    slope: Table<GAP_POINTS>,
    /// Deborah number per speed, s/mm, way out and way back.
    pace: [Table<GAP_POINTS>; 2],
    /// Tread depth at the corner, mm.
    depth: Table<GAP_POINTS>,
    /// Part of the stiffening felt over z, way out and way back.
    felt: [Table<33>; 2],
    /// Stiffening less one.
    excess: Ratio,
}

/// A crossing's working point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Way.
    pub direction: Direction,
    /// Speed at lift-off, mm/s, not negative.
    pub speed: MillimetresPerSecond,
    /// Axial load lifted by friction, N.
    pub load: Newtons,
    /// Estimated over nominal stiffness of the tread.
    pub scale: Ratio,
}

const ONE: Ratio = q16(1_000_000);

impl ReducedModel {
    /// Least and largest gap of the tables, mm.
    #[must_use]
    pub fn gap_range(&self) -> (Millimetres, Millimetres) {
        (self.radial.lo(), self.radial.hi())
    }

    /// Effective stiffness over nominal k_inf, `scale (1 + (s - 1) g(De))`.
    #[must_use]
    pub fn stiffness(&self, point: &Point, gap: Millimetres) -> Ratio {
        let way = way(point.direction);
        let deborah = point.speed * self.pace[way].eval(gap);
        // De/(1 + De) without cancellation at large De.
        let z = divide(deborah, ONE + deborah);
        point.scale * (ONE + self.excess * self.felt[way].eval(z))
    }

    /// Radial force on the driven wheel that gives this gap, N:
    /// `k (I_r + s I_a) + T s` with `s = I_a / I_r`.
    #[must_use]
    pub fn force(&self, point: &Point, gap: Millimetres) -> Newtons {
        self.stiffness(point, gap) * self.driven.eval(gap) + point.load * self.slope.eval(gap)
    }

    /// Radial force on the frictionless wheel that gives this gap, N: `k I_r`.
    #[must_use]
    pub fn pushed_force(&self, point: &Point, gap: Millimetres) -> Newtons {
        self.stiffness(point, gap) * self.radial.eval(gap)
    }

    /// Gap of the driven wheel under this radial force, mm: 17 halvings of the
    /// table's range, so within 1e-5 of it.
    #[must_use]
    pub fn gap(&self, point: &Point, force: Newtons) -> Millimetres {
        self.halve(|gap| self.force(point, gap) > force)
    }

    /// Gap of the frictionless wheel under this radial force, mm.
    #[must_use]
    pub fn pushed_gap(&self, point: &Point, force: Newtons) -> Millimetres {
        self.halve(|gap| self.pushed_force(point, gap) > force)
    }

    /// Friction that lifting the load uses at lift-off: `T/(k I_r) + I_a/I_r`.
    #[must_use]
    pub fn utilisation(&self, point: &Point, gap: Millimetres) -> Ratio {
        let carried = self.stiffness(point, gap) * self.radial.eval(gap);
        divide(point.load, carried) + self.slope.eval(gap)
    }

    /// Axial part of the contact's reaction under this radial force, N: what the
    /// climb costs.
    #[must_use]
    pub fn climbing_force(&self, gap: Millimetres, force: Newtons) -> Newtons {
        force * self.slope.eval(gap)
    }

    /// Tread depth at the corner at lift-off, mm.
    #[must_use]
    pub fn depth(&self, gap: Millimetres) -> Millimetres {
        self.depth.eval(gap)
    }

    /// Largest speed up to `ceiling` at which `force` still holds the gap, mm/s, and
    /// not below `floor`: 16 halvings, since the force rises with the speed.
    #[must_use]
    pub fn speed(
        &self,
        point: &Point,
        gap: Millimetres,
        force: Newtons,
        floor: MillimetresPerSecond,
        ceiling: MillimetresPerSecond,
    ) -> MillimetresPerSecond {
        let holds = |speed| self.force(&Point { speed, ..*point }, gap) <= force;
        if holds(ceiling) {
            return ceiling;
        }
        let (mut low, mut high) = (floor, ceiling);
        for _ in 0..16 {
            let middle = half(low + high);
            if holds(middle) {
                low = middle;
            } else {
                high = middle;
            }
        }
        low
    }

    /// Scale of the stiffness that explains this gap under this radial force.
    #[must_use]
    pub fn observed_scale(&self, point: &Point, gap: Millimetres, force: Newtons) -> Ratio {
        let nominal = Point { scale: ONE, ..*point };
        let elastic = self.stiffness(&nominal, gap) * self.driven.eval(gap);
        divide(force - point.load * self.slope.eval(gap), elastic)
    }

    /// Halves the gap's range 17 times; `above` tells whether the force at a gap is
    /// still too large, so that the gap sought is larger.
    fn halve(&self, above: impl Fn(Millimetres) -> bool) -> Millimetres {
        let (mut low, mut high) = self.gap_range();
        for _ in 0..17 {
            let middle = half(low + high);
            if above(middle) {
                low = middle;
            } else {
                high = middle;
            }
        }
        half(low + high)
    }
}

fn half(x: Q16) -> Q16 {
    x.half()
}

const fn way(direction: Direction) -> usize {
    match direction {
        Direction::Deploy => 0,
        Direction::Retract => 1,
    }
}
