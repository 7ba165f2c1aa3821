//! The ring without memory, in closed form: what the other forms must become when the
//! tread does not relax.
//!
//! With stiffness k per area the sums over floor, face and top are integrals of
//! `(R - distance) cos psi` and `(R - distance) sin psi`, distance being `y/cos psi`,
//! `d/sin psi` and `(y - h)/cos psi`, over the angles at which they are positive.

use crate::reference::error::{ReferenceError, positive, require};

/// An elastic wheel and a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Elastic {
    /// Undeformed radius, mm.
    pub radius_mm: f64,
    /// Width, mm.
    pub width_mm: f64,
    /// Stiffness per area, N/mm^3 (1e9 Pa/m).
    pub stiffness: f64,
    /// Step height, mm.
    pub step_height_mm: f64,
}

/// Forces of the wall on the wheel, N.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Forces {
    /// Away from the lower wall, by that wall.
    pub floor_n: f64,
    /// Away from the lower wall, by face and top.
    pub step_n: f64,
    /// Against the motion.
    pub axial_n: f64,
}

impl Forces {
    /// Away from the wall, N.
    #[must_use]
    pub fn radial_n(&self) -> f64 {
        self.floor_n + self.step_n
    }
}

impl Elastic {
    /// Every number is one above 0, and the step below half the radius.
    ///
    /// # Errors
    /// [`ReferenceError::OutOfRange`] names the one that is not.
    pub fn check(&self) -> Result<(), ReferenceError> {
        positive("radius_mm", self.radius_mm)?;
        positive("width_mm", self.width_mm)?;
        positive("stiffness", self.stiffness)?;
        let height = self.step_height_mm;
        let climbs = height > 0.0 && height <= 0.5 * self.radius_mm;
        require("step_height_mm", height, climbs, "above 0, to half the wheel radius")
    }

    /// Forces with the centre at `(x, y)`, x < 0 before the face, y above the lower wall.
    ///
    /// Equation: with `k R L` taken out, floor `[R sin psi - y psi]`, face
    /// `[R sin psi - d ln sin psi]` and `[-R cos psi - d psi]`, top `[R sin psi - z psi]`
    /// and `[-R cos psi + z ln cos psi]`, z = y - h, d = -x.
    /// Units: mm, N. Range: x in (-R, 0), y in (h, 2R). Error: rounding of the bracketed
    /// differences, 1e-15 `k R^2 L`.
    #[must_use]
    pub fn forces(&self, x_mm: f64, y_mm: f64) -> Forces {
        let (r, h) = (self.radius_mm, self.step_height_mm);
        let (d, y, z) = (-x_mm, y_mm, y_mm - h);
        let scale = self.stiffness * r * self.width_mm;
        // Angles at which rays meet root and corner, and at which depth ends.
        let (root, corner) = (d.atan2(y), d.atan2(z));
        let half = |height: f64| (height / r).min(1.0).acos();
        let between = |f: &dyn Fn(f64) -> f64, from: f64, to: f64| {
            if to > from { f(to) - f(from) } else { 0.0 }
        };
        let flat = |height: f64| move |psi: f64| r * psi.sin() - height * psi;
        let floor = between(&flat(y), -half(y), half(y).min(root));
        let floor_axial =
            between(&|psi: f64| -r * psi.cos() + y * psi.cos().ln(), -half(y), half(y).min(root));
        // On the face depth grows with the angle: from sin psi = d/R on.
        let bites = (d / r).min(1.0).asin().max(root);
        let face = between(&|psi: f64| r * psi.sin() - d * psi.sin().ln(), bites, corner);
        let face_axial = between(&|psi: f64| -r * psi.cos() - d * psi, bites, corner);
        let top = between(&flat(z), corner, half(z));
        let top_axial = between(&|psi: f64| -r * psi.cos() + z * psi.cos().ln(), corner, half(z));
        Forces {
            floor_n: scale * floor,
            step_n: scale * (face + top),
            axial_n: scale * (floor_axial + face_axial + top_axial),
        }
    }

    /// Height of the centre, mm, at which the contact carries `preload_n` at `x_mm`.
    ///
    /// Bisection to the last bit: the force falls steadily as the centre rises.
    #[must_use]
    pub fn height_mm(&self, x_mm: f64, preload_n: f64) -> f64 {
        let (low, high) = (self.step_height_mm, 2.0 * self.radius_mm);
        bisect(low, high, |y| self.forces(x_mm, y).radial_n() > preload_n)
    }

    /// The gap, mm: at lift-off the centre stands at y = R, so that
    /// `step_n(x, R) = P` gives x and `sqrt(x^2 + R^2) - R` the gap. None if even with
    /// the face under the centre the step does not carry the preload.
    #[must_use]
    pub fn gap_mm(&self, preload_n: f64) -> Option<f64> {
        let r = self.radius_mm;
        let carried = |x: f64| self.forces(x, r).step_n;
        // At x = 0 the floor ahead is gone and the quarter ahead of the top carries.
        let nearest = -1e-9 * r;
        if carried(nearest) < preload_n {
            return None;
        }
        let x = bisect(-r, nearest, |x| carried(x) < preload_n);
        Some(x.hypot(r) - r)
    }
}

/// Where `below` stops to hold between `low` and `high`.
fn bisect(mut low: f64, mut high: f64, below: impl Fn(f64) -> bool) -> f64 {
    loop {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            return middle;
        }
        if below(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
}

/// Climbing force of a rigid wheel at the touch of the corner, N: `P tan(phi)`.
#[must_use]
pub fn rigid_climb_n(preload_n: f64, climb_angle_rad: f64) -> f64 {
    preload_n * climb_angle_rad.tan()
}
