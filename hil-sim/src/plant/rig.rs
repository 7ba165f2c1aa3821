//! The whole rig, a millisecond at a time.

use super::actuators::Pretightener;
use super::arm::Mode;
use super::balance::{Axial, Balance, BalanceError};
use super::draw::PlantParameters;
use super::ledger::{Ledger, Moment};
use super::ring::{Motion, Ring};
use super::rolling;
use super::wall::LocalWall;

/// Longest axial way of one ring step, mm.
const STRIDE_MM: f64 = 0.02;

/// What the bridges are driven with.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Drives {
    /// Drive duty, -1 to 1.
    pub drive: f64,
    /// Drive bridge enabled.
    pub drive_on: bool,
    /// Pre-tightener duty, -1 to 1.
    pub preload: f64,
    /// Pre-tightener bridge enabled.
    pub preload_on: bool,
}

/// What is true after a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Truth {
    /// Time, s.
    pub time_s: f64,
    /// Axial position of the wheel centre, mm.
    pub position_mm: f64,
    /// Axial speed, mm/s.
    pub speed_mm_s: f64,
    /// Tread speed by the wheel's spin, mm/s.
    pub tread_mm_s: f64,
    /// Angle turned, rad.
    pub rotation_rad: f64,
    /// Radial preload of the pre-tightener, N.
    pub preload_n: f64,
    /// Wheel centre's distance from the pillar axis, mm.
    pub radius_mm: f64,
    /// Height of the centre above the outermost wall, mm.
    pub height_mm: f64,
    /// Arm angle from the pillar, rad.
    pub arm_rad: f64,
    /// Largest tread depth, mm.
    pub depth_mm: f64,
    /// Force of corner and face, N.
    pub corner_n: f64,
    /// Force of the wall under the wheel, N.
    pub floor_n: f64,
    /// Friction of tread on wall.
    pub friction: f64,
    /// Friction utilisation.
    pub utilisation: f64,
    /// Clearance of the nearest step root from the undeformed wheel, mm, if near.
    pub root_clearance_mm: Option<f64>,
    /// Separation of wheel and wall away from steps, mm.
    pub separation_mm: f64,
    /// Gross slip so far, mm.
    pub slip_mm: f64,
    /// Deflection of the first mode, mm.
    pub vibration_mm: f64,
    /// Mechanical work of the drive so far, mJ.
    pub work_mj: f64,
    /// Friction work of creep and slip so far, mJ.
    pub wear_mj: f64,
    /// Whether the ring was resolved.
    pub ring_awake: bool,
}

/// The rig left the set of states that mean something.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum PlantError {
    /// No height of the wheel balances the radial forces.
    #[error("plant at {time_s:.3} s, {position_mm:.3} mm: {source}")]
    Balance {
        /// When, s.
        time_s: f64,
        /// Where, mm.
        position_mm: f64,
        /// Why.
        source: BalanceError,
    },
    /// A state is not a number.
    #[error("plant at {time_s:.3} s: {name} is not finite")]
    NotFinite {
        /// When, s.
        time_s: f64,
        /// Which state.
        name: &'static str,
    },
}

/// The rig.
#[derive(Clone, Debug)]
pub struct VirtualRig {
    parameters: PlantParameters,
    ring: Ring,
    awake: bool,
    preload: Pretightener,
    modes: Vec<Mode>,
    truth: Truth,
    ledger: Ledger,
    /// Sliding bodily over the wall.
    sliding: bool,
    /// Resting on the stop or latch that carries the load until the drive first turns.
    parked: bool,
    /// Base of the wall under the centre, to notice when it changes, mm.
    base_mm: f64,
    /// Contact forces of the last step: normal, cosine, sine, N.
    normal_n: f64,
    cosine_n: f64,
    sine_n: f64,
    acceleration: f64,
}

