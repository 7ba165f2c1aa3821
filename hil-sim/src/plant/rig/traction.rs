//! How the wheel moves along the wall: what motor, friction and carriage make of a stride,
//! and what the climb, the arm and the end stops do to it.

use super::{Drives, VirtualRig};
use crate::plant::actuators::Turn;
use crate::plant::balance::{Axial, Solved};
use crate::plant::grip::Grip;
use crate::plant::ring::Contact;
use crate::plant::wind_up::{WindUp, Winding};

/// Carrying less of its friction than this part for radial load, a wheel that spins at an
/// end stop is as good as jammed by the arm: it stands.
const JAMMED_BELOW: f64 = 0.25;

/// Travel over which the wheel's rise is learned, mm.
const LEARNING_MM: f64 = 1.0;

/// Largest distance of a stride's end from its prediction, mm.
const OFF_PREDICTION_MM: f64 = 0.01;

/// What holds or moves the wheel in a stride.
#[derive(Clone, Copy, Debug)]
pub(super) enum Moves {
    /// The stop or latch that carries the load until the drive first turns.
    Latched,
    /// An end stop holds the carriage, and the wheel spins with this utilisation.
    Spins(f64),
    /// Motor, friction and inertia.
    Driven(Grip),
    /// Free between the flanks of the gear, the wheel rolls along with the carriage.
    Free(Grip),
}

/// A stride as predicted from the forces of the last.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stride {
    pub(super) dt_s: f64,
    /// Position of the carriage at its end, and its travel, mm.
    pub(super) position_mm: f64,
    pub(super) travel_mm: f64,
    /// Angle that the wheel turns, rad, and the speed of its tread, mm/s.
    pub(super) turn_rad: f64,
    pub(super) tread_mm_s: f64,
    pub(super) moves: Moves,
    turn: Turn,
    /// Speeds of carriage and tread, mm/s, as predicted.
    predicted: (f64, f64),
    /// An end stop holds the carriage.
    stopped: bool,
    winding: Winding,
}

impl Stride {
    /// How friction is used.
    pub(super) fn axial(&self) -> Axial {
        match self.moves {
            Moves::Latched | Moves::Free(_) => Axial::Utilised(0.0),
            Moves::Spins(utilisation) => Axial::Utilised(utilisation),
            Moves::Driven(grip) => Axial::Carried(grip),
        }
    }
}

impl Stride {
    /// Mean force of the motor, N, with this load on the tread.
    pub(super) fn motor_force_n(&self, tread_load_n: f64) -> f64 {
        self.turn.force_n + self.turn.force_rises * tread_load_n
    }
}

impl VirtualRig {
    /// Radial force per axial thrust: none while a latch holds the carriage.
    pub(super) fn thrust_ratio(&self) -> f64 {
        if self.latched { 0.0 } else { self.parameters.arm.thrust_ratio(self.truth.radius_mm) }
    }

    /// Largest acceleration of a sliding carriage, mm/s^2.
    pub(super) fn sliding_gain(&self) -> f64 {
        let (_, cosine, sine) = self.forces;
        let p = &self.parameters;
        let friction = p.friction_at(self.truth.position_mm);
        1000.0 * (friction * cosine + sine.abs() + p.load_n.abs()) / p.mass_kg
    }

