//! Hereditary contact: an indenter pressed into a tread with memory.
//!
//! The study transforms the product `E delta^alpha` as if its transform were a product
//! (15, 16, 29). What holds is a convolution: while the contact grows, Lee and Radok's;
//! once it shrinks, Ting's, for which only what happened before the contact was last as
//! large as it is now counts.

use std::f64::consts::PI;

use crate::reference::case::{ReferenceError, positive, require};
use crate::reference::solid::Solid;

/// What is pressed into the tread.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Indenter {
    /// A cone whose face rises at this angle from the tread's surface, rad: the study's
    /// law, alpha = 2. A symmetric corner of 90 degrees has 45, where (17) puts 90.
    Cone {
        /// Angle between face and surface, rad, in (0, pi/2).
        slope_rad: f64,
    },
    /// A cylinder that lies on the tread, in line contact: what the wheel's edge is, in
    /// place of the sphere of (20). Its depth is the nominal one, half-width squared
    /// over radius: in line contact the approach of far points depends on how far.
    Cylinder {
        /// Radius, m.
        radius_m: f64,
        /// Length of the line, m.
        width_m: f64,
    },
}

impl Indenter {
    /// alpha of `F = D E* delta^alpha`.
    #[must_use]
    pub fn exponent(&self) -> i32 {
        match self {
            Self::Cone { .. } => 2,
            Self::Cylinder { .. } => 1,
        }
    }

    /// D of `F = D E* delta^alpha`: `2/(pi tan theta)` (Sneddon 1965), or `pi L/4`
    /// (Hertz: `a^2 = 4 F R/(pi L E*)`).
    #[must_use]
    pub fn factor(&self) -> f64 {
        match *self {
            Self::Cone { slope_rad } => 2.0 / (PI * slope_rad.tan()),
            Self::Cylinder { width_m, .. } => 0.25 * PI * width_m,
        }
    }

    /// Radius or half-width of the contact at the depth that made it, m.
    #[must_use]
    pub fn contact_m(&self, depth_m: f64) -> f64 {
        match *self {
            Self::Cone { slope_rad } => 2.0 * depth_m / (PI * slope_rad.tan()),
            Self::Cylinder { radius_m, .. } => (radius_m * depth_m).sqrt(),
        }
    }

    fn check(&self) -> Result<(), ReferenceError> {
        match *self {
            Self::Cone { slope_rad } => {
                let ok = slope_rad > 0.0 && slope_rad < 0.5 * PI;
                require("slope_rad", slope_rad, ok, "between 0 and pi/2")
            }
            Self::Cylinder { radius_m, width_m } => {
                positive("radius_m", radius_m)?;
                positive("width_m", width_m)
            }
        }
    }
}

/// One node of the depth's course with what is remembered there.
#[derive(Clone, Copy, Debug)]
struct Node {
    t_s: f64,
    depth_m: f64,
    /// `int e^{-(t-s)/tau} d(delta)`, and the same of `delta^alpha`.
    depth_memory: f64,
    law_memory: f64,
}

/// An indentation: pressed in, held if wanted, taken out.
#[derive(Clone, Debug)]
pub struct Indentation {
    indenter: Indenter,
    solid: Solid,
    nodes: Vec<Node>,
    peak: usize,
}

impl Indentation {
    /// From the depth at some times, s and m, straight in between, from rest at (0, 0).
    /// `solid` has the reduced moduli, `E/(1 - nu^2)`.
    ///
    /// # Errors
    /// [`ReferenceError::OutOfRange`] if the times do not rise, the depth is negative,
    /// or it rises again after it has fallen: Ting's first unloading is solved here.
    pub fn new(
        indenter: Indenter,
        solid: Solid,
        course: &[(f64, f64)],
    ) -> Result<Self, ReferenceError> {
        indenter.check()?;
        let mut nodes = vec![Node { t_s: 0.0, depth_m: 0.0, depth_memory: 0.0, law_memory: 0.0 }];
        let mut peak = 0;
        for &(t_s, depth_m) in course {
            let last = nodes[nodes.len() - 1];
            require("t_s", t_s, t_s > last.t_s && t_s.is_finite(), "later than the one before")?;
            require("depth_m", depth_m, depth_m >= 0.0, "0 or more")?;
            let rises = depth_m >= last.depth_m;
            let first_rise = peak == nodes.len() - 1;
            require(
                "depth_m",
                depth_m,
                !rises || first_rise || depth_m == last.depth_m,
                "rising once, then falling",
            )?;
            if rises && first_rise {
                peak = nodes.len();
            }
            nodes.push(advance(&indenter, &solid, last, t_s, depth_m));
        }
        Ok(Self { indenter, solid, nodes, peak })
    }