impl VirtualRig {
    /// A rig at `position_mm` with the pre-tightener set to `preload_n` there, at rest.
    #[must_use]
    pub fn new(parameters: PlantParameters, position_mm: f64, preload_n: f64, dt_s: f64) -> Self {
        let local = parameters.wall.local(position_mm);
        let radius = parameters.ring.radius_mm;
        let rest = rolling::solve(&parameters.ring, 0.0, radius - 0.1, |c| c.cosine_n - preload_n);
        let rise = local.base_mm + rest.height_mm - radius;
        let seat = preload_n - parameters.spring_n_per_mm * rise;
        let range = (
            -parameters.spring_n_per_mm * parameters.wall.steps().len() as f64 * 5.0,
            parameters.seat_max_n,
        );
        let preload = Pretightener::new(
            parameters.slew_n_per_s,
            parameters.lag_s,
            parameters.delay_s,
            dt_s,
            seat,
            range,
        );
        let modes = parameters.modes_hz.iter().map(|&hz| Mode::new(hz, 0.02, 0.2)).collect();
        let mut rig = Self {
            ring: Ring::new(parameters.ring),
            ledger: Ledger::new(parameters.wall.steps().to_vec(), radius),
            awake: false,
            preload,
            modes,
            truth: Truth {
                position_mm,
                height_mm: local.base_mm + rest.height_mm,
                depth_mm: radius - rest.height_mm,
                friction: parameters.mu,
                ..Truth::default()
            },
            sliding: false,
            parked: true,
            base_mm: local.base_mm,
            normal_n: rest.normal_n,
            cosine_n: rest.cosine_n,
            sine_n: 0.0,
            acceleration: 0.0,
            parameters,
        };
        rig.derive();
        rig
    }

    /// What is true now.
    #[must_use]
    pub fn truth(&self) -> &Truth {
        &self.truth
    }

    /// Crossings so far.
    #[must_use]
    pub fn ledger(&self) -> &Ledger {
        &self.ledger
    }

    /// Parameters of this plant.
    #[must_use]
    pub fn parameters(&self) -> &PlantParameters {
        &self.parameters
    }

    /// Advances by `dt_s` under `drives`.
    ///
    /// # Errors
    /// [`PlantError`] when the state stops meaning anything.
    pub fn step(&mut self, drives: &Drives, dt_s: f64) -> Result<(), PlantError> {
        self.preload.step(drives.preload, drives.preload_on, dt_s);
        self.turn_wheel(drives, dt_s);
        let way = self.truth.tread_mm_s.abs().max(self.truth.speed_mm_s.abs()) * dt_s;
        let parts = (way / STRIDE_MM).ceil().clamp(1.0, 64.0);
        for _ in 0..parts as usize {
            self.roll(dt_s / parts)?;
        }
        self.vibrate(dt_s);
        self.truth.time_s += dt_s;
        self.derive();
        self.check()
    }

    /// Motor and gearbox: the wheel's spin.
    fn turn_wheel(&mut self, drives: &Drives, dt_s: f64) {
        let before = self.truth.tread_mm_s;
        let load = if self.parked { 0.0 } else { self.truth.utilisation * self.normal_n };
        let drive = &self.parameters.drive;
        let (after, force) = drive.step(before, drives.drive, drives.drive_on, load, dt_s);
        self.truth.tread_mm_s = after;
        self.truth.work_mj += (force * 0.5 * (before + after) * dt_s).max(0.0);
        self.acceleration = (after - before) / dt_s;
        if after != 0.0 {
            self.parked = false;
        }
    }

    /// One stride: axial motion by grip or slip, then the radial balance.
    fn roll(&mut self, dt_s: f64) -> Result<(), PlantError> {
        let inertia = 1e-3 * self.parameters.mass_kg * self.acceleration;
        let load = self.parameters.load_n + inertia;
        let (speed, axial) = self.traction(load, dt_s);
        let mut position = self.truth.position_mm + speed * dt_s;
        let (low, high) = self.parameters.stops_mm;
        let mut speed = speed;
        if position < low || position > high {
            position = position.clamp(low, high);
            speed = 0.0;
        }
        let turn = self.truth.tread_mm_s * dt_s / self.parameters.ring.radius_mm;
        let creep = (self.truth.tread_mm_s - speed).abs() * dt_s;
        self.truth.wear_mj += self.truth.utilisation.abs() * self.normal_n * creep;
        let before = self.truth.position_mm;
        self.truth.position_mm = position;
        self.truth.speed_mm_s = speed;
        self.truth.rotation_rad += turn;
        let local = self.parameters.wall.local(position);
        if self.near_step(&local) {
            if !self.awake {
                self.wake(before);
            }
            self.resolve(&local, axial, turn, dt_s)
        } else {
            self.awake = false;
            self.roll_steadily(&local, axial);
            Ok(())
        }
    }

