//! The two motors: the drive with gearbox and current limit, the pre-tightener
//! with dead time, lag, slew and spring.

use std::collections::VecDeque;

/// Drive motor with self-locking gearbox; forces and masses seen at the tread.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriveMotor {
    /// Tread speed at full duty without load, mm/s.
    pub no_load_mm_s: f64,
    /// Force at full duty and standstill without current limit, N.
    pub stall_n: f64,
    /// Force at the current limit, N.
    pub limit_n: f64,
    /// Rotor and gears as mass at the tread, kg.
    pub mass_kg: f64,
    /// Coulomb friction of the gearbox, N.
    pub friction_n: f64,
}

/// What the drive works against, at the tread.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Load {
    /// Force at constant speed, N, signed as the speed that it resists.
    pub force_n: f64,
    /// Mass that moves with the tread, kg.
    pub mass_kg: f64,
}

impl Load {
    /// A force without inertia.
    #[must_use]
    pub const fn force(force_n: f64) -> Self {
        Self { force_n, mass_kg: 0.0 }
    }
}

impl DriveMotor {
    /// Tread speed after `dt_s` at `duty` (-1 to 1) against `load` from speed
    /// `speed`, and the motor's mean force, N. Exact for a constant load, across the
    /// current limit too.
    ///
    /// The worm gear locks itself: a load against the motion resists it, one along the
    /// motion does not help, and none turns a resting wheel. A disabled bridge stops
    /// the wheel within a few milliseconds.
    #[must_use]
    pub fn step(&self, speed: f64, duty: f64, enabled: bool, load: Load, dt_s: f64) -> (f64, f64) {
        if !enabled {
            let stopped = speed * (-dt_s / 0.003).exp();
            return (if stopped.abs() < 1e-3 { 0.0 } else { stopped }, 0.0);
        }
        let force =
            (self.stall_n * (duty - speed / self.no_load_mm_s)).clamp(-self.limit_n, self.limit_n);
        let sense = if speed != 0.0 { speed.signum() } else { force.signum() };
        let against = (load.force_n * sense).max(0.0) + self.friction_n;
        if speed == 0.0 && force * sense <= against {
            return (0.0, force);
        }
        // What the load carries is accelerated with the wheel, but cannot drive it: only
        // while load and inertia together resist.
        let both_kg = self.mass_kg + load.mass_kg;
        let driving = sense * force - self.friction_n - load.force_n * sense;
        let (mass_kg, against) = if load.force_n * sense * both_kg + load.mass_kg * driving >= 0.0 {
            (both_kg, against)
        } else {
            (self.mass_kg, self.friction_n)
        };
        let resist = sense * against;
        let next = self.accelerate(speed, duty, resist, mass_kg, dt_s);
        // Load and friction brake to rest, never through it.
        if next * sense <= 0.0 {
            return (0.0, force);
        }
        (next, resist + 1e-3 * mass_kg * (next - speed) / dt_s)
    }

    /// Speed after `dt_s` against a constant force: at the current limit evenly
    /// accelerated as far as that goes, then as the motor's own lag has it.
    fn accelerate(&self, speed: f64, duty: f64, resist: f64, mass_kg: f64, dt_s: f64) -> f64 {
        let free = self.stall_n * (duty - speed / self.no_load_mm_s);
        let force = free.clamp(-self.limit_n, self.limit_n);
        let (mut speed, mut left_s) = (speed, dt_s);
        if free != force {
            let rate = 1000.0 / mass_kg * (force - resist);
            // Speed at which the limit no longer binds.
            let knee = self.no_load_mm_s * (duty - force / self.stall_n);
            let until_s = (knee - speed) / rate;
            if !(until_s >= 0.0 && until_s < dt_s) {
                return speed + rate * dt_s;
            }
            (speed, left_s) = (knee, dt_s - until_s);
        }
        let rate = 1000.0 / mass_kg * self.stall_n / self.no_load_mm_s;
        let rest = self.no_load_mm_s * (duty - resist / self.stall_n);
        rest + (speed - rest) * (-rate * left_s).exp()
    }
}

