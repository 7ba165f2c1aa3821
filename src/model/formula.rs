//! The reduced model in f64: the definition that the fixed-point model follows.
//!
//! When the lower wall stops carrying, the centre of an elastic ring is at its undeformed
//! height R above it, so the contact with face and corner is a closed form in the gap. The
//! rubber's memory enters as an effective stiffness fitted to the ring. Friction that lifts the
//! top load is assumed to be used equally over the contact.

use super::effective_stiffness::{self, FORCE_END, Folded, Kind, RUN_END};
use super::impact::Impact;
use crate::rig::Rig;
use crate::units::Direction;

/// Shortest run of the model over R: 0.1 mm on the published wheel.
pub const LEAST_RUN: f64 = 0.004;

/// Longest run over the free one: there the gap is all but closed.
const MOST_RUN_PART: f64 = 0.99;

/// Contact integrals of the elastic ring at the instant of lift-off, per unit of
/// stiffness, mm^3: over `delta cos psi` and `delta sin psi` times the wheel's width.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Radial part, mm^3.
    pub radial: f64,
    /// Axial part, mm^3.
    pub axial: f64,
}

impl Contact {
    /// Axial over radial part: tangent of the contact's mean inclination.
    pub fn slope(&self) -> f64 {
        if self.radial > 0.0 { self.axial / self.radial } else { 0.0 }
    }
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
    /// Impact and vibration at the corner.
    pub impact: Impact,
}

/// A crossing by the model, at the instant at which the lower wall stops (on retract: begins)
/// to carry.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// Clearance between the root of the step and the undeformed wheel, mm.
    pub gap_mm: f64,
    /// Axial force of the step's contact on the wheel, N.
    pub corner_force_n: f64,
    /// Stress by which the corner's first touch exceeds the quasi-static one, Pa.
    pub impact_stress_pa: f64,
    /// Amplitude of the arm's first mode that the crossing leaves, mm.
    pub vibration_mm: f64,
    /// Friction that the lift of the load uses; 0 if pushed.
    pub utilisation: f64,
}

impl Formula {
    /// The reduced model of a rig.
    pub fn new(rig: &Rig) -> Self {
        Self {
            radius_mm: rig.rig.wheel_radius_mm,
            width_mm: rig.rig.wheel_width_mm,
            step_mm: rig.rig.step_height_mm,
            k_inf: rig.tread.k_inf_pa_per_m * 1e-9,
            stiffening: rig.tread.stiffening,
            tau_s: rig.tread.tau_s,
            impact: Impact::new(rig),
        }
    }

    /// Unit of force of the fit, `k_inf R^2 L`, N.
    pub fn unit_force_n(&self) -> f64 {
        self.k_inf * self.radius_mm * self.radius_mm * self.width_mm
    }

    /// Axial distance of the corner from the centre at which the undeformed wheel
    /// touches it, mm.
    pub fn free_run_mm(&self) -> f64 {
        let above = self.radius_mm - self.step_mm;
        libm::sqrt(self.radius_mm * self.radius_mm - above * above)
    }

    /// Axial distance from the face of a wheel with this gap, mm.
    pub fn distance_mm(&self, gap_mm: f64) -> f64 {
        let reach = self.radius_mm + gap_mm;
        libm::sqrt((reach * reach - self.radius_mm * self.radius_mm).max(0.0))
    }

    /// Run of the wheel over the corner up to lift-off, mm.
    pub fn run_mm(&self, gap_mm: f64) -> f64 {
        self.free_run_mm() - self.distance_mm(gap_mm)
    }

    /// Gap with which the wheel lifts off after this run, mm.
    pub fn gap_after_mm(&self, run_mm: f64) -> f64 {
        let d = self.free_run_mm() - run_mm;
        libm::sqrt(d * d + self.radius_mm * self.radius_mm) - self.radius_mm
    }