    /// Axial speed and how the contact's friction is used, from the forces of the
    /// last stride.
    fn traction(&mut self, load: f64, dt_s: f64) -> (f64, Axial) {
        let spin = self.truth.tread_mm_s;
        if self.parked || self.cosine_n <= 0.0 {
            return (0.0, Axial::Utilised(0.0));
        }
        let mu = self.parameters.mu;
        let needed = (load + self.sine_n) / self.cosine_n;
        let used = needed.clamp(-mu, mu);
        // Creep of the tread under traction, 63 % of friction at `elastic_creep`.
        let part = (used.abs() / mu).min(0.999);
        let creep = -self.parameters.elastic_creep * (1.0 - part).ln() * used.signum();
        let gripped = spin - spin.abs() * creep;
        if needed.abs() < mu && !self.sliding {
            return (gripped, Axial::Driven(load));
        }
        // Sliding: friction is spent and what is missing accelerates the carriage.
        self.sliding = true;
        let missing = mu * needed.signum() * self.cosine_n - self.sine_n - self.parameters.load_n;
        let speed = self.truth.speed_mm_s + 1000.0 * missing / self.parameters.mass_kg * dt_s;
        let caught = needed.abs() < mu
            && (speed - gripped) * (self.truth.speed_mm_s - gripped) <= 0.0
            || needed.abs() < mu && (speed - gripped).abs() < 0.05;
        if caught {
            self.sliding = false;
            return (gripped, Axial::Driven(load));
        }
        self.truth.slip_mm += (gripped - speed).abs() * dt_s;
        (speed, Axial::Utilised(mu * needed.signum()))
    }

    /// Preload with the wheel's centre at its undeformed height over the wall under
    /// it, the arm's wedge and the modes included.
    fn pressing(&self, local: &LocalWall) -> f64 {
        let seat = self.preload.seat_n() + self.parameters.spring_n_per_mm * local.base_mm;
        let thrust =
            if self.parked { 0.0 } else { self.truth.utilisation * self.cosine_n - self.sine_n };
        let wedge = self.parameters.arm.wedge(self.truth.radius_mm) * thrust;
        (seat + wedge - self.modes.first().map_or(0.0, Mode::force_n)).max(0.0)
    }

    fn near_step(&self, local: &LocalWall) -> bool {
        let radius = self.parameters.ring.radius_mm;
        let patch = (radius * radius - (radius - 1.5).powi(2)).sqrt();
        let below = radius - local.rise_mm;
        let run = (radius * radius - below * below).max(0.0).sqrt();
        local.ahead_mm < run + 2.0 || local.behind_mm < patch + 1.0
    }

    /// Brings the ring into the state of steady rolling.
    fn wake(&mut self, position_mm: f64) {
        let local = self.parameters.wall.local(position_mm);
        let height = self.truth.height_mm - local.base_mm;
        let table = rolling::profile(&self.parameters.ring, height, self.truth.tread_mm_s);
        // A fresh ring counts its own turns; only the angle to the wall matters.
        self.ring = Ring::new(self.parameters.ring);
        let interpolate = |angle: f64| {
            let at = table.partition_point(|node| node.0 < angle);
            match (at.checked_sub(1).and_then(|i| table.get(i)), table.get(at)) {
                (Some(a), Some(b)) => {
                    let part = (angle - a.0) / (b.0 - a.0);
                    (a.1 + part * (b.1 - a.1), a.2 + part * (b.2 - a.2))
                }
                _ => (0.0, 0.0),
            }
        };
        self.ring.seed(self.truth.time_s, interpolate);
        self.awake = true;
    }

    /// Radial balance with the ring resolved.
    fn resolve(
        &mut self,
        local: &LocalWall,
        axial: Axial,
        turn: f64,
        dt_s: f64,
    ) -> Result<(), PlantError> {
        let motion = Motion {
            wall: *local,
            height_mm: self.truth.height_mm - local.base_mm,
            turn_rad: turn,
            dt_s,
        };
        let balance = Balance {
            preload_n: self.pressing(local),
            spring_n_per_mm: self.parameters.spring_n_per_mm,
            axial,
        };
        let solved = balance.solve(&self.ring, motion).map_err(|source| PlantError::Balance {
            time_s: self.truth.time_s,
            position_mm: self.truth.position_mm,
            source,
        })?;
        self.ring.commit(&Motion { height_mm: solved.height_mm, ..motion });
        let contact = solved.contact;
        self.truth.height_mm = solved.height_mm + local.base_mm;
        self.truth.depth_mm = contact.depth_mm.max(0.0);
        self.truth.corner_n = contact.step_force_n();
        self.truth.floor_n = contact.floor_n;
        self.truth.utilisation = solved.utilisation;
        self.truth.separation_mm =
            if contact.depth_mm > 0.0 { 0.0 } else { self.separation(solved.height_mm) };
        self.normal_n = contact.normal_n;
        self.cosine_n = contact.cosine_n;
        self.sine_n = contact.sine_n;
        self.truth.ring_awake = true;
        self.truth.preload_n = self.preload_now();
        self.ledger.record(&Moment {
            time_s: self.truth.time_s,
            position_mm: self.truth.position_mm,
            height_mm: self.truth.height_mm,
            base_mm: local.base_mm,
            speed_mm_s: self.truth.speed_mm_s,
            preload_n: self.truth.preload_n,
            utilisation: self.truth.utilisation,
            slip_mm: self.truth.slip_mm,
            corner_n: self.truth.corner_n,
            floor_pressure: contact.floor_pressure,
        });
        Ok(())
    }