/// Pre-tightener: duty commands screw speed; the spring turns way into force.
#[derive(Clone, Debug)]
pub struct Pretightener {
    /// Force rate at full duty, N/s, as seen at the wheel.
    slew: f64,
    /// Time constant of the screw's speed, s.
    lag: f64,
    /// Force of the screw's position alone, N.
    seat: f64,
    /// Present rate, N/s.
    rate: f64,
    /// Duties on their way, oldest first.
    pipeline: VecDeque<f64>,
    /// Bounds of the screw as force at level 0, N.
    range: (f64, f64),
    /// Step, s, and what the lag keeps over it.
    keeps: (f64, f64),
}

impl Pretightener {
    /// A pre-tightener at `seat_n`, for a step of `dt_s`.
    #[must_use]
    pub fn new(
        slew: f64,
        lag: f64,
        delay_s: f64,
        dt_s: f64,
        seat_n: f64,
        range: (f64, f64),
    ) -> Self {
        let depth = (delay_s / dt_s).round() as usize;
        Self {
            slew,
            lag,
            seat: seat_n,
            rate: 0.0,
            pipeline: std::iter::repeat_n(0.0, depth).collect(),
            range,
            keeps: (dt_s, (-dt_s / lag).exp()),
        }
    }

    /// Advances by the step at `duty` (-1 to 1); a disabled bridge leaves the screw
    /// self-locked, at once.
    pub fn step(&mut self, duty: f64, enabled: bool, dt_s: f64) {
        self.pipeline.push_back(if enabled { duty.clamp(-1.0, 1.0) } else { 0.0 });
        let delayed = self.pipeline.pop_front().unwrap_or(0.0);
        if !enabled {
            self.rate = 0.0;
            return;
        }
        // Exact for the lag under a held command.
        let target = delayed * self.slew;
        if self.keeps.0 != dt_s {
            self.keeps = (dt_s, (-dt_s / self.lag).exp());
        }
        let keep = self.keeps.1;
        let moved = target * dt_s + (self.rate - target) * self.lag * (1.0 - keep);
        self.rate = target + (self.rate - target) * keep;
        let next = self.seat + moved;
        self.seat = next.clamp(self.range.0, self.range.1);
        if next != self.seat {
            self.rate = 0.0;
        }
    }

    /// Holds the screw where it gives this force, N.
    pub(super) fn hold(&mut self, seat_n: f64) {
        (self.seat, self.rate) = (seat_n, 0.0);
    }

