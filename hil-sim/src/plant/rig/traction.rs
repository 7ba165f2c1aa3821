//! How the wheel moves along the wall: creep while the tread grips, Coulomb friction
//! while it slides, and what the climb, the arm and the end stops do to both.

use super::VirtualRig;
use crate::plant::actuators::Load;
use crate::plant::balance::Axial;

/// Carrying less of its friction than this part for radial load, a sliding wheel is as
/// good as jammed by the arm: it grips at once.
pub(super) const JAMMED_BELOW: f64 = 0.25;

/// Difference of tread and wall below which a sliding wheel that could grip does,
/// mm/s.
const GRIPS_WITHIN: f64 = 0.05;

/// Motion of a stride.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gait {
    /// Axial speed, mm/s.
    pub(super) speed: f64,
    /// Axial speed had the tread gripped, mm/s.
    pub(super) gripped: f64,
    /// How friction is used.
    pub(super) axial: Axial,
}

impl VirtualRig {
    /// Radial force per axial thrust: none while a latch holds the carriage.
    pub(super) fn wedge(&self) -> f64 {
        if self.parked { 0.0 } else { self.parameters.arm.wedge(self.truth.radius_mm) }
    }

    /// Load on the drive at the tread: traction, or an end stop in its way. What a
    /// gripping wheel carries along is a mass to the drive; taken as a force, a tick
    /// late, a carriage heavier than the rotor would shake it ever more.
    pub(super) fn drive_load(&self, duty: f64) -> Load {
        if self.parked {
            return Load::default();
        }
        let (normal, cosine, _) = self.forces;
        let traction = self.truth.utilisation * normal;
        let (low, high) = self.parameters.stops_mm;
        let position = self.truth.position_mm;
        if (position < high || duty <= 0.0) && (position > low || duty >= 0.0) {
            if self.sliding || cosine <= 0.0 {
                return Load::force(traction);
            }
            let mass_kg = self.parameters.mass_kg * normal / cosine;
            return Load { force_n: traction - 1e-3 * mass_kg * self.acceleration, mass_kg };
        }
        let friction = self.parameters.mu.copysign(duty);
        if self.truth.utilisation == friction {
            return Load::force(traction);
        }
        // What it takes to slide; jammed by the arm it does not.
        Load::force(friction * normal / self.freedom(friction, self.forces).max(JAMMED_BELOW))
    }

    /// Largest acceleration of a sliding carriage, mm/s^2.
    pub(super) fn sliding_gain(&self) -> f64 {
        let (_, cosine, sine) = self.forces;
        let most = self.parameters.mu * cosine + sine.abs() + self.parameters.load_n.abs();
        1000.0 * most / self.parameters.mass_kg
    }

    /// How the wheel moves in a stride, from the forces of the last.
    pub(super) fn traction(&mut self, dt_s: f64) -> Gait {
        if self.parked {
            return Gait { speed: 0.0, gripped: 0.0, axial: Axial::Utilised(0.0) };
        }
        let inertia = 1e-3 * self.parameters.mass_kg * self.acceleration;
        let load = self.parameters.load_n + inertia;
        let mu = self.parameters.mu;
        let (_, cosine, sine) = self.forces;
        // A wheel off the wall holds nothing.
        let needed =
            if cosine > 0.0 { (load + sine) / cosine } else { f64::INFINITY.copysign(load) };
        let gripped = self.gripped(needed.clamp(-mu, mu));
        let grips = needed.abs() < mu;
        let gripping = Gait { speed: gripped, gripped, axial: Axial::Driven(load) };
        // Friction has to bring the carriage to the speed at which the tread grips.
        let missing = sine + self.parameters.load_n;
        let short = 1e-3 * self.parameters.mass_kg * (gripped - self.truth.speed_mm_s) / dt_s;
        let reached = (short + missing).abs() <= mu * cosine;
        if grips && reached && !self.sliding {
            return gripping;
        }
        // Sliding: friction is spent against the slip, and what is missing accelerates
        // the carriage.
        let slip = gripped - self.truth.speed_mm_s;
        let sense = if slip.abs() > 1e-9 { slip.signum() } else { needed.signum() };
        let per_force = 1000.0 / self.parameters.mass_kg * dt_s;
        let Some(axial) = self.sliding_towards(sense) else {
            self.sliding = false;
            return gripping;
        };
        let speed = self.truth.speed_mm_s + per_force * (mu * sense * cosine - missing);
        let left = gripped - speed;
        if grips && (left * slip <= 0.0 || left.abs() < GRIPS_WITHIN) {
            self.sliding = false;
            return gripping;
        }
        self.sliding = true;
        Gait { speed, gripped, axial }
    }

    /// Friction of a wheel that slides with traction of this sign, unless jammed.
    pub(super) fn sliding_towards(&self, sense: f64) -> Option<Axial> {
        let friction = self.parameters.mu.copysign(sense);
        (self.freedom(friction, self.forces) >= JAMMED_BELOW)
            .then(|| Axial::Wedged { utilisation: friction, wedge: self.wedge() })
    }

    /// Axial speed of a wheel that grips with this utilisation.
    fn gripped(&self, used: f64) -> f64 {
        // Creep of the tread under traction, 63 % of friction at `elastic_creep`.
        let part = (used.abs() / self.parameters.mu).min(0.999);
        let creep = -self.parameters.elastic_creep * (1.0 - part).ln() * used.signum();
        let spin = self.truth.tread_mm_s * self.advance();
        spin - spin.abs() * creep
    }

    /// Axial way of a gripping wheel per way of its tread. With equal utilisation all
    /// over the contact, traction does the motor's work on the axle if
    /// `c v_x + s v_y = N omega R`, c and s being the cosine and sine sums.
    fn advance(&self) -> f64 {
        let (normal, cosine, sine) = self.forces;
        let along = cosine + sine * self.slope;
        if self.parameters.climb_slows && along > normal { normal / along } else { 1.0 }
    }

    /// Radial load that a wheel sliding with this utilisation carries, per normal
    /// force: the less there is, the more the arm presses it. From the contact's forces:
    /// normal, cosine and sine sums, N.
    pub(super) fn freedom(&self, used: f64, (normal, cosine, sine): (f64, f64, f64)) -> f64 {
        let wedge = self.wedge();
        let carried = (1.0 - used * wedge) * cosine + (used + wedge) * sine;
        if normal > 0.0 { carried / normal } else { 1.0 }
    }
}