    /// Radial balance of steady rolling on the continuous wall.
    fn roll_steadily(&mut self, local: &LocalWall, axial: Axial) {
        let radius = self.parameters.ring.radius_mm;
        let pressing = self.pressing(local);
        let spring = self.parameters.spring_n_per_mm;
        let used = |c: &rolling::Rolling| match axial {
            Axial::Pushed => 0.0,
            Axial::Utilised(u) => u,
            Axial::Driven(load) if c.cosine_n > 0.0 => (load + c.sine_n) / c.cosine_n,
            Axial::Driven(_) => 0.0,
        };
        let guess = self.truth.height_mm - self.base_mm;
        let contact = rolling::solve(&self.parameters.ring, self.truth.tread_mm_s, guess, |c| {
            c.cosine_n + used(c) * c.sine_n - pressing - spring * (c.height_mm - radius)
        });
        self.base_mm = local.base_mm;
        self.truth.height_mm = contact.height_mm + local.base_mm;
        self.truth.depth_mm = radius - contact.height_mm;
        self.truth.corner_n = 0.0;
        self.truth.floor_n = contact.cosine_n;
        self.truth.utilisation = used(&contact);
        self.truth.separation_mm = 0.0;
        self.normal_n = contact.normal_n;
        self.cosine_n = contact.cosine_n;
        self.sine_n = contact.sine_n;
        self.truth.ring_awake = false;
    }

    /// Modes of the arm, forced by the torque ripple of motor and gearbox.
    fn vibrate(&mut self, dt_s: f64) {
        const PARTS: usize = 4;
        let (amplitude, pitch) = self.parameters.ripple;
        let spin = self.truth.tread_mm_s;
        let part = dt_s / PARTS as f64;
        let tread = self.truth.rotation_rad * self.parameters.ring.radius_mm;
        for index in 0..PARTS {
            let back = (PARTS - 1 - index) as f64 * part;
            let phase = (tread - spin * back) / pitch * std::f64::consts::TAU;
            let force = if spin == 0.0 { 0.0 } else { amplitude * phase.sin() };
            for mode in &mut self.modes {
                mode.step(force, part);
            }
        }
        self.truth.vibration_mm = self.modes.first().map_or(0.0, Mode::deflection_mm);
    }

    /// Preload of spring and screw at the present height.
    fn preload_now(&self) -> f64 {
        let rise = self.truth.height_mm - self.parameters.ring.radius_mm;
        (self.preload.seat_n() + self.parameters.spring_n_per_mm * rise).max(0.0)
    }

    fn separation(&self, height_mm: f64) -> f64 {
        (height_mm - self.parameters.ring.radius_mm).max(0.0)
    }

    /// What follows from the state.
    fn derive(&mut self) {
        let truth = &mut self.truth;
        truth.radius_mm = self.parameters.wall_radius_mm - truth.height_mm;
        truth.arm_rad = self.parameters.arm.angle(truth.radius_mm);
        let radius = self.parameters.ring.radius_mm;
        let local = self.parameters.wall.local(truth.position_mm);
        truth.root_clearance_mm = (local.ahead_mm < radius)
            .then(|| local.ahead_mm.hypot(truth.height_mm - local.base_mm) - radius);
        self.truth.preload_n = self.preload_now();
    }

    fn check(&self) -> Result<(), PlantError> {
        let t = &self.truth;
        let states = [
            ("position", t.position_mm),
            ("speed", t.speed_mm_s),
            ("tread speed", t.tread_mm_s),
            ("height", t.height_mm),
            ("preload", t.preload_n),
            ("vibration", t.vibration_mm),
        ];
        match states.into_iter().find(|(_, value)| !value.is_finite()) {
            Some((name, _)) => Err(PlantError::NotFinite { time_s: t.time_s, name }),
            None => Ok(()),
        }
    }
}
