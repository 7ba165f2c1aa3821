//! The arm with the wheel at its tip, and the published modes.

use super::modal::Modal;
use crate::reference::beam::{Beam, Ends, Mode, Tip};
use crate::reference::case::Case;
use crate::reference::error::ReferenceError;

/// First constrained mode of the rig, Hz. Published.
pub const CONSTRAINED_HZ: f64 = 276.0;

/// Seventh free mode of the rig, Hz: the first that is no motion as a whole. Published.
pub const FREE_HZ: f64 = 163.0;

/// Loss factor of the bolted arm. Chosen: hysteresis of the alloy is a hundredth of
/// that; joints of small machines lie at 0.01 to 0.04.
const LOSS_FACTOR: f64 = 0.02;

/// The drive arm, clamped at the pillar, with what is at the wheel as a point mass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arm {
    /// The arm itself.
    pub beam: Beam,
    /// Mass at its tip.
    pub tip: Tip,
    /// Angle between arm and pillar, rad, with the wheel on the outermost wall.
    pub angle_rad: f64,
    /// Loss factor.
    pub loss_factor: f64,
}

impl Arm {
    /// The arm of the rig, its tip mass, 62.9 g, such that the first mode is the
    /// published constrained one.
    ///
    /// That mass is fitted to the one frequency: it stands for wheel and axle and for what
    /// yields in the clamp. The published free mode cannot be met by the same arm: a clamp
    /// takes two freedoms from it, so that the first mode with it lies at most as high as
    /// the first elastic one without (Rayleigh), and 163 Hz is below 276. The free rig
    /// therefore bends elsewhere first, in a part that its base holds when it is bolted
    /// down, of which nothing is published.
    ///
    /// # Errors
    /// If the rig's arm is out of range.
    pub fn of(case: &Case) -> Result<Self, ReferenceError> {
        let beam = Beam::drive_arm();
        let mass_kg = beam.tip_mass_for(CONSTRAINED_HZ)?;
        let geometry = &case.rig.rig;
        let reach =
            geometry.wall_radius_mm - geometry.wheel_radius_mm - geometry.arm_pivot_radius_mm;
        let sine = (reach / geometry.arm_length_mm).clamp(-1.0, 1.0);
        Ok(Self {
            beam,
            tip: Tip { mass_kg, spring_n_per_m: 0.0 },
            angle_rad: sine.asin(),
            loss_factor: LOSS_FACTOR,
        })
    }

    /// The arm with the tread as a spring to the wall: stiffness per area of an instant
    /// times the patch, by its part across the arm.
    ///
    /// # Errors
    /// If the rig's numbers are out of range.
    pub fn on_tread(self, case: &Case, patch_mm2: f64) -> Result<Self, ReferenceError> {
        let radial = case.tread()?.instant() * patch_mm2 * 1e-6;
        let spring_n_per_m = radial * self.angle_rad.cos().powi(2);
        Ok(Self { tip: Tip { spring_n_per_m, ..self.tip }, ..self })
    }

    /// Its first `count` modes.
    ///
    /// # Errors
    /// If `count` is out of range.
    pub fn modes(&self, count: usize) -> Result<Vec<Mode>, ReferenceError> {
        Ok(self.beam.modes(Ends::ClampedFree, self.tip, count)?)
    }

    /// Deflection at the tip per force held there, m/N: `L^3/(3 EI)`, and the spring.
    #[must_use]
    pub fn compliance_m_per_n(&self) -> f64 {
        let bending = 3.0 * self.beam.bending_stiffness_n_m2() / self.beam.length_m.powi(3);
        1.0 / (bending + self.tip.spring_n_per_m)
    }

    /// Its motion at the tip by its first `count` modes.
    ///
    /// # Errors
    /// If `count` is out of range.
    pub fn modal(&self, count: usize) -> Result<Modal, ReferenceError> {
        let shapes = self.beam.shapes(Ends::ClampedFree, self.tip, count)?;
        Ok(Modal::new(&shapes, 0.5 * self.loss_factor, self.compliance_m_per_n()))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn arm() -> Arm {
        Arm::of(&Case::study()[0]).unwrap()
    }

    #[test]
    fn the_published_constrained_mode_is_met_by_a_stated_mass() {
        let arm = arm();
        assert!((arm.tip.mass_kg - 0.062_857).abs() < 5e-7);
        assert!((arm.modes(1).unwrap()[0].frequency_hz - CONSTRAINED_HZ).abs() < 1e-9);
        assert!((arm.angle_rad.to_degrees() - 46.397).abs() < 1e-2);
    }

    #[test]
    fn on_its_tread_the_arm_is_stiffer() {
        let case = &Case::study()[0];
        let held = arm().on_tread(case, 250.0).unwrap();
        assert!(
            (held.tip.spring_n_per_m / 304e3 - 1.0).abs() < 0.01,
            "{}",
            held.tip.spring_n_per_m
        );
        let (held, free) = (held.modes(3).unwrap(), arm().modes(3).unwrap());
        for (held, free) in held.iter().zip(&free) {
            assert!(held.frequency_hz > free.frequency_hz);
        }
    }

    proptest! {
        #[test]
        fn no_tip_mass_brings_the_free_arm_below_the_clamped_one(exponent in -3.0..4.0_f64) {
            let beam = Beam::drive_arm();
            let tip = Tip { mass_kg: beam.mass_kg() * 10_f64.powf(exponent), spring_n_per_m: 0.0 };
            let first = |ends| beam.modes(ends, tip, 1).unwrap()[0].frequency_hz;
            prop_assert!(first(Ends::FreeFree) > first(Ends::ClampedFree));
            prop_assert!(first(Ends::PinnedFree) > first(Ends::ClampedFree));
        }
    }
}
