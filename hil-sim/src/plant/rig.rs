//! The complete rig, a millisecond at a time.

mod contact;
mod energy;
mod intervention;
mod traction;
mod truth;

use std::f64::consts::TAU;

use contact::SettleTimer;
use traction::Stride;

use super::actuators::{Play, Pretightener};
use super::arm::{Mode, Pivot, Ripple};
use super::balance::Balance;
use super::draw::PlantParameters;
use super::ledger::Ledger;
use super::ring::{Ring, Work};
use super::rolling::{self, Steady};
use super::wind_up::WindUp;

pub use super::truth::Truth;
pub use energy::Energy;
pub use truth::PlantError;

/// How much farther the screw retreats than each step is high, mm.
const STEP_ROOM_MM: f64 = 1.0;
/// Most ring steps in a call: 10 mm of travel at the usual stride.
const MOST_STRIDES: f64 = 256.0;

/// Travel after which the stride is fitted to the speed again, mm.
const EXCHANGE_MM: f64 = 1.0;

/// Most parts that a stride is halved into.
const MOST_HALVINGS: f64 = 4096.0;

/// How finely the rig is computed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Resolution {
    /// Longest axial travel of one ring step, mm.
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
    pub drive_on: bool,
    /// Pre-tightener duty, -1 to 1.
    pub preload: f64,
    pub preload_on: bool,
    /// Parts of drive and pre-tightener that are lost behind their bridges, in motor and
    /// gear: zero where all is sound.
    pub lost: [f64; 2],
}

impl Drives {
    /// Duty that drive and pre-tightener work with.
    pub(crate) fn worked(&self) -> [f64; 2] {
        [self.drive * (1.0 - self.lost[0]), self.preload * (1.0 - self.lost[1])]
    }
}

#[derive(Clone, Debug)]
pub struct VirtualRig {
    parameters: PlantParameters,
    resolution: Resolution,
    ring: Ring,
    steady: Steady,
    awake: bool,
    settle_timer: SettleTimer,
    preload: Pretightener,
    pivot: Pivot,
    play: Play,
    modes: Vec<Mode>,
    /// Sine and cosine of the ripple's phase.
    ripple_phase: (f64, f64),
    /// Elastic force of the modes, their mean, N.
    vibration_n: f64,
    /// Force of the contact on the modes, N.
    excitation_n: f64,
    truth: Truth,
    ledger: Ledger,
    energy: Energy,
    /// What the ring's elements had taken up at the end of the last stride, mJ.
    taken_mj: f64,
    /// Load on the tread by what the elements take up beyond the work of the contact's
    /// resultants, N, signed as its motion.
    inner_load_n: f64,
    /// Displacement of the tread along the wall against the wheel.
    wind_up: WindUp,
    /// Length of the contact, mm.
    contact_mm: f64,
    /// Sliding bodily over the wall.
    sliding: bool,
    /// Force of a weight that hangs on the wheel and pulls it off the wall, N.
    hung_n: f64,
    /// A block holds the wheel at its height.
    blocked: bool,
    /// Thickness of a gauge under the compression sensor, mm.
    gauge_mm: Option<f64>,
    /// Held by the stop or latch that carries the load until the drive first turns.
    latched: bool,
    /// Tread speed of the last steady rolling, mm/s.
    rolled_mm_s: f64,
    /// Base of the wall under the centre in the last stride, mm.
    base_mm: f64,
    /// Contact forces of the last stride: normal, cosine and sine sums, N.
    forces: (f64, f64, f64),
    /// Travel by the speeds of the last stride beyond the predicted one: of the carriage and
    /// of the tread, mm.
    distance_residual_mm: (f64, f64),
    /// Force that resisted the tread in the last stride, N, signed as its speed.
    tread_load_n: f64,
    /// Static thrust on the arm, N: the load, or at an end stop what the wheel pushes with.
    thrust_n: f64,
    /// Imposed speed of the tread in place of the motor's, mm/s.
    imposed_speed_mm_s: Option<f64>,
    /// Rise of the centre per axial travel in the last stride that no change of load explains.
    drift: f64,
    /// Rise per axial travel beyond that along the step's force: the tread's own compression.
    tread_intake: f64,
    /// Travel per travel of the tread of a gripping wheel, as far as the tread has taken it up.
    advance: f64,
    /// Rise that no change of load explains while the wheel is at rest, mm/s.
    creep: f64,
    /// Derivatives of the resolved contact's cosine and sine sums by the height, N/mm.
    stiffness: Option<(f64, f64)>,
}