    /// Tread depth at the corner at lift-off, mm.
    pub fn depth_mm(&self, gap_mm: f64) -> f64 {
        let d = self.distance_mm(gap_mm);
        let above = self.radius_mm - self.step_mm;
        self.radius_mm - libm::sqrt(d * d + above * above)
    }

    /// Contact at lift-off with this gap: face from where the circle meets it up to
    /// the corner, then the top.
    pub fn contact(&self, gap_mm: f64) -> Contact {
        let (r, above) = (self.radius_mm, self.radius_mm - self.step_mm);
        let d = self.distance_mm(gap_mm);
        let start = libm::asin((d / r).min(1.0));
        let corner = libm::atan2(d, above);
        let end = libm::acos(above / r);
        if corner <= start || end <= corner {
            return Contact { radial: 0.0, axial: 0.0 };
        }
        // r sin(start) = d, r cos(end) = above, and the corner lies at (d, above).
        let away = libm::sqrt(d * d + above * above);
        let end_sine = libm::sqrt(r * r - above * above);
        let start_cosine = libm::sqrt((r * r - d * d).max(0.0));
        let radial = end_sine - d - d * libm::log(r / away) - above * (end - corner);
        let axial = start_cosine - above - d * (corner - start) - above * libm::log(r / away);
        let strip = r * self.width_mm;
        Contact { radial: radial * strip, axial: axial * strip }
    }

    /// Radial force of the relaxed ring that lifts off with this gap, without load, N.
    pub fn relaxed_force_n(&self, kind: Kind, gap_mm: f64) -> f64 {
        let contact = self.contact(gap_mm);
        // Traction on the contact's slope carries the rest of a driven wheel's force.
        let traction = if kind.driven { contact.slope() * contact.axial } else { 0.0 };
        self.k_inf * (contact.radial + traction)
    }

    /// Longest run of the model, mm: where the fit ends, be it by the run, by the
    /// relaxed force, or because the gap closes.
    pub fn largest_run_mm(&self, kind: Kind) -> f64 {
        let most = (RUN_END * self.radius_mm).min(MOST_RUN_PART * self.free_run_mm());
        let limit = FORCE_END * self.unit_force_n();
        let beyond = |run| self.relaxed_force_n(kind, self.gap_after_mm(run)) > limit;
        if beyond(most) { halve(0.0, most, 30, |run| !beyond(run)) } else { most }
    }

    /// Speed at which half the crossing is fast, mm/s.
    pub fn half_speed_mm_s(&self, kind: Kind) -> f64 {
        kind.half_speed() * self.radius_mm / self.tau_s
    }

    /// Part of the crossing that is fast, `v / (v + v_half)`.
    pub fn fast_part(&self, kind: Kind, speed_mm_s: f64) -> f64 {
        speed_mm_s / (speed_mm_s + self.half_speed_mm_s(kind))
    }

    /// The effective stiffness at this rig's step and this load.
    pub fn fold(&self, kind: Kind, load_n: f64) -> Folded {
        kind.fold(self.step_mm / self.radius_mm, load_n / self.unit_force_n())
    }

    /// Effective stiffness over k_inf, `1 + (s - 1) x E`, of a crossing with this gap;
    /// `load_n` as in [`force_n`](Self::force_n).
    pub fn stiffness(
        &self,
        direction: Direction,
        speed_mm_s: f64,
        gap_mm: f64,
        load_n: Option<f64>,
    ) -> f64 {
        let kind = Kind { direction, driven: load_n.is_some() };
        let folded = self.fold(kind, load_n.unwrap_or(0.0));
        self.folded_stiffness(kind, &folded, speed_mm_s, gap_mm)
    }

    fn folded_stiffness(&self, kind: Kind, folded: &Folded, speed_mm_s: f64, gap_mm: f64) -> f64 {
        let x = self.fast_part(kind, speed_mm_s);
        let run = self.run_mm(gap_mm) / self.radius_mm;
        1.0 + (self.stiffening - 1.0) * x * effective_stiffness::value(folded, x, run)
    }