    /// Depth at `t_s`, m; that of the nearest end outside the course.
    #[must_use]
    pub fn depth_m(&self, t_s: f64) -> f64 {
        self.at(t_s).depth_m
    }

    /// Force at `t_s`, N.
    ///
    /// Equation: `F = D int_0^{t_1} E_r(t - s) d(delta^alpha)`, t_1 = t while the contact
    /// grows, else the root of `int_{t_1}^t E_r(t - s) d(delta) = 0`; no force once there
    /// is none in (0, t]. Each straight piece is integrated in closed form.
    /// Sign: pressing apart, never below 0. Units: N for moduli in Pa, depth in m.
    /// Range: t within the course. Error: 1e-12 of the largest force.
    /// Cost: a search over the nodes per bisection.
    /// Source: E. H. Lee, J. R. M. Radok, J. Appl. Mech. 27 (1960) 438; T. C. T. Ting,
    /// J. Appl. Mech. 33 (1966) 845.
    #[must_use]
    pub fn force_n(&self, t_s: f64) -> f64 {
        let Some(turn_s) = self.contact_time_s(t_s) else { return 0.0 };
        let then = self.at(turn_s);
        let law = self.solid.relaxed() * then.depth_m.powi(self.indenter.exponent())
            + self.solid.excess() * self.fade(t_s - turn_s) * then.law_memory;
        self.indenter.factor() * law
    }

    /// Radius or half-width of the contact at `t_s`, m: as large as it was at
    /// [`Self::contact_time_s`].
    #[must_use]
    pub fn contact_m(&self, t_s: f64) -> f64 {
        let turn_s = self.contact_time_s(t_s);
        turn_s.map_or(0.0, |turn_s| self.indenter.contact_m(self.depth_m(turn_s)))
    }

    /// When the growing contact was as large as it is at `t_s`: Ting's t_1. None once
    /// the contact has ended.
    #[must_use]
    pub fn contact_time_s(&self, t_s: f64) -> Option<f64> {
        let peak_s = self.nodes[self.peak].t_s;
        if t_s <= peak_s {
            return Some(t_s.max(0.0));
        }
        let now = self.at(t_s);
        // Falls as t_1 grows, since the depth grows until the peak.
        let since = |t_1: f64| {
            let then = self.at(t_1);
            let remembered = now.depth_memory - self.fade(t_s - t_1) * then.depth_memory;
            self.solid.relaxed() * (now.depth_m - then.depth_m) + self.solid.excess() * remembered
        };
        if since(0.0) <= 0.0 {
            return None;
        }
        let (mut low, mut high) = (0.0, peak_s);
        loop {
            let middle = 0.5 * (low + high);
            if middle <= low || middle >= high {
                return Some(middle);
            }
            if since(middle) > 0.0 {
                low = middle;
            } else {
                high = middle;
            }
        }
    }

    fn fade(&self, t_s: f64) -> f64 {
        (-t_s / self.solid.relaxation_time_s()).exp()
    }

    fn at(&self, t_s: f64) -> Node {
        let after = self.nodes.partition_point(|node| node.t_s <= t_s);
        let before = self.nodes[after.max(1) - 1];
        let Some(next) = self.nodes.get(after) else { return before };
        if t_s <= before.t_s {
            return before;
        }
        let part = (t_s - before.t_s) / (next.t_s - before.t_s);
        let depth_m = before.depth_m + part * (next.depth_m - before.depth_m);
        advance(&self.indenter, &self.solid, before, t_s, depth_m)
    }
}

/// The node at the end of a straight piece that begins at `from`.
fn advance(indenter: &Indenter, solid: &Solid, from: Node, t_s: f64, depth_m: f64) -> Node {
    let tau = solid.relaxation_time_s();
    let x = (t_s - from.t_s) / tau;
    let keep = (-x).exp();
    // Way per time constant, and the integrals of e^{u-x} and u e^{u-x} over the piece.
    let rate = (depth_m - from.depth_m) / x;
    let first = -(-x).exp_m1();
    let second = if x < 1e-2 {
        x * x * (0.5 - x * (1.0 / 6.0 - x * (1.0 / 24.0 - x * (1.0 / 120.0 - x / 720.0))))
    } else {
        x - first
    };
    let law = match indenter.exponent() {
        1 => rate * first,
        _ => 2.0 * rate * (from.depth_m * first + rate * second),
    };
    Node {
        t_s,
        depth_m,
        depth_memory: keep * from.depth_memory + rate * first,
        law_memory: keep * from.law_memory + law,
    }
}