impl VirtualRig {
    /// A rig at `position_mm` with the pre-tightener set to `preload_n` there, at rest.
    pub fn new(parameters: PlantParameters, position_mm: f64, preload_n: f64, dt_s: f64) -> Self {
        let local = parameters.wall.local(position_mm);
        let radius = parameters.ring.radius_mm;
        let guess_mm = radius - 0.1;
        let rest = rolling::solve(&parameters.ring, 0.0, guess_mm, |c| c.cosine_n - preload_n);
        let mut ring = Ring::new(parameters.ring);
        // Coupled elements have no closed form of steady rolling: they are always resolved.
        let coupled = parameters.ring.is_coupled();
        let at_rest =
            if coupled { Balance::rest(&mut ring, local, guess_mm, preload_n).ok() } else { None };
        let (height_mm, forces) = at_rest
            .map_or((rest.height_mm, (rest.normal_n, rest.cosine_n, 0.0)), |solved| {
                (solved.height_mm, (solved.contact.normal_n, solved.contact.cosine_n, 0.0))
            });
        let rise = local.base_mm + height_mm - radius;
        let seat = preload_n - parameters.spring_n_per_mm * rise;
        let steps = parameters.wall.steps().iter();
        let highest_mm: f64 = steps.map(|step| step.height_mm.max(0.0) + STEP_ROOM_MM).sum();
        let range = (-parameters.spring_n_per_mm * highest_mm, parameters.seat_max_n);
        let preload = parameters.pretightener(parameters.delay_s, dt_s, seat, range);
        let modes = parameters.modes.iter().map(|&mode| Mode::new(mode)).collect();
        let mut rig = Self {
            resolution: Resolution::default(),
            taken_mj: ring.taken_mj(),
            ring,
            steady: Steady::default(),
            ledger: Ledger::new(parameters.wall.steps().to_vec(), radius),
            awake: coupled,
            settle_timer: SettleTimer {
                tread_mm_s: 0.0,
                pressing_n: preload_n,
                for_s: f64::INFINITY,
            },
            preload,
            modes,
            ripple_phase: (0.0, 1.0),
            vibration_n: 0.0,
            excitation_n: 0.0,
            pivot: Pivot::new(parameters.pivot_friction_n),
            play: Play::new(parameters.backlash_mm),
            truth: Truth {
                position_mm,
                height_mm: local.base_mm + height_mm,
                depth_mm: radius - height_mm,
                ..Truth::default()
            },
            energy: Energy::default(),
            inner_load_n: 0.0,
            wind_up: WindUp::default(),
            contact_mm: 1.0,
            sliding: false,
            hung_n: 0.0,
            blocked: false,
            gauge_mm: None,
            latched: true,
            rolled_mm_s: 0.0,
            base_mm: local.base_mm,
            forces,
            distance_residual_mm: (0.0, 0.0),
            tread_load_n: 0.0,
            thrust_n: parameters.load_n,
            imposed_speed_mm_s: None,
            drift: 0.0,
            tread_intake: 0.0,
            advance: 1.0,
            creep: 0.0,
            stiffness: None,
            parameters,
        };
        rig.derive();
        rig
    }

    /// The same rig computed at another resolution.
    pub fn with_resolution(mut self, resolution: Resolution) -> Self {
        self.resolution = resolution;
        self
    }

    /// The same rig, its wheel already rolling steadily at this speed, mm/s.
    pub fn with_speed(mut self, speed_mm_s: f64) -> Self {
        self.truth.tread_mm_s = speed_mm_s;
        self.truth.speed_mm_s = speed_mm_s;
        self.rolled_mm_s = speed_mm_s;
        self.latched = false;
        self.roll_on();
        self.derive();
        self
    }

