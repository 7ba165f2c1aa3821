//! Jerk-limited speed profile.

use crate::numeric::{between, checked, sqrt};
use crate::rig::{Rig, RigError};
use crate::units::{MillimetresPerSecond, MillimetresPerSecond2, Q16, Travel, per_tick};

/// Limits of the profile.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Profile {
    acceleration: MillimetresPerSecond2,
    /// Change of acceleration in a tick, mm/s^2.
    jerk_per_tick: MillimetresPerSecond2,
    /// Square root of twice the jerk, (mm/s^3)^1/2.
    root_jerk: Q16,
    /// Half the change of acceleration in a tick, mm/s^2.
    half_jerk: MillimetresPerSecond2,
    /// Speed that half of it squared corresponds to, j T^2 / 8, mm/s.
    quantum: MillimetresPerSecond,
}

/// State of the profile: speed not negative, along the run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ProfileState {
    /// Speed, mm/s, Q31.32.
    speed: Travel,
    /// Acceleration, mm/s^2.
    acceleration: MillimetresPerSecond2,
}

impl Profile {
    /// Limits of a rig.
    #[allow(clippy::float_arithmetic, reason = "SI to machine units, once at start")]
    pub fn try_build(rig: &Rig) -> Result<Self, RigError> {
        let jerk = rig.drive.jerk_mm_s3;
        Ok(Self {
            acceleration: checked("drive.acceleration_mm_s2", rig.drive.acceleration_mm_s2)?,
            jerk_per_tick: checked("drive.jerk_mm_s3", jerk * 1e-3)?,
            root_jerk: checked("drive.jerk_mm_s3", libm::sqrt(2.0 * jerk))?,
            half_jerk: checked("drive.jerk_mm_s3", jerk * 0.5e-3)?,
            quantum: checked("drive.jerk_mm_s3", jerk * 1e-6 / 8.0)?,
        })
    }

    /// One tick towards `target`, mm/s, not negative: the acceleration wanted is the one from
    /// which full jerk J in each tick T just reaches the target, `a (a + J) T / 2J = |dv|`,
    /// within the limit; the acceleration follows it by the jerk. Source: time-optimal control
    /// of a double integrator.
    pub fn step(&self, state: &mut ProfileState, target: MillimetresPerSecond) {
        let target = target.max(Q16::ZERO);
        let missing = target - state.speed();
        // Speed error that one more tick of full jerk would overshoot, mm/s.
        let snap = Q16::narrow(per_tick(self.jerk_per_tick)) + Q16::DELTA;
        if missing.abs() <= snap && state.acceleration.abs() <= self.jerk_per_tick {
            state.speed = target.widen();
            state.acceleration = Q16::ZERO;
            return;
        }
        let start = sqrt(missing.abs() + self.quantum);
        let size = between(self.root_jerk * start - self.half_jerk, Q16::ZERO, self.acceleration);
        let wanted = if missing < Q16::ZERO { -size } else { size };
        let change = between(wanted - state.acceleration, -self.jerk_per_tick, self.jerk_per_tick);
        state.acceleration += change;
        state.speed = state.speed.saturating_add(per_tick(state.acceleration)).max(Travel::ZERO);
    }
}

impl ProfileState {
    /// At this speed, mm/s, without acceleration.
    pub fn at(speed: MillimetresPerSecond) -> Self {
        Self { speed: speed.widen(), acceleration: MillimetresPerSecond2::ZERO }
    }

    /// Speed, mm/s.
    pub fn speed(&self) -> MillimetresPerSecond {
        Q16::narrow(self.speed)
    }

    /// Acceleration, mm/s^2.
    pub const fn acceleration(&self) -> MillimetresPerSecond2 {
        self.acceleration
    }

    /// At rest, now.
    pub fn halt(&mut self) {
        *self = Self::default();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn q(x: f64) -> Q16 {
        Q16::from_num(x)
    }

    #[test]
    fn a_change_takes_the_time_of_the_s_curve() {
        let rig = Rig::prototype();
        let profile = Profile::try_build(&rig).unwrap();
        for (from, to) in [(0.0, 30.0), (30.0, 12.0), (12.0, 0.0), (5.0, 8.0)] {
            let mut state = ProfileState { speed: Travel::from_num(from), ..Default::default() };
            let mut ticks = 0;
            while state.speed() != q(to) || state.acceleration != Q16::ZERO {
                profile.step(&mut state, q(to));
                ticks += 1;
                assert!(ticks < 2000);
            }
            let (a, j) = (rig.drive.acceleration_mm_s2, rig.drive.jerk_mm_s3);
            let change = f64::abs(to - from);
            let exact =
                if change > a * a / j { change / a + a / j } else { 2.0 * (change / j).sqrt() };
            let taken = f64::from(ticks) * 1e-3;
            assert!((taken - exact).abs() < 0.006 + 0.02 * exact, "{from} {to} {taken} {exact}");
        }
    }

    proptest! {
        #[test]
        fn limits_hold_whatever_the_targets(targets in proptest::collection::vec(0.0..60.0f64, 1..20)) {
            let rig = Rig::prototype();
            let profile = Profile::try_build(&rig).unwrap();
            let mut state = ProfileState::default();
            for target in targets {
                for _ in 0..60 {
                    let before = state;
                    profile.step(&mut state, q(target));
                    let a = state.acceleration.to_num::<f64>();
                    let jerk = (a - before.acceleration.to_num::<f64>()) * 1e3;
                    prop_assert!(a.abs() <= rig.drive.acceleration_mm_s2 + 1e-3);
                    prop_assert!(jerk.abs() <= rig.drive.jerk_mm_s3 * 1.001);
                    prop_assert!(state.speed() >= Q16::ZERO);
                    prop_assert!(state.speed() <= q(61.0));
                }
            }
        }
    }
}