    /// What the motor makes of the next `dt_s`, and where the forces of the last stride
    /// would take the wheel.
    pub(super) fn predict(&mut self, drives: &Drives, dt_s: f64) -> Stride {
        let p = &self.parameters;
        let tread = self.truth.tread_mm_s;
        let turn = match (self.imposed_speed_mm_s, self.play.motor_mm_s()) {
            (Some(imposed_speed_mm_s), _) => Turn::imposed(imposed_speed_mm_s),
            (None, Some(motor)) => p.drive.turn(motor, drives.drive, drives.drive_on, 0.0, dt_s),
            (None, None) => {
                let (on, load_n) = (drives.drive_on, self.tread_load_n);
                p.drive.turn(tread, drives.drive, on, load_n, dt_s)
            }
        };
        let shear = p.shear();
        if turn.free_mm_s != 0.0 && self.latched && !self.blocked {
            self.latched = false;
            // The latch lets go as the tread takes over the load.
            self.wind_up = WindUp::steady(&shear, p.load_n, 0.0, self.contact_mm);
        }
        let (normal, cosine, sine) = self.forces;
        let rolling = self.imposed_speed_mm_s.unwrap_or(tread).abs();
        let grip = Grip {
            mu: p.friction_at(self.truth.position_mm),
            winding: self.wind_up.over(&shear, rolling, self.contact_mm, dt_s),
            load_n: p.load_n,
            inertia: 1e-3 * p.mass_kg / dt_s,
            speed: self.truth.speed_mm_s,
            tread: turn.free_mm_s,
            yields: turn.yields,
            advance: self.rolling_part() * self.advance - self.eccentric().1 / p.ring.radius_mm,
            offset_n: self.offset_load_n(),
            normal: if cosine > 0.0 { self.lever_n() / cosine } else { self.rolling_part() },
        };
        let predicted = self.predict_speeds(&grip);
        let mut stride = Stride {
            dt_s,
            position_mm: self.truth.position_mm,
            travel_mm: 0.0,
            turn_rad: 0.0,
            tread_mm_s: predicted.1,
            moves: Moves::Latched,
            turn,
            predicted,
            stopped: false,
            winding: grip.winding,
        };
        if self.latched && !self.blocked {
            return stride;
        }
        stride.moves = Moves::Driven(grip);
        if self.play.motor_mm_s().is_some() {
            let speed = grip.ended(0.0, cosine, sine).speed;
            stride.moves = Moves::Free(grip);
            stride.predicted = (speed, speed / grip.advance);
            stride.tread_mm_s = stride.predicted.1;
        }
        self.thrust_n = p.load_n;
        stride.travel_mm = self.mean(self.truth.speed_mm_s, stride.predicted.0) * dt_s
            + self.distance_residual_mm.0;
        let at = self.truth.position_mm;
        let (low, high) = if self.blocked { (at, at) } else { p.stops_mm };
        let position = at + stride.travel_mm;
        if self.blocked || position < low || position > high {
            stride.travel_mm = position.clamp(low, high) - at;
            let friction = grip.mu.copysign(grip.tread);
            let slower = grip.tread - grip.yields * friction * normal;
            // The wheel spins, and presses itself in by what it pushes with; or it stands.
            let spins = slower * grip.tread > 0.0 && self.freedom(friction) >= JAMMED_BELOW;
            let tread = if spins { slower } else { 0.0 };
            stride.moves = if spins {
                Moves::Spins(friction)
            } else {
                Moves::Driven(Grip { tread: 0.0, speed: 0.0, ..grip })
            };
            stride.tread_mm_s = tread;
            stride.predicted = (0.0, tread);
            stride.stopped = true;
            self.thrust_n = if spins { friction * cosine - sine } else { p.load_n };
        }
        stride.position_mm = at + stride.travel_mm;
        let rolled = self.mean(tread, stride.tread_mm_s) * dt_s + self.distance_residual_mm.1;
        stride.turn_rad = rolled / p.ring.radius_mm;
        stride
    }

    /// Mean speed over a stride, mm/s: an imposed speed holds from the start on.
    pub(super) fn mean(&self, before: f64, end: f64) -> f64 {
        if self.imposed_speed_mm_s.is_some() { end } else { 0.5 * (before + end) }
    }

    /// Speeds of carriage and tread with which the stride will about end: with the slip of
    /// the last, or, sliding, with its forces.
    fn predict_speeds(&self, grip: &Grip) -> (f64, f64) {
        let (_, cosine, sine) = self.forces;
        if self.sliding || cosine <= 0.0 {
            let (utilisation, _) = grip.utilisation(cosine, sine);
            let ended = grip.ended(utilisation, cosine, sine);
            return (ended.speed, ended.tread);
        }
        let tread = grip.tread - grip.yields * self.tread_load_n;
        let slip = self.truth.tread_mm_s * grip.advance - self.truth.speed_mm_s;
        (tread * grip.advance - slip, tread)
    }

