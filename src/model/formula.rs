//! The reduced model in f64: what the fixed-point tables are built from and
//! compared with.
//!
//! At the instant the lower wall stops carrying, the centre of an elastic ring
//! stands at its undeformed height R above it, so the contact with face and corner
//! is a closed form in the gap. Memory enters as an effective stiffness that
//! depends on the Deborah number of the run over the corner. Friction that lifts
//! the top load is taken as equally used over the contact.

use super::constants::{DEPLOY, RETRACT};
use crate::rig::Rig;
use crate::supervise::Direction;

/// Reference length of the Deborah number, mm: makes the generalised run
/// `a^e l^(1-e)` a length.
const RUN_REFERENCE_MM: f64 = 3.0;

/// Exponent of the contact run in the Deborah number. Derived: least scatter of the
/// effective stiffness over the ring's crossings; on the way back the run matters
/// less, since the corner carries long before the touch-down.
const fn run_exponent(direction: Direction) -> f64 {
    match direction {
        Direction::Deploy => 1.2,
        Direction::Retract => 0.5,
    }
}

/// Contact integrals of the elastic ring at the instant of lift-off, per unit of
/// stiffness, mm^3: over `delta cos psi` and `delta sin psi` times the wheel's width.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Radial part, mm^3.
    pub radial: f64,
    /// Axial part, mm^3.
    pub axial: f64,
}

/// Geometry and material of the reduced model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Formula {
    /// Wheel radius R, mm.
    pub radius_mm: f64,
    /// Wheel width L, mm.
    pub width_mm: f64,
    /// Step height h, mm.
    pub step_mm: f64,
    /// Relaxed stiffness, N/mm^3.
    pub k_inf: f64,
    /// Stiffening k_0/k_inf.
    pub stiffening: f64,
    /// Relaxation time, s.
    pub tau_s: f64,
}

impl Formula {
    /// The reduced model of a rig.
    #[must_use]
    pub fn new(rig: &Rig) -> Self {
        Self {
            radius_mm: rig.rig.wheel_radius_mm,
            width_mm: rig.rig.wheel_width_mm,
            step_mm: rig.rig.step_height_mm,
            k_inf: rig.tread.k_inf_pa_per_m * 1e-9,
            stiffening: rig.tread.stiffening,
            tau_s: rig.tread.tau_s,
        }
    }

    /// Gap of the unloaded wheel, mm: the circle just touches floor and corner.
    #[must_use]
    pub fn largest_gap_mm(&self) -> f64 {
        let free = self.free_run_mm();
        libm::sqrt(free * free + self.radius_mm * self.radius_mm) - self.radius_mm
    }

    /// Axial distance of the corner from the centre at which the undeformed wheel
    /// touches it, mm.
    #[must_use]
    pub fn free_run_mm(&self) -> f64 {
        let above = self.radius_mm - self.step_mm;
        libm::sqrt(self.radius_mm * self.radius_mm - above * above)
    }

    /// Axial distance from the face at which the wheel stands with this gap, mm.
    #[must_use]
    pub fn distance_mm(&self, gap_mm: f64) -> f64 {
        let reach = self.radius_mm + gap_mm;
        libm::sqrt((reach * reach - self.radius_mm * self.radius_mm).max(0.0))
    }

    /// Run of the wheel over the corner up to lift-off, mm.
    #[must_use]
    pub fn run_mm(&self, gap_mm: f64) -> f64 {
        self.free_run_mm() - self.distance_mm(gap_mm)
    }

    /// Tread depth at the corner at lift-off, mm.
    #[must_use]
    pub fn depth_mm(&self, gap_mm: f64) -> f64 {
        let d = self.distance_mm(gap_mm);
        let above = self.radius_mm - self.step_mm;
        self.radius_mm - libm::sqrt(d * d + above * above)
    }

    /// Contact at lift-off with this gap: face from where the circle meets it up to
    /// the corner, then the top.
    #[must_use]
    pub fn contact(&self, gap_mm: f64) -> Contact {
        let (r, above) = (self.radius_mm, self.radius_mm - self.step_mm);
        let d = self.distance_mm(gap_mm);
        let start = libm::asin((d / r).min(1.0));
        let corner = libm::atan2(d, above);
        let end = libm::acos(above / r);
        if corner <= start || end <= corner {
            return Contact { radial: 0.0, axial: 0.0 };
        }
        let (sin, cos) = (libm::sin, libm::cos);
        let radial = r * (sin(end) - sin(start))
            - d * libm::log(sin(corner) / sin(start))
            - above * (end - corner);
        let axial = r * (cos(start) - cos(end))
            - d * (corner - start)
            - above * libm::log(cos(corner) / cos(end));
        let strip = r * self.width_mm;
        Contact { radial: radial * strip, axial: axial * strip }
    }

    /// Inverse pace of the crossing, s/mm: times the speed it is the Deborah number.
    #[must_use]
    pub fn deborah_per_speed(&self, direction: Direction, gap_mm: f64) -> f64 {
        let e = run_exponent(direction);
        let run = self.run_mm(gap_mm).max(1e-3);
        self.tau_s / (libm::pow(run, e) * libm::pow(RUN_REFERENCE_MM, 1.0 - e))
    }

