//! Duration of changes of speed and preload, and the distance rolled meanwhile.

use crate::numeric::{Divisor, checked, sqrt};
use crate::rig::{Rig, RigError};
use crate::units::{
    Millimetres, MillimetresPerSecond, MillimetresPerSecond2, Newtons, Q16, Seconds, q16,
};

/// Part of the actuator's slew that the reference uses. A slower actuator is waited for
/// ([`PreloadLoop`](crate::control::preload_loop::PreloadLoop)).
pub const SLEW_PART: Q16 = q16(980_000);

/// Limits of the speed profile and of the pre-tightener.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Timing {
    acceleration: MillimetresPerSecond2,
    /// Division by the acceleration, by the knee and by the rate.
    by_acceleration: Divisor,
    by_knee: Divisor,
    by_rate: Divisor,
    /// Time to reach full acceleration, s.
    build_up: Seconds,
    /// Speed change below which full acceleration is not reached, mm/s.
    knee: MillimetresPerSecond,
    /// From command to settled force, without the ramp: dead time, lags, reserve, s.
    latency: Seconds,
}

impl Timing {
    /// Limits of a rig.
    #[allow(clippy::float_arithmetic, reason = "SI to machine units, once at start")]
    pub fn try_build(rig: &Rig) -> Result<Self, RigError> {
        let (a, j) = (rig.drive.acceleration_mm_s2, rig.drive.jerk_mm_s3);
        // After the end of a ramp the force lags by slew x lag, which two more lags bring to a
        // few tenths of a newton; the reserve covers times that are half as long again.
        let rate_part = SLEW_PART.to_num::<f64>();
        let (delay, lag) = (rig.preload.delay_s, rig.preload.lag_s);
        let latency = delay + 2.0 * lag + 0.5 * (delay + lag);
        Ok(Self {
            acceleration: checked("drive.acceleration_mm_s2", a)?,
            by_acceleration: Divisor::build("drive.acceleration_mm_s2", a)?,
            by_knee: Divisor::build("drive.jerk_mm_s3", (a * a / j).clamp(1e-4, 30_000.0))?,
            by_rate: Divisor::build("preload.slew_n_per_s", rig.preload.slew_n_per_s * rate_part)?,
            build_up: checked("drive.jerk_mm_s3", a / j)?,
            knee: checked("drive.jerk_mm_s3", (a * a / j).min(30_000.0))?,
            latency: checked("preload.delay_s", latency)?,
        })
    }

    /// Duration of a jerk-limited change of speed, s: `D/a + a/j`, or
    /// `2 sqrt(D/j)` below the knee `a^2/j`. Source: S-curve kinematics.
    pub fn speed_change(&self, change: MillimetresPerSecond) -> Seconds {
        let change = change.abs();
        if change >= self.knee {
            self.by_acceleration.divide(change) + self.build_up
        } else {
            // 2 (a/j) sqrt(D / (a^2/j)).
            let part = sqrt(self.by_knee.divide(change));
            self.build_up * part * q16(2_000_000)
        }
    }

    /// Distance of that change between two speeds, mm: the S-curve is symmetric, so its
    /// duration times the mean speed.
    pub fn brake_distance(
        &self,
        from: MillimetresPerSecond,
        to: MillimetresPerSecond,
    ) -> Millimetres {
        let mean = (from + to) * q16(500_000);
        self.speed_change(from - to) * mean
    }

    /// The same from a speed that still rises with this acceleration: until that is taken back it
    /// comes to a peak.
    pub fn distance_to(
        &self,
        from: MillimetresPerSecond,
        acceleration: MillimetresPerSecond2,
        to: MillimetresPerSecond,
    ) -> Millimetres {
        let rising = acceleration.max(Q16::ZERO);
        let until_peak = self.until_level(rising);
        let peak = from + rising * until_peak.half();
        peak * until_peak + self.brake_distance(peak, to)
    }

    /// Travel from this speed until full acceleration is reached, mm, and the time that it takes, s:
    /// `v t + a t^2 / 6` with `t = a / j`.
    pub fn build_up(&self, speed: MillimetresPerSecond) -> (Millimetres, Seconds) {
        let time = self.build_up;
        let sixth = self.acceleration * time * q16(166_667);
        ((speed + sixth) * time, time)
    }

    /// Time in which the jerk reduces this acceleration to zero, s.
    pub fn until_level(&self, acceleration: MillimetresPerSecond2) -> Seconds {
        self.by_acceleration.divide(acceleration) * self.build_up
    }

    /// Time from the command until a preload change is complete, s.
    pub fn preload_change(&self, change: Newtons) -> Seconds {
        self.latency + self.by_rate.divide(change.abs())
    }

    /// Time in which the reference runs through a preload change, s.
    pub fn ramp(&self, change: Newtons) -> Seconds {
        self.by_rate.divide(change)
    }

    /// Upper bound of the braking distance from up to `cruise` at any acceleration, mm: the
    /// highest speed that it leads to, for as long as it takes to lose all of it.
    pub fn longest_brake_distance(&self, cruise: MillimetresPerSecond) -> Millimetres {
        let peak = cruise + (self.acceleration * self.build_up).half();
        self.speed_change(peak) * peak + q16(100_000)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn the_latency_covers_delay_and_lag() {
        let timing = Timing::try_build(&Rig::prototype()).unwrap();
        let still = timing.preload_change(Q16::ZERO).to_num::<f64>();
        assert!((still - 0.27).abs() < 1e-3, "{still}");
    }

    proptest! {
        #[test]
        fn no_braking_takes_longer_than_the_longest(
            cruise in 0.0..100.0f64,
            part in 0.0..1.0f64,
            to in 0.0..1.0f64,
            rising in 0.0..1.0f64,
        ) {
            let rig = Rig::prototype();
            let timing = Timing::try_build(&rig).unwrap();
            let q = Q16::from_num::<f64>;
            let rising = q(rising * rig.drive.acceleration_mm_s2);
            let until = timing.until_level(rising);
            let peak = q(cruise * part) + (rising * until).half();
            let distance = (peak * until) + timing.brake_distance(peak, q(cruise * to));
            let longest = timing.longest_brake_distance(q(cruise));
            prop_assert!(distance <= longest, "{distance} {longest}");
        }

        #[test]
        fn speed_changes_match_the_s_curve(from in 0.0..100.0f64, to in 0.0..100.0f64) {
            let rig = Rig::prototype();
            let timing = Timing::try_build(&rig).unwrap();
            let (a, j) = (rig.drive.acceleration_mm_s2, rig.drive.jerk_mm_s3);
            let change = (from - to).abs();
            let exact =
                if change >= a * a / j { change / a + a / j } else { 2.0 * (change / j).sqrt() };
            let got = timing.speed_change(Q16::from_num(from - to)).to_num::<f64>();
            prop_assert!((got - exact).abs() < 2e-4 + 1e-3 * exact, "{got} {exact}");
            let distance = timing.brake_distance(Q16::from_num(from), Q16::from_num(to));
            let distance = distance.to_num::<f64>();
            let error = (distance - exact * 0.5 * (from + to)).abs();
            prop_assert!(error < 0.02 + 1e-3 * distance, "{distance}");
        }
    }
}
