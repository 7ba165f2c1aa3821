//! The two motors: the drive with gearbox, current limit and play, the pre-tightener
//! with dead time, lag, slew and spring.

use std::collections::VecDeque;

/// Time constant with which a wheel stops whose bridge is switched off, s.
pub(super) const STOPS_IN_S: f64 = 0.003;

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

/// What the drive does in a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Turn {
    /// Tread speed at its end if nothing resists, mm/s.
    pub free_mm_s: f64,
    /// What a resisting newton takes off it, mm/s.
    pub yields: f64,
    /// Coulomb friction and the motor's part in accelerating the rotor: its mean force if
    /// nothing resists, N.
    pub force_n: f64,
    /// By how much that rises per resisting newton.
    pub force_rises: f64,
}

impl Turn {
    /// The wheel turns at this speed, mm/s, whatever resists.
    pub(super) fn imposed(free_mm_s: f64) -> Self {
        Self { free_mm_s, ..Self::default() }
    }
}

impl DriveMotor {
    /// The drive over `dt_s` at `duty` (-1 to 1) from tread speed `speed`. Exact for a
    /// constant load; across the current limit for the load `expected_n`, signed as the
    /// speed that it resists.
    ///
    /// The worm gear locks itself: a load against the motion resists it, one along the
    /// motion does not help, and none turns a resting wheel. A disabled bridge stops
    /// the wheel within a few milliseconds.
    pub(crate) fn turn(
        &self,
        speed: f64,
        duty: f64,
        enabled: bool,
        expected_n: f64,
        dt_s: f64,
    ) -> Turn {
        if !enabled {
            let stopped = speed * (-dt_s / STOPS_IN_S).exp();
            let free_mm_s = if stopped.abs() < 1e-3 { 0.0 } else { stopped };
            return Turn { free_mm_s, ..Turn::default() };
        }
        let ideal = self.stall_n * (duty - speed / self.no_load_mm_s);
        let force_n = ideal.clamp(-self.limit_n, self.limit_n);
        let sense = if speed != 0.0 { speed.signum() } else { force_n.signum() };
        if speed == 0.0 && force_n * sense <= self.friction_n {
            return Turn { force_n, ..Turn::default() };
        }
        let friction = sense * self.friction_n;
        let (free, yields) = if ideal == force_n {
            let rate = 1000.0 / self.mass_kg * self.stall_n / self.no_load_mm_s;
            let gone = -(-rate * dt_s).exp_m1();
            let rest = self.no_load_mm_s * (duty - friction / self.stall_n);
            (speed + (rest - speed) * gone, self.no_load_mm_s / self.stall_n * gone)
        } else {
            let load = (expected_n * sense).max(0.01 * self.limit_n);
            let free = self.accelerate(speed, duty, friction, dt_s);
            let loaded = self.accelerate(speed, duty, friction + sense * load, dt_s);
            (free, (free - loaded) * sense / load)
        };
        // Friction brakes to rest, never through it.
        if free * sense <= 0.0 {
            return Turn { force_n, ..Turn::default() };
        }
        let kick = 1e-3 * self.mass_kg / dt_s;
        Turn {
            free_mm_s: free,
            yields,
            force_n: friction + kick * (free - speed),
            force_rises: 1.0 - kick * yields,
        }
    }

    /// Output of the bridge, part of the supply, at tread speed `speed`: the duty, or what is
    /// left of it where the bridge regulates its current. Of the duty the motor works with
    /// `worked`; the rest is lost behind the bridge.
    pub(crate) fn bridge_output(&self, duty: f64, worked: f64, speed: f64) -> f64 {
        let ideal = self.stall_n * (worked - speed / self.no_load_mm_s);
        let excess = ideal - ideal.clamp(-self.limit_n, self.limit_n);
        let left = duty - excess / self.stall_n;
        // It regulates towards no output, never through it.
        if left * duty <= 0.0 {
            0.0
        } else if left.abs() < duty.abs() {
            left
        } else {
            duty
        }
    }

