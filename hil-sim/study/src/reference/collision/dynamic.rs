//! The crossing with the inertia of what moves.
//!
//! The wheel is driven by a self-locking gear whose reflected inertia is tens of the
//! moved mass, so its axial speed is held; radially wheel, arm and carriage are free.
//! Touching the corner, the tread closes on it at `v sin(phi)`: millimetres per second,
//! which the contact takes up within milliseconds.

use super::crossing::{Crossing, Recorder, Way};
use super::quasi_static::Rolling;
use crate::reference::case::Case;
use crate::reference::error::ReferenceError;
use hil_sim::plant::balance::Balance;
use hil_sim::plant::ring::{Contact, Motion, Ring};

/// Most iterations of a step; a handful are needed.
const ITERATIONS: usize = 60;

/// The crossing with inertia.
///
/// Equation: `m y'' = C(y, memory) - P`, C the radial contact force of
/// [`super::quasi_static()`], by the trapezoidal rule, implicitly: second order, without
/// damping of its own.
/// Sign: y away from the wall. Units: as the fields say.
/// Range: that of [`Case::check`]. Error: second order in the time step; the frequency
/// of wheel on tread comes out low by `(omega dt)^2/12`, 0.2 % at 0.2 ms and 800 rad/s.
/// Cost: some 10^4 steps of a few hundred elements.
/// Source: derived; as the mass or the speed falls it becomes [`super::quasi_static()`].
///
/// # Errors
/// [`ReferenceError`] if an argument is out of range or the preload cannot be carried.
pub fn dynamic(case: &Case) -> Result<Crossing, ReferenceError> {
    case.check()?;
    let way = Way::of(case);
    let mut rolling = Rolling::start(case, &way);
    rolling.run(case, &way, way.shown_mm, |_| {})?;
    let mut mass = Mass::on(case, rolling.y_mm);
    let mut recorder = Recorder::default();
    let (mut x, mut t) = (rolling.x_mm, rolling.t_s);
    let dt = case.resolution.step_s.min(case.resolution.stride_mm / case.speed_mm_s);
    let stride = dt * case.speed_mm_s;
    while x < way.end_mm {
        x += stride;
        t += dt;
        let motion = way.motion(x, mass.y_mm, stride / way.radius_mm, dt);
        let (contact, utilisation) = mass.step(&mut rolling.ring, motion);
        let height_mm = mass.y_mm - motion.wall.base_mm;
        rolling.ring.commit(&Motion { height_mm, ..motion });
        recorder.take(&way, case, (t, x, mass.y_mm), &contact, utilisation);
    }
    Ok(recorder.finish(case))
}

/// The radial motion of what moves.
pub(super) struct Mass {
    balance: Balance,
    mass_kg: f64,
    pub(super) y_mm: f64,
    pub(super) rate_mm_s: f64,
    acceleration_mm_s2: f64,
}

impl Mass {
    /// At rest at `y_mm`, in balance.
    pub(super) fn on(case: &Case, y_mm: f64) -> Self {
        let balance = Balance {
            preload_n: case.preload_n,
            spring_n_per_mm: 0.0,
            arm_n: 0.0,
            axial: case.axial,
        };
        Self {
            balance,
            mass_kg: case.rig.plant.moved_mass_kg,
            y_mm,
            rate_mm_s: 0.0,
            acceleration_mm_s2: 0.0,
        }
    }

    /// One step; the contact at its end and the friction utilisation there.
    pub(super) fn step(&mut self, ring: &mut Ring, motion: Motion) -> (Contact, f64) {
        let dt = motion.dt_s;
        // mm/s^2 per N, and mm per N within the step.
        let per_n = 1e3 / self.mass_kg;
        let gain = 0.25 * dt * dt * per_n;
        let drift = self.y_mm + dt * (self.rate_mm_s + 0.25 * dt * self.acceleration_mm_s2);
        let base = motion.wall.base_mm;
        let radius = ring.parameters().radius_mm;
        let mut at = |y: f64| {
            let contact = ring.trial(&Motion { height_mm: y - base, ..motion });
            let forces = (contact.cosine_n, contact.sine_n);
            let (force, slope, used) = self.balance.residual(forces, contact.slope, 0.0);
            (contact, force, slope, used)
        };
        // The force falls as y grows: y - drift - gain * force rises and has one root,
        // between the wheel without contact and the wheel at rest there.
        let mut y = self.y_mm;
        let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
        let mut found = at(y);
        for _ in 0..ITERATIONS {
            let error = y - drift - gain * found.1;
            if error.abs() < 1e-13 * radius {
                break;
            }
            if error > 0.0 {
                high = high.min(y);
            } else {
                low = low.max(y);
            }
            let newton = y - error / (1.0 - gain * found.2);
            y = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
            found = at(y);
        }
        let (contact, force, _, utilisation) = found;
        let acceleration = per_n * force;
        self.rate_mm_s += 0.5 * dt * (self.acceleration_mm_s2 + acceleration);
        self.acceleration_mm_s2 = acceleration;
        self.y_mm = y;
        (contact, utilisation)
    }
}