    /// Part g of the stiffening that is felt at this Deborah number, 0 to 1.
    #[must_use]
    pub fn felt(direction: Direction, deborah: f64) -> f64 {
        let table = match direction {
            Direction::Deploy => &DEPLOY,
            Direction::Retract => &RETRACT,
        };
        let last = table.len() - 1;
        let position = deborah / (1.0 + deborah) * last as f64;
        let index = (position as usize).min(last - 1);
        let t = position - index as f64;
        // Catmull-Rom, as the fixed-point table does it; beyond the ends the parabola
        // through the last three.
        let at = |i: usize| f64::from(table[i]) * 1e-6;
        let p1 = at(index);
        let p2 = at(index + 1);
        let p0 = if index > 0 { at(index - 1) } else { 3.0 * (p1 - p2) + at(index + 2) };
        let p3 = if index + 2 <= last { at(index + 2) } else { 3.0 * (p2 - p1) + at(index - 1) };
        p1 + 0.5
            * t
            * ((p2 - p0)
                + t * ((2.0 * p0 - 5.0 * p1 + 4.0 * p2 - p3) + t * (3.0 * p1 - 3.0 * p2 + p3 - p0)))
    }

    /// Effective stiffness over k_inf for a crossing with this gap.
    #[must_use]
    pub fn stiffness(&self, direction: Direction, speed_mm_s: f64, gap_mm: f64) -> f64 {
        let deborah = speed_mm_s * self.deborah_per_speed(direction, gap_mm);
        1.0 + (self.stiffening - 1.0) * Self::felt(direction, deborah)
    }

    /// Radial force on the wheel that gives this gap, N. `load_n` is the axial load
    /// lifted by friction; `None` pushes a frictionless wheel.
    #[must_use]
    pub fn force_n(
        &self,
        direction: Direction,
        speed_mm_s: f64,
        gap_mm: f64,
        load_n: Option<f64>,
    ) -> f64 {
        let stiffness = self.k_inf * self.stiffness(direction, speed_mm_s, gap_mm);
        let contact = self.contact(gap_mm);
        if contact.radial <= 0.0 {
            return 0.0;
        }
        let slope = contact.axial / contact.radial;
        match load_n {
            None => stiffness * contact.radial,
            Some(load) => stiffness * (contact.radial + slope * contact.axial) + load * slope,
        }
    }

    /// Friction that the lift of `load_n` uses at that instant.
    #[must_use]
    pub fn utilisation(
        &self,
        direction: Direction,
        speed_mm_s: f64,
        gap_mm: f64,
        load_n: f64,
    ) -> f64 {
        let stiffness = self.k_inf * self.stiffness(direction, speed_mm_s, gap_mm);
        let contact = self.contact(gap_mm);
        (load_n / stiffness + contact.axial) / contact.radial
    }

    /// Gap at this speed and radial force, mm, by bisection to 1e-9 mm.
    #[must_use]
    pub fn gap_mm(
        &self,
        direction: Direction,
        speed_mm_s: f64,
        force_n: f64,
        load_n: Option<f64>,
    ) -> f64 {
        let (mut low, mut high) = (0.0, self.largest_gap_mm());
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if self.force_n(direction, speed_mm_s, middle, load_n) > force_n {
                low = middle;
            } else {
                high = middle;
            }
        }
        0.5 * (low + high)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn formula() -> Formula {
        Formula::new(&Rig::fe())
    }

    #[test]
    fn the_contact_integrals_agree_with_a_fine_sum() {
        let f = formula();
        for gap in [1.2, 2.0, 2.75, 3.2] {
            let d = f.distance_mm(gap);
            let (mut radial, mut axial) = (0.0, 0.0);
            let n = 200_000;
            for i in 0..n {
                let psi = 0.8 * (i as f64 + 0.5) / n as f64;
                let face = d / psi.sin();
                let top = (f.radius_mm - f.step_mm) / psi.cos();
                let reach = if face * psi.cos() >= f.radius_mm - f.step_mm { face } else { top };
                let depth = (f.radius_mm - reach).max(0.0);
                let patch = 0.8 / n as f64 * f.radius_mm * f.width_mm;
                radial += depth * psi.cos() * patch;
                axial += depth * psi.sin() * patch;
            }
            let closed = f.contact(gap);
            assert!((closed.radial / radial - 1.0).abs() < 1e-5, "{} {radial}", closed.radial);
            assert!((closed.axial / axial - 1.0).abs() < 1e-5, "{} {axial}", closed.axial);
        }
    }

    #[test]
    fn gap_and_force_are_inverse() {
        let f = formula();
        for direction in [Direction::Deploy, Direction::Retract] {
            for (speed, force, load) in
                [(3.0, 33.3, Some(6.7)), (12.0, 50.0, None), (40.0, 120.0, Some(20.0))]
            {
                let gap = f.gap_mm(direction, speed, force, load);
                let back = f.force_n(direction, speed, gap, load);
                assert!((back / force - 1.0).abs() < 1e-6, "{back} {force}");
            }
        }
    }

    #[test]
    fn the_gap_grows_with_speed_and_falls_with_force() {
        let f = formula();
        let gap = |v, p| f.gap_mm(Direction::Deploy, v, p, Some(6.7));
        for v in [2.0, 5.0, 10.0, 20.0, 40.0] {
            assert!(gap(1.2 * v, 40.0) > gap(v, 40.0));
            assert!(gap(v, 44.0) < gap(v, 40.0));
        }
    }
}
