//! A wheel that is slowest shortly before it lifts off, and speeds up again at once.

#![deny(clippy::float_arithmetic)]

use crate::numeric::checked;
use crate::rig::{Rig, RigError};
use crate::units::{Millimetres, MillimetresPerSecond, Ratio, Seconds, q16};

/// Travel over which the speed before lift-off counts, mm. With the mean over it, 130 crossings of
/// the ring whose speed dips open the gap of a constant speed to 5 % of that speed.
const REMEMBERED: Millimetres = q16(600_000);

/// With the slowest speed v, the jerk j and the time t before lift-off, the distance from the
/// slowest place is `v t + j t^3 / 6`, and over the travel D that the tread remembers the mean
/// speed is `v / (1 - j t^3 / 6D)`. Source: kinematics.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Dip {
    /// Time before lift-off, s.
    pub time: Seconds,
    /// Travel in it beyond that at the slowest speed, mm.
    gained: Millimetres,
    /// The slowest speed, as a part of that which the tread remembers.
    pub part: Ratio,
}

impl Dip {
    /// That of a rig.
    #[allow(clippy::float_arithmetic, reason = "SI to machine units, once at start")]
    pub fn try_build(rig: &Rig) -> Result<Self, RigError> {
        let jerk = rig.drive.jerk_mm_s3;
        let remembered = REMEMBERED.to_num::<f64>();
        // Half of the remembered travel is left to the slowest speed.
        let most = libm::cbrt(3.0 * remembered / jerk);
        let time = (rig.drive.acceleration_mm_s2 / jerk).min(most);
        let gained = jerk * time * time * time / 6.0;
        Ok(Self {
            time: checked("drive.jerk_mm_s3", time)?,
            gained: checked("drive.jerk_mm_s3", gained)?,
            part: checked("drive.jerk_mm_s3", 1.0 - gained / remembered)?,
        })
    }

    /// Distance to lift-off at which the wheel is slowest, mm: at most what the tread remembers.
    pub fn distance(&self, slowest: MillimetresPerSecond) -> Millimetres {
        (slowest * self.time + self.gained).min(REMEMBERED)
    }
}

#[cfg(test)]
#[allow(clippy::float_arithmetic, reason = "the reference is in f64")]
mod tests {
    use super::*;
    use crate::units::Q16;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_mean_over_the_remembered_travel_is_that_of_the_motion(
            slowest in 1.5..11.0f64,
            jerk in 1000.0..20_000.0f64,
            acceleration in 50.0..500.0f64,
        ) {
            let mut rig = Rig::prototype();
            rig.drive.jerk_mm_s3 = jerk;
            rig.drive.acceleration_mm_s2 = acceleration;
            let dip = Dip::try_build(&rig).unwrap();
            let time = dip.time.to_num::<f64>();
            // From the slowest place on with full jerk, for that time; before it at rest in speed.
            let sped_up = slowest * time + jerk * time.powi(3) / 6.0;
            prop_assume!(sped_up < 0.6);
            let distance = dip.distance(Q16::from_num(slowest)).to_num::<f64>();
            prop_assert!((distance - sped_up).abs() < 1e-3, "{distance} {sped_up}");
            let mean = 0.6 / (time + (0.6 - sped_up) / slowest);
            let got = slowest / dip.part.to_num::<f64>();
            prop_assert!((got / mean - 1.0).abs() < 2e-3, "{got} {mean}");
            // Full acceleration is not reached, and half of the travel is left.
            prop_assert!(jerk * time <= 1.01 * acceleration && dip.part >= Q16::from_num(0.499));
        }
    }
}
