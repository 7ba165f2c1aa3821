//! Speed profile of the oracle: as late as acceleration and jerk allow.

use interstage::rig::Rig;

use crate::session::{TICK_S, longest_s};

/// A stretch of the run that is crossed slowly: its ends, mm along the run, and its speed, mm/s.
pub(super) type Slow = Option<(f64, f64, f64)>;

/// Limits of the speed profile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Limits {
    cruise_mm_s: f64,
    acceleration: f64,
    jerk: f64,
    /// Ends of the screw as force, N.
    pub(super) screw_n: (f64, f64),
    /// 1 out, -1 back: the coordinate along the run is the position times this.
    pub(super) sign: f64,
    /// Coordinate of the end of travel, mm.
    pub(super) end_mm: f64,
    /// Longest run, s.
    pub(super) longest_s: f64,
}

impl Limits {
    pub(super) fn of(rig: &Rig, forward: bool) -> Self {
        Self {
            cruise_mm_s: rig.drive.cruise_speed_mm_s,
            acceleration: rig.drive.acceleration_mm_s2,
            jerk: rig.drive.jerk_mm_s3,
            screw_n: (f64::NEG_INFINITY, 1.25 * rig.preload.limit_n),
            sign: if forward { 1.0 } else { -1.0 },
            end_mm: if forward { rig.rig.travel_mm } else { 0.0 },
            longest_s: longest_s(rig),
        }
    }

    /// Time that the speed still missing to cruise costs behind a place, s.
    pub(super) fn missing_speed_s(&self, now: Motion) -> f64 {
        let missing = (self.cruise_mm_s - now.speed).max(0.0);
        missing * missing / (2.0 * self.acceleration * self.cruise_mm_s)
    }

    /// Distance of a jerk-limited change of speed with this acceleration at its start, mm. One
    /// that is still rising first comes to a peak.
    fn braking_distance(&self, now: Motion, to: f64) -> f64 {
        let rising = now.acceleration.max(0.0);
        let until = rising / self.jerk;
        let peak = now.speed + 0.5 * rising * until;
        let change = (peak - to).max(0.0);
        let knee = self.acceleration * self.acceleration / self.jerk;
        let time = if change >= knee {
            change / self.acceleration + self.acceleration / self.jerk
        } else {
            2.0 * (change / self.jerk).sqrt()
        };
        peak * until + 0.5 * (peak + to) * time
    }
}

/// Reference of the tread along the run.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Motion {
    /// mm/s.
    pub(super) speed: f64,
    /// mm/s^2.
    pub(super) acceleration: f64,
}

impl Motion {
    /// Advances to the speed that is wanted at this place, mm along the run.
    pub(super) fn step(&mut self, limits: &Limits, along: f64, slow: Slow) {
        let brakes =
            |at: f64, to: f64| self.speed > to && at - along <= limits.braking_distance(*self, to);
        let mut wanted = limits.cruise_mm_s;
        if let Some((from, to, speed)) = slow
            && along < to
            && (along >= from || brakes(from, speed))
        {
            wanted = speed;
        }
        if along >= limits.end_mm || brakes(limits.end_mm, 0.0) {
            wanted = 0.0;
        }
        self.toward(limits, wanted);
    }

    /// One tick toward a speed with the least time that acceleration and jerk allow.
    fn toward(&mut self, limits: &Limits, wanted: f64) {
        let missing = wanted - self.speed;
        let finest = limits.jerk * TICK_S;
        if missing.abs() <= finest * TICK_S && self.acceleration.abs() <= finest {
            (self.speed, self.acceleration) = (wanted, 0.0);
            return;
        }
        let most = (2.0 * limits.jerk * missing.abs()).sqrt().min(limits.acceleration);
        let change = most.copysign(missing) - self.acceleration;
        self.acceleration += change.clamp(-finest, finest);
        self.speed = (self.speed + self.acceleration * TICK_S).max(0.0);
    }
}