    /// Radial force on the wheel that gives this gap, N: `k (I_r + s I_a) + T s` with
    /// `s = I_a / I_r`, pushed `k I_r`. `load_n` is the axial load lifted by friction;
    /// `None` pushes a frictionless wheel.
    pub fn force_n(
        &self,
        direction: Direction,
        speed_mm_s: f64,
        gap_mm: f64,
        load_n: Option<f64>,
    ) -> f64 {
        let kind = Kind { direction, driven: load_n.is_some() };
        let folded = self.fold(kind, load_n.unwrap_or(0.0));
        self.folded_force_n(kind, &folded, speed_mm_s, gap_mm, load_n.unwrap_or(0.0))
    }

    fn folded_force_n(
        &self,
        kind: Kind,
        folded: &Folded,
        speed_mm_s: f64,
        gap_mm: f64,
        load_n: f64,
    ) -> f64 {
        let relaxed = self.relaxed_force_n(kind, gap_mm);
        let stiffness = self.folded_stiffness(kind, folded, speed_mm_s, gap_mm);
        stiffness * relaxed + load_n * self.contact(gap_mm).slope()
    }

    /// Gap at this speed and radial force, mm, by 40 halvings of the run; at the ends of
    /// the model the gap there.
    pub fn gap_mm(
        &self,
        direction: Direction,
        speed_mm_s: f64,
        force_n: f64,
        load_n: Option<f64>,
    ) -> f64 {
        let kind = Kind { direction, driven: load_n.is_some() };
        let load_n = load_n.unwrap_or(0.0);
        let folded = self.fold(kind, load_n);
        let carries = |run: f64| {
            let gap = self.gap_after_mm(run);
            self.folded_force_n(kind, &folded, speed_mm_s, gap, load_n) > force_n
        };
        let (least, most) = (LEAST_RUN * self.radius_mm, self.largest_run_mm(kind));
        self.gap_after_mm(halve(least, most, 40, |run| !carries(run)))
    }

    /// Friction that the lift of `load_n` uses at that instant: `T / C + s`, with the radial
    /// reaction `C = (P - T s) / (1 + s^2)`.
    pub fn utilisation(
        &self,
        direction: Direction,
        speed_mm_s: f64,
        gap_mm: f64,
        load_n: f64,
    ) -> f64 {
        let force = self.force_n(direction, speed_mm_s, gap_mm, Some(load_n));
        let slope = self.contact(gap_mm).slope();
        load_n * (1.0 + slope * slope) / (force - load_n * slope) + slope
    }

    /// The complete crossing.
    pub fn crossing(
        &self,
        direction: Direction,
        speed_mm_s: f64,
        force_n: f64,
        load_n: Option<f64>,
    ) -> Crossing {
        let gap_mm = self.gap_mm(direction, speed_mm_s, force_n, load_n);
        let slope = self.contact(gap_mm).slope();
        let radial_n = match load_n {
            None => force_n,
            Some(load) => (force_n - load * slope) / (1.0 + slope * slope),
        };
        Crossing {
            gap_mm,
            corner_force_n: slope * radial_n,
            impact_stress_pa: self.impact.stress_pa(speed_mm_s),
            vibration_mm: self.impact.vibration_mm(speed_mm_s, radial_n, self.run_mm(gap_mm)),
            utilisation: load_n.map_or(0.0, |load| load / radial_n + slope),
        }
    }
}

