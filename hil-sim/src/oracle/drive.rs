//! Drives the plant through its bridges so that tread speed and preload follow a profile: by
//! feed-forward from its true parameters and state, within the limits of motor, pre-tightener,
//! acceleration and jerk.

use interstage::rig::Rig;

use crate::plant::actuators::Pretightener;
use crate::plant::rig::{Drives, PlantError, VirtualRig};
use crate::scenario::TICK_S;
use crate::session::longest_s;

/// Time within which the screw is to make up for what it lacks, s.
const CATCHES_UP_S: f64 = 0.02;
/// Ticks between two predictions of the wheel's rise.
const PREDICTS_EVERY: u32 = 8;
/// Speed at which the wheel stands, mm/s.
const STANDS_MM_S: f64 = 0.05;

/// The largest of what a run must bound, so far.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Peaks {
    pub(super) preload_n: f64,
    /// Friction utilisation away from the steps.
    pub(super) rolling_utilisation: f64,
    pub(super) separation_mm: f64,
}

/// A plant on a driven run.
#[derive(Clone)]
pub(super) struct Driven {
    pub(super) plant: VirtualRig,
    limits: Limits,
    /// The screw as it will be when the dead time is over, and its rate, N/s.
    screw: Pretightener,
    screw_rate: f64,
    motion: Motion,
    /// Rise of the wheel by then, mm.
    rise_mm: f64,
    tick: u32,
    moved_from: Option<u32>,
    preload_sum: f64,
    pub(super) peaks: Peaks,
}

impl Driven {
    pub(super) fn new(plant: VirtualRig, limits: Limits) -> Self {
        let p = plant.parameters();
        let rise = plant.truth().height_mm - p.ring.radius_mm;
        let seat = plant.truth().preload_n - p.spring_n_per_mm * rise;
        let screw = p.pretightener(0.0, TICK_S, seat, limits.screw_n);
        Self {
            limits,
            screw,
            screw_rate: 0.0,
            motion: Motion::default(),
            rise_mm: rise,
            tick: 0,
            moved_from: None,
            preload_sum: 0.0,
            peaks: Peaks::default(),
            plant,
        }
    }

    /// Time since the command, s.
    pub(super) fn time_s(&self) -> f64 {
        f64::from(self.tick) * TICK_S
    }

    /// Time since the wheel began to move, s.
    pub(super) fn moving_s(&self) -> f64 {
        self.moved_from.map_or(0.0, |from| f64::from(self.tick - from) * TICK_S)
    }

    /// Mean preload since then, N.
    pub(super) fn mean_preload_n(&self) -> f64 {
        let ticks = self.moved_from.map_or(0, |from| self.tick - from);
        self.preload_sum / f64::from(ticks.max(1))
    }

    /// Coordinate along the run, mm.
    pub(super) fn along_mm(&self) -> f64 {
        self.limits.sign * self.plant.truth().position_mm
    }

    /// Time that the speed still missing to cruise costs behind this place, s.
    pub(super) fn missing_speed_s(&self) -> f64 {
        let Limits { cruise_mm_s, acceleration, .. } = self.limits;
        let missing = (cruise_mm_s - self.motion.speed).max(0.0);
        missing * missing / (2.0 * acceleration * cruise_mm_s)
    }

    /// To the end of travel; whether it gets there.
    pub(super) fn run_out(&mut self) -> Result<bool, PlantError> {
        let preload_n = self.plant.truth().preload_n;
        let mut moved = false;
        while self.time_s() < self.limits.longest_s {
            self.step(0.0, None, preload_n)?;
            moved |= self.motion.speed > 1.0;
            if moved && self.motion.speed < STANDS_MM_S {
                let off = self.along_mm() - self.limits.end_mm;
                return Ok(off.abs() < 0.2);
            }
        }
        Ok(false)
    }

    /// One tick: at rest before `start_s`, slow in that stretch, toward that preload.
    pub(super) fn step(
        &mut self,
        start_s: f64,
        slow: Slow,
        preload_n: f64,
    ) -> Result<(), PlantError> {
        let along = self.along_mm();
        if self.time_s() >= start_s {
            self.motion.step(&self.limits, along, slow);
            self.moved_from.get_or_insert(self.tick);
        }
        if self.tick.is_multiple_of(PREDICTS_EVERY) {
            self.rise_mm = self.rise_ahead(slow);
        }
        let drives = Drives {
            drive: self.drive_duty(),
            drive_on: true,
            preload: self.screw_duty(preload_n),
            preload_on: true,
            ..Drives::default()
        };
        let before = self.screw.seat_n();
        self.screw.step(drives.preload, true, self.plant.truth().preload_n, TICK_S);
        self.screw_rate = (self.screw.seat_n() - before) / TICK_S;
        self.plant.step(&drives, TICK_S)?;
        self.tick += 1;
        self.look();
        Ok(())
    }