    /// Whether the stride ends far from its prediction.
    pub(super) fn off_prediction(&self, stride: &Stride, solved: &Solved) -> bool {
        let (Moves::Driven(grip), false) = (stride.moves, stride.stopped) else { return false };
        let (cosine, sine) = (solved.contact.cosine_n, solved.contact.sine_n);
        let ended = grip.ended(solved.utilisation, cosine, sine);
        (ended.speed - stride.predicted.0).abs() * stride.dt_s > OFF_PREDICTION_MM
    }

    /// Books the stride with the contact that was found for it.
    pub(super) fn complete(&mut self, stride: &Stride) {
        let (normal, cosine, sine) = self.forces;
        let traction_n = match stride.moves {
            Moves::Driven(grip) => grip.traction_n(self.truth.utilisation, cosine),
            _ => self.truth.utilisation * self.lever_n(),
        };
        let truth = &mut self.truth;
        let before = truth.tread_mm_s;
        let (mut tread_load_n, mut sliding) = (0.0, 0.0);
        truth.speed_mm_s = 0.0;
        match stride.moves {
            Moves::Latched => truth.tread_mm_s = 0.0,
            Moves::Spins(utilisation) => {
                truth.tread_mm_s = stride.tread_mm_s;
                tread_load_n = utilisation * normal;
                sliding = stride.tread_mm_s.abs();
            }
            Moves::Driven(grip) => {
                let ended = grip.ended(truth.utilisation, cosine, sine);
                truth.speed_mm_s = if stride.stopped { 0.0 } else { ended.speed };
                truth.tread_mm_s = ended.tread;
                tread_load_n = ended.tread_load_n;
                sliding = grip.slides(&ended, truth.utilisation, cosine);
                self.play.pushed(truth.utilisation * cosine, ended.tread);
            }
            Moves::Free(grip) => {
                truth.speed_mm_s = grip.ended(0.0, cosine, sine).speed;
                truth.tread_mm_s = truth.speed_mm_s / grip.advance;
                let motor = stride.turn.free_mm_s;
                let farther = (0.5 * (before + truth.tread_mm_s) - motor) * stride.dt_s;
                if !self.play.travelled(farther, motor) {
                    truth.tread_mm_s = motor;
                }
            }
        }
        // A wheel that has come to rest does not move on.
        let moves = truth.speed_mm_s != 0.0 || truth.tread_mm_s != 0.0;
        let dt_s = if moves { stride.dt_s } else { 0.0 };
        let (speed, tread) = (truth.speed_mm_s, truth.tread_mm_s);
        self.distance_residual_mm = (
            self.mean(0.0, speed - stride.predicted.0) * dt_s,
            self.mean(0.0, tread - stride.predicted.1) * dt_s,
        );
        let rolled = self.mean(before, tread) * stride.dt_s;
        let dt_s = stride.dt_s;
        self.advance = self.advance();
        self.sliding = sliding > 0.0;
        self.tread_load_n = tread_load_n;
        let truth = &mut self.truth;
        truth.slip_mm += sliding * dt_s;
        let (tread, speed) = (truth.tread_mm_s, truth.speed_mm_s);
        let creep = match stride.moves {
            Moves::Driven(grip) | Moves::Free(grip) => grip.creeps(tread, speed, traction_n),
            Moves::Latched | Moves::Spins(_) => tread - speed,
        };
        truth.rigid_mm_s = tread - creep;
        truth.friction_work_mj += truth.utilisation.abs() * normal * (creep.abs() * dt_s);
        truth.work_mj += (stride.motor_force_n(tread_load_n) * rolled).max(0.0);
        self.wind_up = stride.winding.end(traction_n);
    }