/// Halves an interval `count` times towards where `below` ceases to hold.
fn halve(low: f64, high: f64, count: usize, below: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (low, high);
    for _ in 0..count {
        let middle = 0.5 * (low + high);
        if below(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

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
    fn the_longest_run_ends_by_run_force_or_gap() {
        let kind = Kind { direction: Direction::Deploy, driven: false };
        let high = Formula { step_mm: 5.0, ..formula() };
        let force = high.relaxed_force_n(kind, high.gap_after_mm(high.largest_run_mm(kind)));
        assert!((force / (FORCE_END * high.unit_force_n()) - 1.0).abs() < 1e-6, "{force}");
        let low = Formula { step_mm: 2.0, ..formula() };
        assert_eq!(low.largest_run_mm(kind), RUN_END * low.radius_mm);
        let lower = Formula { step_mm: 1.0, ..formula() };
        assert_eq!(lower.largest_run_mm(kind), MOST_RUN_PART * lower.free_run_mm());
    }

    #[test]
    fn at_rest_the_ring_is_relaxed() {
        let f = formula();
        for direction in Direction::ALL {
            for (load, kind) in [(None, false), (Some(0.0), true)] {
                let kind = Kind { direction, driven: kind };
                let (at_rest, relaxed) =
                    (f.force_n(direction, 0.0, 2.0, load), f.relaxed_force_n(kind, 2.0));
                assert!((at_rest / relaxed - 1.0).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn scaled_alike_the_model_is_the_same() {
        // Twice the lengths at twice the speed and eight times the forces.
        let f = formula();
        let twice = Formula {
            radius_mm: 2.0 * f.radius_mm,
            width_mm: 2.0 * f.width_mm,
            step_mm: 2.0 * f.step_mm,
            ..f
        };
        for direction in Direction::ALL {
            let (a, b) = (
                f.gap_mm(direction, 7.0, 45.0, Some(6.0)),
                twice.gap_mm(direction, 14.0, 360.0, Some(48.0)),
            );
            assert!((b / a - 2.0).abs() < 1e-9, "{a} {b}");
        }
    }

    proptest! {
        #[test]
        fn gap_and_force_are_inverse(
            back in any::<bool>(),
            speed in 3.0..100.0f64,
            force in 20.0..150.0f64,
            step_mm in 2.5..6.0f64,
            load in prop::option::of(0.0..6.0f64),
        ) {
            let f = Formula { step_mm, ..formula() };
            let direction = Direction::ALL[usize::from(back)];
            let gap = f.gap_mm(direction, speed, force, load);
            let again = f.force_n(direction, speed, gap, load);
            prop_assert!((again / force - 1.0).abs() < 1e-8, "{again} {force}");
        }

        #[test]
        fn the_gap_falls_with_force(
            back in any::<bool>(),
            speed in 0.5..150.0f64,
            force in 15.0..150.0f64,
            step_mm in 2.0..6.0f64,
            load in prop::option::of(0.0..3.0f64),
        ) {
            let f = Formula { step_mm, ..formula() };
            let direction = Direction::ALL[usize::from(back)];
            let gap = |force| f.gap_mm(direction, speed, force, load);
            prop_assert!(gap(1.05 * force) <= gap(force));
        }

        #[test]
        fn on_deploy_the_gap_grows_with_speed(
            speed in 0.5..100.0f64,
            force in 20.0..120.0f64,
        ) {
            let f = formula();
            let gap = |speed| f.gap_mm(Direction::Deploy, speed, force, Some(6.0));
            prop_assert!(gap(1.1 * speed) > gap(speed));
        }

        #[test]
        fn axial_and_radial_forces_balance(
            back in any::<bool>(),
            speed in 1.0..100.0f64,
            force in 25.0..150.0f64,
            load in 0.0..8.0f64,
        ) {
            let f = formula();
            let crossing = f.crossing(Direction::ALL[usize::from(back)], speed, force, Some(load));
            let slope = f.contact(crossing.gap_mm).slope();
            let (used, axial) = (crossing.utilisation, crossing.corner_force_n);
            let radial = axial / slope;
            prop_assert!((used * radial - axial - load).abs() < 1e-9);
            prop_assert!((radial + used * axial - force).abs() < 1e-9);
            let direction = Direction::ALL[usize::from(back)];
            let same = f.utilisation(direction, speed, crossing.gap_mm, load);
            prop_assert!((same / used - 1.0).abs() < 1e-6, "{same} {used}");
        }
    }
}