    /// Duty with which the tread ends the tick at its reference: the motor's lag inverted, with
    /// friction and the load of the last tick.
    fn drive_duty(&self) -> f64 {
        let p = &self.plant.parameters().drive;
        let sign = self.limits.sign;
        if self.motion.speed == 0.0 {
            return 0.0;
        }
        let truth = self.plant.truth();
        let kept = (-1000.0 / p.mass_kg * p.stall_n / p.no_load_mm_s * TICK_S).exp();
        let settled = (sign * self.motion.speed - kept * truth.tread_mm_s) / (1.0 - kept);
        // A load along the motion does not help the worm.
        let load = sign * (sign * self.plant.tread_load_n()).max(0.0) + sign * p.friction_n;
        (settled / p.no_load_mm_s + load / p.stall_n).clamp(-1.0, 1.0)
    }

    /// Duty that brings the screw, after dead time and lag, to where it gives this preload.
    fn screw_duty(&self, preload_n: f64) -> f64 {
        let p = self.plant.parameters();
        let wanted = preload_n - p.spring_n_per_mm * self.rise_mm;
        // Where it comes to if the bridge stops driving it.
        let coasts_to = self.screw.seat_n() + p.lag_s * self.screw_rate;
        ((wanted - coasts_to) / (p.slew_n_per_s * CATCHES_UP_S)).clamp(-1.0, 1.0)
    }

    /// Rise of the centre over a radius above the outermost wall when dead time and lag are
    /// over, mm: the profile ahead on the geometry of a rigid wheel, with its present error.
    fn rise_ahead(&self, slow: Slow) -> f64 {
        let p = self.plant.parameters();
        let truth = self.plant.truth();
        let (mut motion, mut along) = (self.motion, self.along_mm());
        if self.moved_from.is_some() {
            let ticks = ((p.delay_s + p.lag_s) / TICK_S) as u32;
            for _ in 0..ticks {
                motion.step(&self.limits, along, slow);
                along += motion.speed * TICK_S;
            }
        }
        let rise = truth.height_mm - p.ring.radius_mm;
        let error = rise - self.rigid_rise(truth.position_mm);
        error + self.rigid_rise(self.limits.sign * along)
    }

    /// Rise of a rigid wheel here, mm.
    fn rigid_rise(&self, position_mm: f64) -> f64 {
        let p = self.plant.parameters();
        let radius = p.ring.radius_mm;
        let base = p.wall.local(position_mm).base_mm;
        let mut top = 0.0;
        let over = p.wall.steps().iter().map(|step| {
            top += step.height_mm;
            let away = step.position_mm - position_mm;
            top - radius + (radius * radius - away * away).max(0.0).sqrt()
        });
        over.fold(base, f64::max)
    }

    /// Keeps the peaks and the mean.
    fn look(&mut self) {
        let truth = self.plant.truth();
        let peaks = &mut self.peaks;
        peaks.preload_n = peaks.preload_n.max(truth.preload_n);
        if self.moved_from.is_some() {
            peaks.separation_mm = peaks.separation_mm.max(truth.separation_mm);
            if truth.corner_n == 0.0 && truth.tread_mm_s != 0.0 {
                let used = truth.utilisation.abs();
                peaks.rolling_utilisation = peaks.rolling_utilisation.max(used);
            }
            self.preload_sum += truth.preload_n;
        }
    }
}

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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::Scenario;
    use crate::session::initial_rig;

    /// The nominal plant and what it takes to drive it.
    fn nominal() -> Driven {
        let scenario = Scenario::default();
        let (plant, _) = initial_rig(&scenario).unwrap();
        Driven::new(plant, Limits::of(&scenario.rig, true))
    }

    #[test]
    fn speed_and_preload_follow_their_profile_within_the_limits() {
        let mut driven = nominal();
        let (mut before, mut rate) = (Motion::default(), 0.0f64);
        while driven.along_mm() < 4.0 {
            driven.step(2.5, Some((20.0, 21.0, 8.0)), 48.0).unwrap();
            let Motion { speed, acceleration } = driven.motion;
            assert!(acceleration.abs() <= 250.0 + 1e-9);
            assert!((acceleration - before.acceleration).abs() <= 5.0 + 1e-9);
            before = driven.motion;
            let truth = driven.plant.truth();
            if driven.time_s() > 2.4 {
                assert!((truth.preload_n - 48.0).abs() < 0.1, "{}", truth.preload_n);
            }
            rate = rate.max((truth.tread_mm_s - speed).abs());
        }
        // What the motor's lag leaves while it takes up the load.
        assert!(rate < 0.5, "{rate} mm/s off");
        assert!(driven.moving_s() < 0.5 && driven.moving_s() > 0.2);
    }

    #[test]
    fn over_a_step_the_screw_follows_the_spring() {
        let mut driven = nominal();
        let slow = Some((3.0, 8.0, 7.0));
        while driven.along_mm() < 20.0 {
            driven.step(2.2, slow, 47.0).unwrap();
        }
        // Without following the climb would add 4.8 N.
        assert!((47.0..48.5).contains(&driven.peaks.preload_n), "{:?}", driven.peaks);
        assert_eq!(driven.plant.ledger().crossings().len(), 1);
        let gap = driven.plant.ledger().crossings()[0].gap_mm;
        assert!((2.4..2.8).contains(&gap), "{gap}");
    }
}