    /// Speed after `dt_s` against a constant force: at the current limit evenly
    /// accelerated as far as that goes, then as the motor's own lag has it.
    fn accelerate(&self, speed: f64, duty: f64, resist: f64, dt_s: f64) -> f64 {
        let free = self.stall_n * (duty - speed / self.no_load_mm_s);
        let force = free.clamp(-self.limit_n, self.limit_n);
        let (mut speed, mut left_s) = (speed, dt_s);
        if free != force {
            let rate = 1000.0 / self.mass_kg * (force - resist);
            // Speed at which the limit no longer binds.
            let knee = self.no_load_mm_s * (duty - force / self.stall_n);
            let until_s = (knee - speed) / rate;
            if !(until_s >= 0.0 && until_s < dt_s) {
                return speed + rate * dt_s;
            }
            (speed, left_s) = (knee, dt_s - until_s);
        }
        let rate = 1000.0 / self.mass_kg * self.stall_n / self.no_load_mm_s;
        let rest = self.no_load_mm_s * (duty - resist / self.stall_n);
        rest + (speed - rest) * (-rate * left_s).exp()
    }
}

/// Pre-tightener: duty commands screw speed; the spring turns travel into force.
#[derive(Clone, Debug)]
pub(crate) struct Pretightener {
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
    decay: (f64, f64),
    /// Part of its speed that each newton takes which it raises, 1/N.
    droop_per_n: f64,
    /// Part of full duty that friction takes.
    friction: f64,
}

impl Pretightener {
    /// A pre-tightener at `seat_n`, for a step of `dt_s`.
    pub(crate) fn new(
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
            decay: (dt_s, (-dt_s / lag).exp()),
            droop_per_n: 0.0,
            friction: 0.0,
        }
    }

    /// The same with a motor whose speed falls by the part `droop` as it raises `limit_n`, and
    /// with friction that takes this part of full duty. At `limit_n` it still gives its slew.
    pub(crate) fn with_losses(mut self, droop: f64, friction: f64, limit_n: f64) -> Self {
        (self.droop_per_n, self.friction) = (droop / limit_n, friction);
        self.slew /= 1.0 - droop - friction;
        self
    }

    /// Advances by the step at `duty` (-1 to 1) against `force_n`; a disabled bridge leaves the
    /// screw self-locked, at once. It locks itself: what presses does not drive it down.
    pub(crate) fn step(&mut self, duty: f64, enabled: bool, force_n: f64, dt_s: f64) {
        self.pipeline.push_back(if enabled { duty.clamp(-1.0, 1.0) } else { 0.0 });
        let delayed = self.pipeline.pop_front().unwrap_or(0.0);
        if !enabled {
            self.rate = 0.0;
            return;
        }
        // Exact for the lag under a held command.
        let raised_n = if delayed > 0.0 { force_n } else { 0.0 };
        let lost = self.friction + self.droop_per_n * raised_n;
        let left = delayed.abs() - lost;
        let target = if left < 0.0 { 0.0 } else { left.copysign(delayed) * self.slew };
        if self.decay.0 != dt_s {
            self.decay = (dt_s, (-dt_s / self.lag).exp());
        }
        let keep = self.decay.1;
        let moved = target * dt_s + (self.rate - target) * self.lag * (1.0 - keep);
        self.rate = target + (self.rate - target) * keep;
        let next = self.seat + moved;
        self.seat = next.clamp(self.range.0, self.range.1);
        if next != self.seat {
            self.rate = 0.0;
        }
    }

    /// Force and rate become this part: the spring yields where the screw stands.
    pub(super) fn scale_force(&mut self, part: f64) {
        self.slew *= part;
        self.seat *= part;
        self.rate *= part;
    }

    /// Holds the screw where it gives this force, N.
    pub(super) fn hold(&mut self, seat_n: f64) {
        (self.seat, self.rate) = (seat_n, 0.0);
    }

    /// Force of the screw's position at the undeformed wheel on level 0, N; the
    /// spring adds its rate times what the wheel has moved inwards.
    pub(crate) fn seat_n(&self) -> f64 {
        self.seat
    }
}

/// Play of the drive: the wheel between the flanks of its gear.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Play {
    /// Travel of the tread from flank to flank, mm.
    width_mm: f64,
    /// How far the tread has run ahead of the flank that drives it forwards, mm.
    ahead_mm: f64,
    /// Speed of the motor, as travel of the tread, while the wheel is free, mm/s.
    free: Option<f64>,
}

