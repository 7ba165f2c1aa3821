//! The arm's geometry: from its angle to the wheel centre and the sleeve level.

#![deny(clippy::float_arithmetic)]

use super::angle::Codes;
use crate::numeric::{Table, checked};
use crate::rig::{MAX_STEPS, Rig, RigError};
use crate::units::{Millimetres, Q16, Ratio, q16};

/// Points of the tables over the arm's reach.
const POINTS: usize = 65;

/// Least and largest sine of the arm angle that is not taken for a sensor fault:
/// the reach that the parameters are checked against is 0.1 to 0.9.
const SINE: (f64, f64) = (0.05, 0.95);

/// How far the wheel must stand from a level, in steps, before the next is
/// reported: a tenth of a step (0.4 mm, ten codes of the sensor) beyond the middle.
const LEVEL_SWITCH: Ratio = q16(600_000);

/// Geometry of arm and sleeve.
///
/// `r = r_pivot + L sin(angle)`: distance of the wheel centre from the pillar
/// axis, mm, growing outwards. Error against the formula over the whole reach of the
/// prototype: 8e-5 mm in the radius, 2.5e-4 in the tangent (3e-5 up to 60
/// degrees); the sensor's half code is 0.019 to 0.022 mm. Cost: a table each.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Arm {
    radius: Table<POINTS>,
    tangent: Table<POINTS>,
    /// Wheel-centre radius on the outermost wall without compression.
    outermost: Millimetres,
    /// One over the step height, 1/mm.
    per_step: Q16,
}

impl Arm {
    /// The arm of `rig`.
    ///
    /// # Errors
    /// [`RigError`] if a dimension does not fit the format.
    #[allow(clippy::float_arithmetic, reason = "SI to machine units, once at start")]
    pub fn try_build(rig: &Rig) -> Result<Self, RigError> {
        let geometry = &rig.rig;
        let radians = 2.0 * core::f64::consts::PI / 16_384.0;
        let (lo, hi) = (libm::asin(SINE.0) / radians, libm::asin(SINE.1) / radians);
        let outside = RigError::OutOfRange {
            key: "rig.arm_length_mm",
            value: geometry.arm_length_mm,
            min: 20.0,
            max: 1000.0,
        };
        let radius = Table::build(lo, hi, |codes| {
            geometry.arm_pivot_radius_mm + geometry.arm_length_mm * libm::sin(codes * radians)
        });
        let tangent = Table::build(lo, hi, |codes| libm::tan(codes * radians));
        Ok(Self {
            radius: radius.ok_or(outside)?,
            tangent: tangent.ok_or(outside)?,
            outermost: checked("rig.wall_radius_mm", rig.centre_radius_mm(0))?,
            per_step: checked("rig.step_height_mm", 1.0 / geometry.step_height_mm)?,
        })
    }

    /// Least and largest angle that the arm can take.
    #[must_use]
    pub fn reach(&self) -> (Codes, Codes) {
        (self.radius.lo(), self.radius.hi())
    }

    /// Distance of the wheel centre from the pillar axis, mm.
    #[must_use]
    pub fn radius(&self, angle: Codes) -> Millimetres {
        self.radius.eval(angle)
    }

    /// Tangent of the arm angle: radial force per axial thrust through the arm.
    #[must_use]
    pub fn tangent(&self, angle: Codes) -> Ratio {
        self.tangent.eval(angle)
    }

    /// Height of the wall under the wheel above the outermost one, in steps, not
    /// rounded: `(r_0 + compression - r) / h`. Compression brings the centre
    /// nearer to the wall, so it is taken off the radius first.
    #[must_use]
    pub fn steps_up(&self, radius: Millimetres, compression: Millimetres) -> Ratio {
        (self.outermost + compression - radius) * self.per_step
    }

    /// Sleeve level under the wheel: 0 at the outermost wall, one more per step,
    /// nearest to [`steps_up`](Self::steps_up). With a `previous` level it changes
    /// only when the wheel stands 0.6 steps from that, so that it does not flutter
    /// half way up a step.
    #[must_use]
    pub fn level(&self, previous: Option<u8>, radius: Millimetres, compression: Millimetres) -> u8 {
        let steps = self.steps_up(radius, compression);
        match previous {
            Some(level) if (steps - Ratio::from_num(level)).abs() <= LEVEL_SWITCH => level,
            _ => steps.round().clamp(0, MAX_STEPS as i32 + 1) as u8,
        }
    }
}

#[cfg(test)]
#[allow(clippy::float_arithmetic, reason = "the reference is in f64")]
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
        let (lo, hi) = arm.reach();
        let (mut worst_r, mut worst_t, mut worst_t60) = (0.0_f64, 0.0_f64, 0.0_f64);
        let mut angle = lo;
        while angle <= hi {
            let theta = angle.to_num::<f64>() * RADIANS;
            let r = 20.0 + 145.0 * theta.sin();
            worst_r = worst_r.max((arm.radius(angle).to_num::<f64>() - r).abs());
            let error = (arm.tangent(angle).to_num::<f64>() - theta.tan()).abs();
            worst_t = worst_t.max(error);
            if theta <= core::f64::consts::FRAC_PI_3 {
                worst_t60 = worst_t60.max(error);
            }
            angle += Codes::from_num(0.37);
        }
        assert!(worst_r <= 8e-5, "{worst_r}");
        assert!(worst_t <= 2.5e-4, "{worst_t}");
        assert!(worst_t60 <= 3e-5, "{worst_t60}");
    }

    #[test]
    fn half_a_code_is_the_stated_distance() {
        let arm = arm();
        for level in 0..4 {
            let r = Rig::prototype().centre_radius_mm(level);
            let theta = ((r - 20.0) / 145.0).asin();
            let angle = Codes::from_num(theta / RADIANS);
            let half = Codes::from_num(0.5);
            let step = (arm.radius(angle + half) - arm.radius(angle)).to_num::<f64>();
            assert!((0.019..=0.022).contains(&step), "{step}");
        }
    }

    #[test]
    fn the_level_switches_past_the_middle_and_back_short_of_it() {
        let arm = arm();
        let zero = Millimetres::ZERO;
        let at = |mm: f64| Millimetres::from_num(mm);
        assert_eq!(arm.level(None, at(125.0), zero), 0);
        assert_eq!(arm.level(None, at(122.9), zero), 1);
        assert_eq!(arm.level(Some(0), at(122.7), zero), 0);
        assert_eq!(arm.level(Some(0), at(122.5), zero), 1);
        assert_eq!(arm.level(Some(1), at(123.3), zero), 1);
        assert_eq!(arm.level(Some(1), at(123.5), zero), 0);
        assert_eq!(arm.level(None, at(140.0), zero), 0);
        assert_eq!(arm.level(None, at(60.0), zero), MAX_STEPS as u8 + 1);
    }

    #[test]
    fn compression_is_taken_off_the_radius() {
        let arm = arm();
        // On level 2 (centre at 117 mm) with 1.5 mm of compression.
        let (r, c) = (Millimetres::from_num(118.5), Millimetres::from_num(1.5));
        assert_eq!(arm.steps_up(r, c), Ratio::from_num(2));
        assert_eq!(arm.level(None, r, c), 2);
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
            let got = arm.level(None, Millimetres::from_num(r), Millimetres::from_num(compression));
            prop_assert_eq!(usize::from(got), level);
        }

        #[test]
        fn any_radius_stays_without_panic(r in any::<i32>(), c in any::<i32>(), p in any::<u8>()) {
            let q = |bits| Q16::from_bits(bits);
            let _ = arm().level(Some(p), q(r), q(c));
        }
    }
}
