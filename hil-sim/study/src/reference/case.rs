//! What is crossed and how, for all stages alike.

use interstage::rig::Rig;

use super::error::{ReferenceError, positive, require};
use super::solid::Solid;
use hil_sim::plant::balance::Axial;
use hil_sim::plant::ring::RingParameters;

/// How finely a crossing is resolved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Resolution {
    /// Elements around the ring.
    pub elements: usize,
    /// Longest axial way per step, mm.
    pub stride_mm: f64,
    /// Longest step of the dynamic form, s.
    pub step_s: f64,
}

impl Resolution {
    /// For histories: gap and force within 0.1 % of the converged ones.
    pub const HISTORY: Self = Self { elements: 2880, stride_mm: 0.01, step_s: 2e-4 };
    /// For figures: gap and force within 0.02 % of the converged ones.
    pub const FIGURE: Self = Self { elements: 5760, stride_mm: 0.005, step_s: 1e-4 };
}

/// One crossing of one step, on the way out.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    /// Wheel, tread, arm, moved mass.
    pub rig: Rig,
    /// Axial speed, mm/s, held.
    pub speed_mm_s: f64,
    /// Radial preload, N, held.
    pub preload_n: f64,
    /// Height of the step, mm.
    pub step_height_mm: f64,
    /// Frictionless ([`Axial::Pushed`], to which the tread is fitted), or driven by
    /// torque against the part of the top load that this wheel lifts.
    pub axial: Axial,
    /// How finely.
    pub resolution: Resolution,
}

impl Case {
    /// A frictionless crossing of the rig's own step.
    #[must_use]
    pub fn new(rig: Rig, speed_mm_s: f64, preload_n: f64) -> Self {
        Self {
            speed_mm_s,
            preload_n,
            step_height_mm: rig.rig.step_height_mm,
            axial: Axial::Pushed,
            resolution: Resolution::HISTORY,
            rig,
        }
    }

    /// The four cases of the study's theory, top load 60 N: mm/s and N of (5, 100),
    /// (5, 120), (8, 100), (3, 120).
    #[must_use]
    pub fn study() -> [Self; 4] {
        [(5.0, 100.0), (5.0, 120.0), (8.0, 100.0), (3.0, 120.0)]
            .map(|(speed, preload)| Self::new(Rig::fe(), speed, preload))
    }

    /// The same crossing, driven by torque against this wheel's share of the top load.
    #[must_use]
    pub fn driven(self) -> Self {
        let load_n = self.rig.plant.top_load_n * self.rig.plant.top_load_share;
        Self { axial: Axial::Driven(load_n), ..self }
    }

    /// The tread as a solid per area: moduli in Pa/m.
    ///
    /// # Errors
    /// If the rig's numbers are none of a passive solid.
    pub fn tread(&self) -> Result<Solid, ReferenceError> {
        let tread = &self.rig.tread;
        let k_inf = tread.k_inf_pa_per_m;
        Solid::of_relaxation(k_inf, k_inf * tread.stiffening, tread.tau_s)
    }

    /// Wheel and tread as a ring.
    #[must_use]
    pub fn ring(&self) -> RingParameters {
        RingParameters::of(&self.rig, self.resolution.elements)
    }

    /// Angle between the wall and the path that a rigid wheel takes at the touch of the
    /// corner, rad: `cos phi = (R - h) / R`.
    #[must_use]
    pub fn climb_angle(&self) -> f64 {
        (1.0 - self.step_height_mm / self.rig.rig.wheel_radius_mm).acos()
    }

    /// Speed at which tread and corner close along their normal, mm/s: `v sin phi`.
    #[must_use]
    pub fn closing_speed_mm_s(&self) -> f64 {
        self.speed_mm_s * self.climb_angle().sin()
    }

    /// Everything lies in its range.
    ///
    /// # Errors
    /// [`ReferenceError::OutOfRange`] names the argument.
    pub fn check(&self) -> Result<(), ReferenceError> {
        positive("speed_mm_s", self.speed_mm_s)?;
        positive("preload_n", self.preload_n)?;
        positive("stride_mm", self.resolution.stride_mm)?;
        positive("step_s", self.resolution.step_s)?;
        positive("moved_mass_kg", self.rig.plant.moved_mass_kg)?;
        let radius = self.rig.rig.wheel_radius_mm;
        positive("wheel_radius_mm", radius)?;
        positive("wheel_width_mm", self.rig.rig.wheel_width_mm)?;
        let height = self.step_height_mm;
        let climbs = height > 0.0 && height <= 0.5 * radius;
        require("step_height_mm", height, climbs, "above 0, to half the wheel radius")?;
        let elements = self.resolution.elements;
        require("elements", elements as f64, elements >= 90, "90 at least")?;
        self.tread().map(|_| ())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn closing_speeds_of_the_study_are_millimetres_per_second() {
        let [slow, _, fast, _] = Case::study();
        assert!((slow.climb_angle().to_degrees() - 32.86).abs() < 5e-3);
        assert!((slow.closing_speed_mm_s() - 2.713).abs() < 1e-3);
        assert!((fast.closing_speed_mm_s() - 4.341).abs() < 1e-3);
    }

    #[test]
    fn arguments_out_of_range_are_named() {
        let good = || Case::new(Rig::fe(), 5.0, 100.0);
        assert_eq!(good().check(), Ok(()));
        let cases = [
            ("speed_mm_s", Case { speed_mm_s: 0.0, ..good() }),
            ("speed_mm_s", Case { speed_mm_s: f64::NAN, ..good() }),
            ("preload_n", Case { preload_n: -1.0, ..good() }),
            ("step_height_mm", Case { step_height_mm: 13.0, ..good() }),
            (
                "elements",
                Case { resolution: Resolution { elements: 8, ..Resolution::HISTORY }, ..good() },
            ),
        ];
        for (wanted, case) in cases {
            let error = case.check().unwrap_err();
            let ReferenceError::OutOfRange { argument, .. } = error else { panic!("{error}") };
            assert_eq!(argument, wanted);
        }
        let mut rig = Rig::fe();
        rig.tread.stiffening = 0.5;
        let error = Case::new(rig, 5.0, 100.0).check().unwrap_err();
        assert!(error.to_string().starts_with("instant is "), "{error}");
    }

    #[test]
    fn driven_lifts_its_share_of_the_top_load() {
        assert_eq!(Case::new(Rig::fe(), 5.0, 100.0).driven().axial, Axial::Driven(20.0));
    }
}
