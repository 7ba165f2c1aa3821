//! Collision: the force between tread and corner, with the inertia of what moves.
//!
//! The study models it as a cone that is pressed into the tread (14-29). What the wheel
//! meets is a straight edge as wide as itself, and at millimetres per second it meets it
//! quasi-statically. That crossing is [`hil_sim::plant::crossing`]; here inertia is added.
//!
//! A self-locking gear, whose reflected inertia is tens of the moved mass, drives the
//! wheel, so its axial speed is held; radially wheel, arm and carriage are free. When the
//! wheel touches the corner, the tread closes on it at `v sin(phi)`: millimetres per
//! second, which the contact takes up within milliseconds.

use super::case::ReferenceCase;
use hil_sim::plant::balance::{Balance, BalanceError};
use hil_sim::plant::ring::{Contact, Motion, Ring};
use hil_sim::plant::wall::{Step, Wall};

#[cfg(test)]
mod tests;

/// Most iterations of a step; a handful are needed.
const ITERATIONS: usize = 60;

/// The wheel at one instant. The wall is y = 0 before the face at x = 0, y = h behind.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Sample {
    /// Time since the wheel's undeformed circle touched the corner, s.
    pub t_s: f64,
    /// Centre, mm.
    pub x_mm: f64,
    /// Centre above the lower wall, mm.
    pub y_mm: f64,
    /// Force of the contact against the motion, N, without friction: the collision force.
    pub axial_n: f64,
    /// Force of the contact away from the wall, N: the preload, less what accelerates.
    pub radial_n: f64,
    /// Part of it that the lower wall carries, N.
    pub floor_n: f64,
    /// Clearance between step root and undeformed wheel, mm.
    pub clearance_mm: f64,
}

/// The crossing with inertia, from shortly before the touch until the wheel rolls on the upper wall.
///
/// Equation: `m y'' = C(y, memory) - P`, C the radial force of ring elements with the
/// memory of the three-parameter solid, `sum of p cos(psi) R dpsi L` with p >= 0, by the
/// trapezoidal rule, implicitly: second order, without damping of its own.
/// Sign: y away from the wall. Units: as the fields say.
/// Error: second order in the time step; the frequency of wheel on tread comes out low by
/// `(omega dt)^2/12`, 0.2 % at 0.2 ms and 800 rad/s.
/// Cost: some 10^4 steps of a few hundred elements.
/// Source: derived; as the mass or the speed falls it becomes the quasi-static crossing.
pub(crate) fn dynamic(case: &ReferenceCase) -> Result<Vec<Sample>, BalanceError> {
    let radius = case.rig.rig.wheel_radius_mm;
    let height = case.rig.rig.step_height_mm;
    let wall = Wall::new(vec![Step { position_mm: 0.0, height_mm: height }]);
    let motion_to = |x: f64, y: f64, stride: f64, dt_s: f64| {
        let wall = wall.local(x);
        Motion { wall, height_mm: y - wall.base_mm, turn_rad: stride / radius, dt_s }
    };
    // Far enough to forget how the wheel was put down, or one turn.
    let run = case.rig.corner_reach_mm();
    let forget = 8.0 * case.rig.tread.tau_s * case.speed_mm_s;
    let settle = (forget + 0.5 * radius).min(7.0 * radius);
    let shown_mm = -run - 0.1 * radius;
    let mut ring = Ring::new(case.ring());
    let (mut t, mut x, mut y) = (0.0, -run - 0.1 * radius - settle, radius - 0.01);
    // Without inertia up to the first sample. A rest below this is rounding of the sum.
    while shown_mm - x > 1e-9 {
        let stride = case.resolution.stride_mm.min(shown_mm - x);
        let dt = stride / case.speed_mm_s;
        x += stride;
        let motion = motion_to(x, y, stride, dt);
        let solved = case.balance().solve(&mut ring, motion)?;
        ring.commit(&Motion { height_mm: solved.height_mm, ..motion });
        t += dt;
        y = solved.height_mm + motion.wall.base_mm;
    }
    let mut mass = Mass::at_rest(case, y);
    let mut samples: Vec<Sample> = Vec::new();
    let mut touch_s = None;
    let mut corner_before_mm = f64::NAN;
    let dt = case.resolution.step_s.min(case.resolution.stride_mm / case.speed_mm_s);
    let stride = dt * case.speed_mm_s;
    while x < 0.6 * radius {
        x += stride;
        t += dt;
        let motion = motion_to(x, mass.y_mm, stride, dt);
        let (contact, utilisation) = mass.step(&mut ring, motion);
        let y_mm = mass.y_mm;
        ring.commit(&Motion { height_mm: y_mm - motion.wall.base_mm, ..motion });
        let corner_mm = x.hypot(y_mm - height) - radius;
        if let (None, Some(before), true) = (touch_s, samples.last(), corner_mm < 0.0) {
            let part = corner_before_mm / (corner_before_mm - corner_mm);
            touch_s = Some(before.t_s + part * (t - before.t_s));
        }
        corner_before_mm = corner_mm;
        samples.push(Sample {
            t_s: t,
            x_mm: x,
            y_mm,
            axial_n: contact.sine_n,
            radial_n: contact.cosine_n + utilisation * contact.sine_n,
            floor_n: contact.floor_n,
            clearance_mm: x.hypot(y_mm) - radius,
        });
    }
    samples.iter_mut().for_each(|sample| sample.t_s -= touch_s.unwrap_or(0.0));
    Ok(samples)
}

/// The radial motion of what moves.
struct Mass {
    balance: Balance,
    mass_kg: f64,
    y_mm: f64,
    rate_mm_s: f64,
    acceleration_mm_s2: f64,
}

impl Mass {
    fn at_rest(case: &ReferenceCase, y_mm: f64) -> Self {
        let (balance, mass_kg) = (case.balance(), case.rig.plant.moved_mass_kg);
        Self { balance, mass_kg, y_mm, rate_mm_s: 0.0, acceleration_mm_s2: 0.0 }
    }

    /// One step; the contact at its end and the friction utilisation there.
    fn step(&mut self, ring: &mut Ring, motion: Motion) -> (Contact, f64) {
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