    /// The same rig with every ring element visited that faces the wall, in reach or not.
    /// No bit of any result depends on it: it proves that skipping is exact.
    pub fn visiting_all(mut self) -> Self {
        self.ring = self.ring.visiting_all();
        self
    }

    /// Where the drive's work has gone.
    pub fn energy(&self) -> &Energy {
        &self.energy
    }

    pub fn truth(&self) -> &Truth {
        &self.truth
    }

    pub fn ledger(&self) -> &Ledger {
        &self.ledger
    }

    /// What has been computed so far: on the ring; and of steady rolling the contacts node by
    /// node, and the heights tried on a tangent.
    pub fn work(&self) -> (Work, (u64, u64)) {
        (self.ring.work(), self.steady.work())
    }

    pub fn parameters(&self) -> &PlantParameters {
        &self.parameters
    }

    /// Advances by `dt_s` under `drives`.
    pub fn step(&mut self, drives: &Drives, dt_s: f64) -> Result<(), PlantError> {
        let [drive, preload] = drives.worked();
        let worked = &Drives { drive, preload, ..*drives };
        self.preload.step(preload, drives.preload_on, self.truth.preload_n, dt_s);
        let mut left_s = dt_s;
        while left_s > 0.0 {
            let distance = self.farthest(left_s);
            let exchanges = (distance / EXCHANGE_MM).ceil().max(1.0);
            let part_s = left_s / exchanges;
            let parts = distance / exchanges / self.resolution.stride_mm;
            let parts = parts.ceil().clamp(1.0, MOST_STRIDES);
            for _ in 0..parts as usize {
                self.roll(worked, part_s / parts)?;
            }
            self.check()?;
            left_s -= part_s;
        }
        self.vibrate(dt_s);
        self.truth.time_s += dt_s;
        // The self-locking screw stops at once; the wheel turns on for some milliseconds.
        let (motor, speed) = (&self.parameters.drive, self.truth.tread_mm_s);
        let output = motor.bridge_output(drives.drive, drive, speed);
        self.truth.bridges = [
            if drives.drive_on { output } else { speed / motor.no_load_mm_s },
            if drives.preload_on { drives.preload } else { 0.0 },
        ];
        self.derive();
        self.check()
    }

    /// Farthest that wheel or carriage can come in this time, mm.
    fn farthest(&self, left_s: f64) -> f64 {
        let drive = &self.parameters.drive;
        let (tread, speed) = (self.truth.tread_mm_s.abs(), self.truth.speed_mm_s.abs());
        // The most that motor and carriage can gain.
        let gain = 1000.0 * drive.limit_n / drive.mass_kg * left_s;
        let spin = (tread + gain).min(tread.max(drive.no_load_mm_s));
        let slide = if self.sliding { speed + self.sliding_gain() * left_s } else { speed };
        spin.max(slide) * left_s
    }

    /// Strides of this time together: shorter ones where the forces that are found move the
    /// wheel far from where it was predicted.
    fn roll(&mut self, drives: &Drives, dt_s: f64) -> Result<(), PlantError> {
        let shortest_s = dt_s / MOST_HALVINGS;
        let (mut left_s, mut part_s) = (dt_s, dt_s);
        while left_s > 0.0 {
            if self.stride(drives, part_s, part_s > shortest_s)? {
                left_s -= part_s;
                part_s = left_s.min(2.0 * part_s);
            } else {
                part_s *= 0.5;
            }
        }
        Ok(())
    }

