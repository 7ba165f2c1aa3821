//! Arm geometry: from its angle to the wheel centre and the sleeve level.

use super::angle::Codes;
use crate::numeric::{between, checked, reciprocal_of_normalised, sin_cos};
use crate::rig::{MAX_STEPS, Rig, RigError};
use crate::units::{Millimetres, Q16, Ratio, q16};

/// Least and largest sine of a plausible arm angle; parameters keep to 0.1 to 0.9.
const SINE: (f64, f64) = (0.05, 0.95);

/// Distance from a level at which the next one is reported, steps: a tenth of a step (0.4 mm,
/// ten codes of the sensor) beyond the middle.
const LEVEL_SWITCH: Ratio = q16(600_000);

/// Geometry of arm and sleeve: `r = r_pivot + L sin(angle)` is the distance of the wheel centre
/// from the pillar axis, mm, growing outwards. Error over the reach of the prototype: 2e-5 mm in
/// the radius, 2e-5 in the tangent; the sensor's half code is 0.019 to 0.022 mm.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Arm {
    /// Least and largest plausible angle.
    pub(super) reach: (Codes, Codes),
    pivot: Millimetres,
    length: Millimetres,
    /// Wheel-centre radius on the outermost wall without compression.
    outermost: Millimetres,
    /// One over the step height, 1/mm.
    per_step: Q16,
}

impl Arm {
    /// The arm of `rig`.
    #[allow(clippy::float_arithmetic, reason = "SI to machine units, once at start")]
    pub fn try_build(rig: &Rig) -> Result<Self, RigError> {
        let geometry = &rig.rig;
        let radians = 2.0 * core::f64::consts::PI / 16_384.0;
        let (lo, hi) = (libm::asin(SINE.0) / radians, libm::asin(SINE.1) / radians);
        Ok(Self {
            reach: (checked("rig.arm_length_mm", lo)?, checked("rig.arm_length_mm", hi)?),
            pivot: checked("rig.arm_pivot_radius_mm", geometry.arm_pivot_radius_mm)?,
            length: checked("rig.arm_length_mm", geometry.arm_length_mm)?,
            outermost: checked("rig.wall_radius_mm", rig.centre_radius_mm(0))?,
            per_step: checked("rig.step_height_mm", 1.0 / geometry.step_height_mm)?,
        })
    }

    /// Radius of the wheel centre, mm, and tangent of the arm angle (radial force per axial
    /// thrust). Beyond its reach the arm counts as at the end of it.
    pub fn stance(&self, angle: Codes) -> (Millimetres, Ratio) {
        let angle = between(angle, self.reach.0, self.reach.1);
        // A turn is 2^14 codes of Q16, so 2^30: to 2^32.
        let (sine, cosine) = sin_cos((angle.to_bits() as u32) << 2);
        let lever = (i64::from(self.length.to_bits()) * i64::from(sine) + (1 << 29)) >> 30;
        // Positive within the reach; the bound is for the shift.
        let cosine = cosine.max(1) as u32;
        let shift = cosine.leading_zeros();
        let tangent = u64::from(reciprocal_of_normalised(cosine << shift)) * sine.max(0) as u64;
        (
            self.pivot + Q16::saturating_from_bits(lever),
            Q16::saturating_from_bits((tangent >> (47 - shift)) as i64),
        )
    }

    /// Height of the wall under the wheel above the outermost one, in steps, not rounded:
    /// `(r_0 + compression - r) / h`.
    pub fn steps_up(&self, radius: Millimetres, compression: Millimetres) -> Ratio {
        (self.outermost + compression - radius) * self.per_step
    }

    /// Sleeve level under the wheel: 0 at the outermost wall, one more per step. It changes from
    /// `previous` only when the wheel is 0.6 steps from that.
    pub fn level(&self, previous: Option<u8>, steps: Ratio) -> u8 {
        match previous {
            Some(level)
                if (steps - Ratio::from_bits(i32::from(level) << 16)).abs() <= LEVEL_SWITCH =>
            {
                level
            }
            _ => steps.round().clamp(0, MAX_STEPS as i32 + 1) as u8,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const RADIANS: f64 = 2.0 * core::f64::consts::PI / 16_384.0;

    fn arm() -> Arm {
        Arm::try_build(&Rig::prototype()).expect("in range")
    }

    #[test]
    fn radius_and_tangent_follow_the_geometry_over_the_whole_reach() {
        let arm = arm();
        let (lo, hi) = arm.reach;
        let (mut worst_r, mut worst_t) = (0.0_f64, 0.0_f64);
        let mut angle = lo;
        while angle <= hi {
            let theta = angle.to_num::<f64>() * RADIANS;
            let r = 20.0 + 145.0 * theta.sin();
            worst_r = worst_r.max((arm.stance(angle).0.to_num::<f64>() - r).abs());
            let error = (arm.stance(angle).1.to_num::<f64>() - theta.tan()).abs();
            worst_t = worst_t.max(error);
            angle += Codes::from_num(0.37);
        }
        assert!(worst_r <= 2e-5, "{worst_r}");
        assert!(worst_t <= 2e-5, "{worst_t}");
    }

    #[test]
    fn half_a_code_is_the_stated_distance() {
        let arm = arm();
        for level in 0..4 {
            let r = Rig::prototype().centre_radius_mm(level);
            let theta = ((r - 20.0) / 145.0).asin();
            let angle = Codes::from_num(theta / RADIANS);
            let half = Codes::from_num(0.5);
            let step = (arm.stance(angle + half).0 - arm.stance(angle).0).to_num::<f64>();
            assert!((0.019..=0.022).contains(&step), "{step}");
        }
    }

    #[test]
    fn the_level_switches_past_the_middle_and_back_short_of_it() {
        let arm = arm();
        let zero = Millimetres::ZERO;
        let at = |mm: f64| Millimetres::from_num(mm);
        assert_eq!(arm.level(None, arm.steps_up(at(125.0), zero)), 0);
        assert_eq!(arm.level(None, arm.steps_up(at(122.9), zero)), 1);
        assert_eq!(arm.level(Some(0), arm.steps_up(at(122.7), zero)), 0);
        assert_eq!(arm.level(Some(0), arm.steps_up(at(122.5), zero)), 1);
        assert_eq!(arm.level(Some(1), arm.steps_up(at(123.3), zero)), 1);
        assert_eq!(arm.level(Some(1), arm.steps_up(at(123.5), zero)), 0);
        assert_eq!(arm.level(None, arm.steps_up(at(140.0), zero)), 0);
        assert_eq!(arm.level(None, arm.steps_up(at(60.0), zero)), MAX_STEPS as u8 + 1);
    }

    proptest! {
        #[test]
        fn every_level_is_found_under_any_compression(
            level in 0_usize..=3,
            compression in 0.0_f64..2.5,
            noise in -0.05_f64..0.05,
        ) {
            let arm = arm();
            let r = Rig::prototype().centre_radius_mm(level) + compression + noise;
            let up = arm.steps_up(Millimetres::from_num(r), Millimetres::from_num(compression));
            let got = arm.level(None, up);
            prop_assert_eq!(usize::from(got), level);
        }

        #[test]
        fn any_radius_stays_without_panic(r in any::<i32>(), c in any::<i32>(), p in any::<u8>()) {
            let q = |bits| Q16::from_bits(bits);
            let _ = arm().level(Some(p), arm().steps_up(q(r), q(c)));
            let _ = arm().stance(q(r));
        }
    }
}