impl Play {
    /// Play of this width, mm, the wheel on the flank that drives it forwards.
    pub(crate) const fn new(width_mm: f64) -> Self {
        Self { width_mm, ahead_mm: 0.0, free: None }
    }

    /// Speed of the motor while the wheel is between the flanks, mm/s.
    pub(crate) const fn motor_mm_s(&self) -> Option<f64> {
        self.free
    }

    /// The flank in contact had to push with this force, N, positive forwards, at this speed of
    /// the motor: it cannot pull, and lets go.
    pub(crate) fn pushed(&mut self, force_n: f64, motor_mm_s: f64) {
        let leaves =
            force_n < 0.0 && self.ahead_mm < self.width_mm || force_n > 0.0 && self.ahead_mm > 0.0;
        self.free = leaves.then_some(motor_mm_s);
    }

    /// Free of the flanks the tread has travelled this much farther than the motor, mm, which
    /// ended with this speed. Returns whether it is still free.
    pub(crate) fn travelled(&mut self, farther_mm: f64, motor_mm_s: f64) -> bool {
        let ahead = self.ahead_mm + farther_mm;
        self.ahead_mm = ahead.clamp(0.0, self.width_mm);
        self.free = (ahead == self.ahead_mm).then_some(motor_mm_s);
        self.free.is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DRIVE: DriveMotor = DriveMotor {
        no_load_mm_s: 60.0,
        stall_n: 160.0,
        limit_n: 80.0,
        mass_kg: 40.0,
        friction_n: 2.0,
    };

    /// Speed after a step against a constant load.
    fn against(drive: &DriveMotor, speed: f64, duty: f64, load_n: f64, dt_s: f64) -> f64 {
        let turn = drive.turn(speed, duty, true, load_n, dt_s);
        let sense = turn.free_mm_s.signum();
        let next = turn.free_mm_s - sense * turn.yields * (load_n * sense).max(0.0);
        if next * sense <= 0.0 { 0.0 } else { next }
    }

    #[test]
    fn a_bridge_at_its_current_limit_puts_out_what_holds_the_limit() {
        for (duty, speed, expected) in [
            (0.3, 0.0, 0.3),
            (0.5, 0.0, 0.5),
            (0.9, 0.0, 0.5),
            (0.9, 30.0, 0.9),
            (1.0, 12.0, 0.7),
            (1.0, -12.0, 0.3),
            (0.4, -60.0, 0.0),
            (0.0, 60.0, 0.0),
        ] {
            for sense in [1.0, -1.0] {
                let duty = sense * duty;
                let output = DRIVE.bridge_output(duty, duty, sense * speed);
                assert!((output - sense * expected).abs() < 1e-12, "{duty} {speed}: {output}");
            }
        }
        // A motor that draws no current leaves the bridge alone.
        assert_eq!(DRIVE.bridge_output(1.0, 0.0, 0.0), 1.0);
    }

    #[test]
    fn the_drive_settles_where_torque_meets_load() {
        let speed = (0..2000).fold(0.0, |v, _| against(&DRIVE, v, 0.5, 10.0, 1e-3));
        assert!((speed - 60.0 * (0.5 - 12.0 / 160.0)).abs() < 1e-6, "{speed}");
        let stopped = (0..50).fold(speed, |v, _| DRIVE.turn(v, 0.5, false, 10.0, 1e-3).free_mm_s);
        assert_eq!(stopped, 0.0);
    }

    #[test]
    fn a_load_resists_but_never_drives() {
        let settled =
            |duty: f64, load| (0..3000).fold(0.0, |v, _| against(&DRIVE, v, duty, load, 1e-3));
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
        assert_eq!((0..3000).fold(30.0, |v, _| against(&DRIVE, v, 1.0, 79.0, 1e-3)), 0.0);
    }

    #[test]
    fn the_current_limit_bounds_force_and_acceleration() {
        let turn = DRIVE.turn(0.0, 1.0, true, 0.0, 1e-3);
        assert!((turn.force_n - 80.0).abs() < 1e-9, "{turn:?}");
        assert!((turn.free_mm_s - 78.0 / 40.0).abs() < 1e-12, "{turn:?}");
        // What resists takes from the acceleration, not from the motor.
        assert!(turn.force_rises.abs() < 1e-9 && (turn.yields - 1.0 / 40.0).abs() < 1e-12);
        let turn = DRIVE.turn(50.0, -1.0, true, 0.0, 1e-3);
        assert!((turn.force_n + 80.0).abs() < 1e-9, "{turn:?}");
        assert!((turn.free_mm_s - (50.0 - 82.0 / 40.0)).abs() < 1e-12, "{turn:?}");
    }

    #[test]
    fn one_long_step_is_many_short_ones_across_the_limit() {
        for mass_kg in [0.01, 1.0, 40.0] {
            let drive = DriveMotor { mass_kg, ..DRIVE };
            let step = |speed: f64, dt_s| against(&drive, speed, 0.9, 10.0, dt_s);
            let long = step(0.0, 20e-3);
            let short = (0..2000).fold(0.0, |speed, _| step(speed, 10e-6));
            assert!((long - short).abs() < 1e-3 * short, "{long} {short}");
            assert!(long < 60.0, "{long}");
        }
    }

    #[test]
    fn the_mean_force_is_the_one_that_the_rotor_shows() {
        for (speed, load) in [(20.0, 0.0), (20.0, 30.0), (0.0, 30.0), (29.0, 5.0)] {
            let turn = DRIVE.turn(speed, 0.5, true, load, 1e-3);
            let next = against(&DRIVE, speed, 0.5, load, 1e-3);
            let shown = 2.0 + load + 1e-3 * 40.0 * (next - speed) / 1e-3;
            let force = turn.force_n + turn.force_rises * load;
            assert!((force - shown).abs() < 1e-9, "{force} {shown}");
            assert!(force.abs() <= 80.0 + 1e-9);
        }
    }

    #[test]
    fn at_the_limit_the_screw_has_its_slew_and_below_it_is_faster() {
        let rate = |duty: f64, force_n: f64| {
            let screw = Pretightener::new(25.0, 0.06, 0.0, 1e-3, 0.0, (-1e6, 1e6));
            let mut screw = screw.with_losses(0.2, 0.05, 50.0);
            (0..1000).for_each(|_| screw.step(duty, true, force_n, 1e-3));
            screw.rate
        };
        assert!((rate(1.0, 50.0) - 25.0).abs() < 1e-4);
        assert!((rate(1.0, 0.0) - 25.0 * 0.95 / 0.75).abs() < 1e-4);
        // Down it does not raise; a small duty moves nothing.
        assert!((rate(-1.0, 50.0) + 25.0 * 0.95 / 0.75).abs() < 1e-4);
        assert_eq!((rate(0.04, 0.0), rate(-0.04, 50.0), rate(0.2, 50.0)), (0.0, 0.0, 0.0));
    }

    #[test]
    fn the_screw_waits_lags_and_slews() {
        let mut screw = Pretightener::new(25.0, 0.06, 0.08, 1e-3, 0.0, (0.0, 60.0));
        let mut at = Vec::new();
        for _ in 0..1000 {
            screw.step(1.0, true, 0.0, 1e-3);
            at.push(screw.seat_n());
        }
        assert_eq!(at[79], 0.0);
        assert!(at[100] > 0.0);
        // Ramp minus delay and lag: 25 * (1 - 0.08 - 0.06).
        assert!((at[999] - 21.5).abs() < 0.05, "{}", at[999]);
    }

    #[test]
    fn a_flank_pushes_and_never_pulls() {
        let mut play = Play::new(0.1);
        play.pushed(5.0, 3.0);
        assert_eq!(play.motor_mm_s(), None);
        play.pushed(-1.0, 3.0);
        assert_eq!(play.motor_mm_s(), Some(3.0));
        assert!(play.travelled(0.06, 2.0));
        assert!(!play.travelled(0.06, 1.0));
        play.pushed(-1.0, 1.0);
        assert_eq!(play.motor_mm_s(), None);
        play.pushed(1.0, 1.0);
        assert!(!play.travelled(-0.2, 1.0));
        // Without play it never lets go.
        let mut none = Play::new(0.0);
        none.pushed(-1.0, 1.0);
        assert_eq!(none.motor_mm_s(), None);
    }
}