    /// One stride: motor, traction and radial balance at once. Unless it would have to go
    /// `finer`: then nothing has happened.
    fn stride(&mut self, drives: &Drives, dt_s: f64, finer: bool) -> Result<bool, PlantError> {
        let (truth, settle_timer, latched) = (self.truth, self.settle_timer, self.latched);
        let (_, cosine, sine) = self.forces;
        let stride = self.predict(drives, dt_s);
        let wound_mj = self.wind_up.stored_mj(&self.parameters.shear());
        if !stride.tread_mm_s.is_finite() {
            return Err(PlantError::NotFinite { time_s: truth.time_s, name: "tread speed" });
        }
        self.truth.position_mm = stride.position_mm;
        self.truth.rotation_rad += stride.turn_rad;
        let local = self.parameters.wall.local(stride.position_mm + self.eccentric().0);
        let settled = self.settled(&local, dt_s);
        let coupled = self.parameters.ring.is_coupled();
        let awake = self.resolution.always_awake || coupled || !settled;
        if awake && !self.awake {
            self.wake(truth.position_mm + self.eccentric().0);
        }
        self.awake = awake;
        let done = if awake {
            self.resolve(&local, stride, finer)?
        } else {
            self.roll_steadily(&local, stride, finer)?
        };
        if done {
            self.book(&truth, (cosine, sine), wound_mj, drives, &stride);
        } else {
            (self.truth, self.settle_timer, self.latched) = (truth, settle_timer, latched);
        }
        Ok(done)
    }

    /// Where the rim's axis is from the axis of rotation, mm: ahead of it and above it.
    fn eccentric(&self) -> (f64, f64) {
        let out = self.parameters.run_out_mm;
        if out == 0.0 {
            return (0.0, 0.0);
        }
        let (sin, cos) = self.truth.rotation_rad.sin_cos();
        (out * sin, out * cos)
    }

    /// Preload of spring and screw at the present height.
    fn preload_now(&self) -> f64 {
        let rise = self.truth.height_mm - self.eccentric().1 - self.parameters.ring.radius_mm;
        (self.preload.seat_n() + self.parameters.spring_n_per_mm * rise).max(0.0)
    }
}

impl VirtualRig {
    /// Force of the contact on the arm's modes, N: what the tread has to push with against load
    /// and step, by the torque that the motor on the arm holds against it. By the direction of
    /// the contact's force, so that neither the modes' own force nor the carriage's inertia,
    /// which both follow a tick late, drives them.
    fn excitation_n(&self) -> f64 {
        let (_, cosine, sine) = self.forces;
        if cosine <= 0.0 {
            return 0.0;
        }
        let (leans, load) = (sine / cosine, self.parameters.load_n);
        let pressed = self.preload_now() + self.thrust_ratio() * self.thrust_n;
        let carried = ((pressed - load * leans) / (1.0 + leans * leans)).max(0.0);
        let friction = self.parameters.friction_at(self.truth.position_mm);
        (load + leans * carried).min(friction * carried)
    }

    /// Modes of the arm, forced by the torque ripple of motor and gearbox and by the load that
    /// the contact puts on the drive.
    fn vibrate(&mut self, dt_s: f64) {
        let load_n = self.excitation_n();
        let load = (std::mem::replace(&mut self.excitation_n, load_n), load_n);
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
            mode.step(&force, load, dt_s);
            deflection += mode.deflection_mm();
            sum += mode.force_n();
        }
        self.truth.vibration_mm = deflection;
        self.vibration_n = sum / self.modes.len().max(1) as f64;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::Scenario;

    #[test]
    fn the_screw_ends_a_quarter_beyond_the_limit_and_slack_on_every_wall() {
        let mut scenario = Scenario::default();
        scenario.rig.rig.step_height_mm = 3.0;
        // The spring on the innermost wall is three steps shorter.
        for (position_mm, raised_mm) in [(0.0, 0.0), (80.0, 9.0)] {
            let mut rig = VirtualRig::new(scenario.plant(), position_mm, 33.3, 1e-3);
            let mut wound = |preload: f64, preload_on: bool| {
                let drives = Drives { preload, preload_on, ..Drives::default() };
                (0..4000).for_each(|_| rig.step(&drives, 1e-3).expect("a step"));
                (rig.truth().preload_n, rig.truth().depth_mm)
            };
            let (preload_n, depth_mm) = wound(1.0, true);
            assert!((preload_n + 1.2 * depth_mm - (62.5 + 1.2 * raised_mm)).abs() < 1e-9);
            // Off, it stays where it is, whatever is asked.
            assert!((wound(-1.0, false).0 - preload_n).abs() < 0.01);
            // The slack end has one more millimetre than each step is high.
            assert_eq!(wound(-1.0, true).0, 0.0);
            assert!((rig.preload.seat_n() + 1.2 * 12.0).abs() < 1e-9);
        }
    }
}
