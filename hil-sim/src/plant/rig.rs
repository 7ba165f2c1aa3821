//! The whole rig, a millisecond at a time.

mod contact;
mod follow;
mod phases;
mod traction;

use std::f64::consts::TAU;

use super::actuators::Pretightener;
use super::arm::{Mode, Ripple};
use super::balance::BalanceError;
use super::draw::PlantParameters;
use super::ledger::Ledger;
use super::ring::Ring;
use super::rolling::{self, Steady};
use contact::Calm;
use traction::Gait;

pub use phases::{PHASES, Phase, PhaseWork};

/// Most ring steps in a call: 10 mm of way at the usual stride.
const MOST_STRIDES: f64 = 256.0;

/// Way after which motor, friction and wall exchange their forces, if the step of time is
/// longer than that, mm.
pub const EXCHANGE_MM: f64 = 1.0;

/// How finely the rig is computed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Resolution {
    /// Longest axial way of one ring step, mm.
    pub stride_mm: f64,
    /// Resolves the ring on the smooth wall too, instead of steady rolling there.
    pub always_awake: bool,
}

impl Default for Resolution {
    fn default() -> Self {
        Self { stride_mm: 0.04, always_awake: false }
    }
}

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
    /// Deflection of the arm by its modes, mm.
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
    resolution: Resolution,
    ring: Ring,
    steady: Steady,
    awake: bool,
    calm: Calm,
    preload: Pretightener,
    modes: Vec<Mode>,
    /// Sine and cosine of the ripple's phase.
    ripple_phase: (f64, f64),
    /// Elastic force of the modes, their mean, N.
    vibration_n: f64,
    truth: Truth,
    ledger: Ledger,
    /// Sliding bodily over the wall.
    sliding: bool,
    /// Resting on the stop or latch that carries the load until the drive first turns.
    parked: bool,
    /// Tread speed of the last steady rolling, mm/s.
    rolled_mm_s: f64,
    /// Base of the wall under the centre in the last stride, mm.
    base_mm: f64,
    /// What was computed in each phase.
    phases: [PhaseWork; PHASES.len()],
    phase: Phase,
    /// Contact forces of the last stride: normal, cosine and sine sums, N.
    forces: (f64, f64, f64),
    /// Acceleration of the tread, mm/s^2.
    acceleration: f64,
    /// Rise of the centre per axial way in the last stride.
    slope: f64,
    /// The part of it that no change of load explains.
    drift: f64,
    /// Rise that no change of load explains while the wheel stands, mm/s.
    creep: f64,
    /// Derivatives of the resolved contact's cosine and sine sums by the height, N/mm.
    stiffness: Option<(f64, f64)>,
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
            resolution: Resolution::default(),
            ring: Ring::new(parameters.ring),
            steady: Steady::default(),
            ledger: Ledger::new(parameters.wall.steps().to_vec(), radius),
            awake: false,
            calm: Calm { tread_mm_s: 0.0, pressing_n: preload_n, for_s: f64::INFINITY },
            preload,
            modes,
            ripple_phase: (0.0, 1.0),
            vibration_n: 0.0,
            truth: Truth {
                position_mm,
                height_mm: local.base_mm + rest.height_mm,
                depth_mm: radius - rest.height_mm,
                friction: parameters.mu,
                ..Truth::default()
            },
            sliding: false,
            parked: true,
            rolled_mm_s: 0.0,
            base_mm: local.base_mm,
            phases: Default::default(),
            phase: Phase::Smooth,
            forces: (rest.normal_n, rest.cosine_n, 0.0),
            acceleration: 0.0,
            slope: 0.0,
            drift: 0.0,
            creep: 0.0,
            stiffness: None,
            parameters,
        };
        rig.derive();
        rig
    }

    /// The same rig computed at another resolution.
    #[must_use]
    pub fn with_resolution(mut self, resolution: Resolution) -> Self {
        self.resolution = resolution;
        self
    }

    /// The same rig, its wheel already rolling at this speed, mm/s.
    #[must_use]
    pub fn with_speed(mut self, speed_mm_s: f64) -> Self {
        self.truth.tread_mm_s = speed_mm_s;
        self.truth.speed_mm_s = speed_mm_s;
        self.rolled_mm_s = speed_mm_s;
        self.parked = false;
        self
    }

    /// The same rig with every ring element visited that faces the wall, in reach or not.
    /// No bit of any result depends on it: it proves that what is skipped is not needed.
    #[must_use]
    pub fn visiting_all(mut self) -> Self {
        self.ring = self.ring.whole(true);
        self
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
        let before = self.work();
        let mut left_s = dt_s;
        while left_s > 0.0 {
            let part_s = self.exchange(left_s);
            self.turn_wheel(drives, part_s);
            self.check()?;
            let way = self.truth.tread_mm_s.abs().max(self.truth.speed_mm_s.abs()) * part_s;
            let parts = (way / self.resolution.stride_mm).ceil().clamp(1.0, MOST_STRIDES);
            for _ in 0..parts as usize {
                self.roll(part_s / parts)?;
            }
            left_s -= part_s;
        }
        self.count(&before, dt_s);
        self.vibrate(dt_s);
        self.truth.time_s += dt_s;
        self.derive();
        self.check()
    }

    /// How long motor and wall may go on with the forces that they have, up to `left_s`:
    /// until wheel or carriage have moved by [`EXCHANGE_MM`].
    fn exchange(&self, left_s: f64) -> f64 {
        let drive = &self.parameters.drive;
        let (tread, speed) = (self.truth.tread_mm_s.abs(), self.truth.speed_mm_s.abs());
        // The most that motor and carriage can gain.
        let gain = 1000.0 * drive.limit_n / drive.mass_kg * left_s;
        let spin = (tread + gain).min(tread.max(drive.no_load_mm_s));
        let slide = if self.sliding { speed + self.sliding_gain() * left_s } else { speed };
        let way = spin.max(slide) * left_s;
        if way <= EXCHANGE_MM { left_s } else { left_s / (way / EXCHANGE_MM).ceil() }
    }

    /// Motor and gearbox: the wheel's spin.
    fn turn_wheel(&mut self, drives: &Drives, dt_s: f64) {
        let before = self.truth.tread_mm_s;
        let load = self.drive_load(drives.drive);
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
        let Gait { mut speed, gripped, mut axial } = self.traction(dt_s);
        let before = self.truth.position_mm;
        let (low, high) = self.parameters.stops_mm;
        let mut position = before + speed * dt_s;
        if position < low || position > high {
            position = position.clamp(low, high);
            speed = 0.0;
            if gripped != 0.0 {
                axial = self.sliding_towards(gripped).unwrap_or(axial);
            }
        }
        let tread = self.truth.tread_mm_s;
        self.truth.slip_mm += (gripped - speed).abs() * dt_s;
        let creep = (tread - speed).abs() * dt_s;
        self.truth.wear_mj += self.truth.utilisation.abs() * self.forces.0 * creep;
        self.truth.position_mm = position;
        self.truth.speed_mm_s = speed;
        let turn = tread * dt_s / self.parameters.ring.radius_mm;
        self.truth.rotation_rad += turn;
        let local = self.parameters.wall.local(position);
        let settled = self.settled(&local, axial, dt_s);
        if self.resolution.always_awake || !settled {
            if !self.awake {
                self.wake(before);
            }
            self.resolve(&local, axial, turn, dt_s)
        } else {
            self.awake = false;
            self.roll_steadily(&local, axial)
        }
    }

    /// Modes of the arm, forced by the torque ripple of motor and gearbox.
    fn vibrate(&mut self, dt_s: f64) {
        let (amplitude, pitch) = self.parameters.ripple;
        let spin = self.truth.tread_mm_s;
        let tread = self.truth.rotation_rad * self.parameters.ring.radius_mm;
        let to = (TAU * (tread / pitch).fract()).sin_cos();
        let force = Ripple {
            amplitude_n: if spin == 0.0 { 0.0 } else { amplitude },
            omega: TAU * spin / pitch,
            from: std::mem::replace(&mut self.ripple_phase, to),
            to,
        };
        let (mut deflection, mut sum) = (0.0, 0.0);
        for mode in &mut self.modes {
            mode.step(&force, dt_s);
            deflection += mode.deflection_mm();
            sum += mode.force_n();
        }
        self.truth.vibration_mm = deflection;
        self.vibration_n = sum / self.modes.len().max(1) as f64;
    }

    /// Preload of spring and screw at the present height.
    fn preload_now(&self) -> f64 {
        let rise = self.truth.height_mm - self.parameters.ring.radius_mm;
        (self.preload.seat_n() + self.parameters.spring_n_per_mm * rise).max(0.0)
    }

    /// What follows from the state.
    fn derive(&mut self) {
        let truth = &mut self.truth;
        truth.radius_mm = self.parameters.wall_radius_mm - truth.height_mm;
        truth.arm_rad = self.parameters.arm.angle(truth.radius_mm);
        let radius = self.parameters.ring.radius_mm;
        let local = self.parameters.wall.local(truth.position_mm);
        truth.root_clearance_mm = (local.ahead_mm < radius)
            .then(|| away(local.ahead_mm, truth.height_mm - local.base_mm) - radius);
        self.truth.preload_n = self.preload_now();
    }

    fn check(&self) -> Result<(), PlantError> {
        let t = &self.truth;
        // Causes first, so that the name is that of the origin.
        let states = [
            ("tread speed", t.tread_mm_s),
            ("screw", self.preload.seat_n()),
            ("vibration", self.vibration_n),
            ("speed", t.speed_mm_s),
            ("position", t.position_mm),
            ("rotation", t.rotation_rad),
            ("height", t.height_mm),
            ("utilisation", t.utilisation),
            ("slip", t.slip_mm),
            ("work", t.work_mj + t.wear_mj),
        ];
        // One look at all of them: none finite makes the other finite again.
        if states.iter().map(|(_, value)| value * 0.0).sum::<f64>() == 0.0 {
            return Ok(());
        }
        match states.into_iter().find(|(_, value)| !value.is_finite()) {
            Some((name, _)) => Err(PlantError::NotFinite { time_s: t.time_s, name }),
            None => Ok(()),
        }
    }
}

/// Length of the hypotenuse, for lengths far from the ends of the range.
fn away(x: f64, y: f64) -> f64 {
    (x * x + y * y).sqrt()
}