    /// Force of the screw's position at the undeformed wheel on level 0, N; the
    /// spring adds its rate times what the wheel has moved inwards.
    #[must_use]
    pub fn seat_n(&self) -> f64 {
        self.seat
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_drive_settles_where_torque_meets_load() {
        let drive = DriveMotor {
            no_load_mm_s: 60.0,
            stall_n: 160.0,
            limit_n: 80.0,
            mass_kg: 40.0,
            friction_n: 2.0,
        };
        let mut speed = 0.0;
        for _ in 0..2000 {
            speed = drive.step(speed, 0.5, true, Load::force(10.0), 1e-3).0;
        }
        assert!((speed - 60.0 * (0.5 - 12.0 / 160.0)).abs() < 1e-6, "{speed}");
        for _ in 0..50 {
            speed = drive.step(speed, 0.5, false, Load::force(10.0), 1e-3).0;
        }
        assert_eq!(speed, 0.0);
    }

    #[test]
    fn a_load_resists_but_never_drives() {
        let drive = DriveMotor {
            no_load_mm_s: 60.0,
            stall_n: 160.0,
            limit_n: 80.0,
            mass_kg: 40.0,
            friction_n: 2.0,
        };
        let settled = |duty: f64, load: f64| {
            let load = Load::force(load);
            (0..3000).fold(0.0, |speed, _| drive.step(speed, duty, true, load, 1e-3).0)
        };
        // At rest no load turns it, nor does a motor weaker than load and friction.
        for load in [0.0, 30.0, -30.0, 500.0] {
            assert_eq!(settled(0.0, load), 0.0);
        }
        assert_eq!(settled(0.1, 15.0), 0.0);
        assert_eq!(settled(-0.1, -15.0), 0.0);
        // Along the motion a load does not help.
        assert_eq!(settled(0.5, -30.0), settled(0.5, 0.0));
        assert!((settled(-0.5, 30.0) + settled(0.5, 0.0)).abs() < 1e-12);
        // Beyond the current limit it stalls, from speed too.
        let load = Load::force(79.0);
        let stalled = (0..3000).fold(30.0, |v, _| drive.step(v, 1.0, true, load, 1e-3).0);
        assert_eq!(stalled, 0.0);
    }

    #[test]
    fn the_current_limit_bounds_force_and_acceleration() {
        let drive = DriveMotor {
            no_load_mm_s: 60.0,
            stall_n: 160.0,
            limit_n: 80.0,
            mass_kg: 40.0,
            friction_n: 2.0,
        };
        let (speed, force) = drive.step(0.0, 1.0, true, Load::default(), 1e-3);
        assert!((force - 80.0).abs() < 1e-9, "{force}");
        assert!((speed - 78.0 / 40.0).abs() < 1e-12, "{speed}");
        let (speed, force) = drive.step(50.0, -1.0, true, Load::default(), 1e-3);
        assert!((force + 80.0).abs() < 1e-9, "{force}");
        assert!((speed - (50.0 - 82.0 / 40.0)).abs() < 1e-12, "{speed}");
    }

    #[test]
    fn one_long_step_is_many_short_ones_across_the_limit() {
        for mass_kg in [0.01, 1.0, 40.0] {
            let drive = DriveMotor {
                no_load_mm_s: 60.0,
                stall_n: 160.0,
                limit_n: 80.0,
                mass_kg,
                friction_n: 2.0,
            };
            for load in [Load::force(10.0), Load { force_n: 10.0, mass_kg: 30.0 }] {
                let step = |speed: f64, dt_s| drive.step(speed, 0.9, true, load, dt_s).0;
                let long = step(0.0, 20e-3);
                let short = (0..2000).fold(0.0, |speed, _| step(speed, 10e-6));
                assert!((long - short).abs() < 1e-3 * short, "{long} {short}");
                assert!(long < 60.0, "{long}");
            }
        }
    }

    #[test]
    fn a_carried_mass_is_accelerated_but_drives_nothing() {
        let drive = DriveMotor {
            no_load_mm_s: 60.0,
            stall_n: 160.0,
            limit_n: 80.0,
            mass_kg: 1.0,
            friction_n: 2.0,
        };
        let carried = Load { force_n: 0.0, mass_kg: 99.0 };
        let (speed, force) = drive.step(0.0, 1.0, true, carried, 1e-3);
        assert!((speed - 0.78).abs() < 1e-12 && (force - 80.0).abs() < 1e-9, "{speed}");
        // Braking, the worm holds it: only the rotor is braked.
        let (speed, _) = drive.step(50.0, 0.0, true, carried, 1e-4);
        assert!((speed - (50.0 - 8.2)).abs() < 1e-9, "{speed}");
    }

    #[test]
    fn the_screw_keeps_within_its_ends_and_when_switched_off() {
        let mut screw = Pretightener::new(25.0, 0.06, 0.0, 1e-3, 10.0, (-5.0, 12.0));
        for _ in 0..1000 {
            screw.step(1.0, true, 1e-3);
        }
        assert_eq!(screw.seat_n(), 12.0);
        for _ in 0..100 {
            screw.step(-1.0, true, 1e-3);
        }
        let held = screw.seat_n();
        assert!(held < 12.0);
        for _ in 0..100 {
            screw.step(-1.0, false, 1e-3);
        }
        assert_eq!(screw.seat_n(), held);
        for _ in 0..2000 {
            screw.step(-1.0, true, 1e-3);
        }
        assert_eq!(screw.seat_n(), -5.0);
    }

    #[test]
    fn the_screw_waits_lags_and_slews() {
        let mut screw = Pretightener::new(25.0, 0.06, 0.08, 1e-3, 0.0, (0.0, 60.0));
        let mut at = Vec::new();
        for _ in 0..1000 {
            screw.step(1.0, true, 1e-3);
            at.push(screw.seat_n());
        }
        assert_eq!(at[79], 0.0);
        assert!(at[100] > 0.0);
        // Ramp minus delay and lag: 25 * (1 - 0.08 - 0.06).
        assert!((at[999] - 21.5).abs() < 0.05, "{}", at[999]);
    }
}