    /// Winds the tread up as it is in steady rolling against the load.
    pub(super) fn wind_steadily(&mut self) {
        let (shear, speed) = (self.parameters.shear(), self.truth.tread_mm_s.abs());
        self.wind_up = WindUp::steady(&shear, self.thrust_n, speed, self.contact_mm);
    }

    /// Lever of the friction, as normal force, N: traction at the tread is its part by the
    /// utilisation.
    pub(super) fn lever_n(&self) -> f64 {
        self.rolling_part() * self.forces.0 - self.eccentric_lever()
    }

    /// Torque of the normal pressure, as load on the drive, N: of a rim whose axis lies ahead of
    /// and above the axis of rotation, and of the inner load. Positive against the motion.
    fn offset_load_n(&self) -> f64 {
        self.truth.tread_mm_s.signum() * self.eccentric_load_n() + self.inner_load_n
    }

    /// What the rim's axis, off the axis of rotation, takes off the lever of the friction, N.
    pub(super) fn eccentric_lever(&self) -> f64 {
        let (_, cosine, sine) = self.forces;
        let (ahead, above) = self.eccentric();
        (cosine * above - sine * ahead) / self.parameters.ring.radius_mm
    }

    /// Load of the normal pressure on a rim off its axis, N, positive against rolling outwards.
    pub(super) fn eccentric_load_n(&self) -> f64 {
        let (_, cosine, sine) = self.forces;
        let (ahead, above) = self.eccentric();
        (cosine * ahead + sine * above) / self.parameters.ring.radius_mm
    }

    /// Rolling radius over the undeformed one. A loaded rubber wheel rolls on `R - c/3` with
    /// the compression c (Clark, Mechanics of Pneumatic Tires): the tread's speed is that of
    /// the undeformed circle, its motor force likewise.
    pub(super) fn rolling_part(&self) -> f64 {
        1.0 - self.parameters.rolling_compression * self.truth.depth_mm
            / self.parameters.ring.radius_mm
    }

    /// Axial travel of a gripping wheel per travel of its tread. With equal utilisation all
    /// over the contact, traction does the motor's work on the axle if
    /// `c v_x + s v_y = N omega R`, c and s being the cosine and sine sums. A step whose axial
    /// force is t lifts the wheel by t/c of its travel where it does no work on the tread;
    /// that work is known from the last strides.
    fn advance(&self) -> f64 {
        let (normal, cosine, sine) = self.forces;
        if cosine <= 0.0 {
            return 1.0;
        }
        let step = sine - self.truth.resistance_n;
        let along = cosine + step * (step / cosine + self.tread_intake);
        if along > normal { normal / along } else { 1.0 }
    }

    /// Learns how much more than by the direction of the step's force the wheel has risen.
    pub(super) fn learn_rise(&mut self, contact: &Contact, travel_mm: f64, rise_mm: f64) {
        if contact.cosine_n > 0.0 {
            let leans = contact.step_sine_n / contact.cosine_n;
            let more = rise_mm - (leans + self.tread_intake) * travel_mm;
            self.tread_intake += more * travel_mm.signum() / travel_mm.abs().max(LEARNING_MM);
        }
    }

    /// Learns the inner load. Elements press along their rays, which are not normal to the wall:
    /// the resultants do not do quite the work that the elements take up. What they lack is a
    /// torque.
    pub(super) fn learn_inner_load(&mut self, lacking_mj: f64, rolled_mm: f64) {
        let rolled = rolled_mm.abs();
        if rolled > 0.0 {
            let part = 1.0 / rolled.max(LEARNING_MM);
            self.inner_load_n += (lacking_mj - self.inner_load_n * rolled) * part;
        }
    }

    /// Radial load that a wheel at an end stop carries with this utilisation, per normal
    /// force: the less there is, the more the arm presses it.
    fn freedom(&self, used: f64) -> f64 {
        let (normal, cosine, sine) = self.forces;
        let thrust_ratio = self.thrust_ratio();
        let carried = (1.0 - used * thrust_ratio) * cosine + (used + thrust_ratio) * sine;
        if normal > 0.0 { carried / normal } else { 1.0 }
    }
}
