//! Vibration: the arm under the force of a crossing.
//!
//! The study turns the stress waves of the impact into the excitation of a beam (41-56)
//! and takes the amplitude of that beam for the contact gap. Here the collision force
//! bends the arm, a beam with the wheel as a mass at its tip, and its amplitude is what it
//! is. The published millimetres are the clearance at the step root.

use std::f64::consts::TAU;

use interstage::rig::Rig;
use nalgebra::Complex;

use super::beam::{Beam, BeamError, Ends, Shape, Tip};

#[cfg(test)]
mod tests;

/// First constrained mode of the rig, Hz. Published (its Fig. 19).
pub(crate) const CONSTRAINED_HZ: f64 = 276.0;

/// Seventh free mode of the rig, Hz: the first that deforms it. Published (its Fig. 19).
pub(crate) const FREE_HZ: f64 = 163.0;

/// Loss factor of the bolted arm. Chosen: hysteresis of the alloy is a hundredth of
/// that; joints of small machines lie at 0.01 to 0.04.
const LOSS_FACTOR: f64 = 0.02;

/// Modes that move; those beyond, above 20 kHz, follow the force at once.
pub(crate) const MODES: usize = 6;

/// The drive arm, clamped at the pillar, with what is at the wheel as a point mass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Arm {
    pub beam: Beam,
    pub tip: Tip,
    /// Angle between arm and pillar, rad, with the wheel on the outermost wall.
    pub angle_rad: f64,
    pub loss_factor: f64,
}

impl Arm {
    /// The arm of the rig, its tip mass, 62.9 g, such that the first mode is the
    /// published constrained one.
    ///
    /// That mass is fitted to the one frequency: it represents wheel and axle and what
    /// yields in the clamp. The published free mode cannot be met by the same arm: a clamp
    /// takes two freedoms from it, so that the first mode with it lies at most as high as
    /// the first elastic one without (Rayleigh), and 163 Hz is below 276. The free rig
    /// therefore bends elsewhere first, in a part that its base holds when it is bolted
    /// down, of which nothing is published.
    pub(crate) fn of(rig: &Rig) -> Result<Self, BeamError> {
        let beam = Beam::drive_arm();
        let mass_kg = beam.tip_mass_for(CONSTRAINED_HZ)?;
        let geometry = &rig.rig;
        let reach =
            geometry.wall_radius_mm - geometry.wheel_radius_mm - geometry.arm_pivot_radius_mm;
        let sine = (reach / geometry.arm_length_mm).clamp(-1.0, 1.0);
        let tip = Tip { mass_kg, spring_n_per_m: 0.0 };
        Ok(Self { beam, tip, angle_rad: sine.asin(), loss_factor: LOSS_FACTOR })
    }

    /// Deflection at the tip per static force there, m/N: `L^3/(3 EI)`, and the spring.
    pub(crate) fn compliance_m_per_n(&self) -> f64 {
        let bending = 3.0 * self.beam.bending_stiffness_n_m2() / self.beam.length_m.powi(3);
        1.0 / (bending + self.tip.spring_n_per_m)
    }

    fn shapes(&self, count: usize) -> Result<Vec<Shape>, BeamError> {
        self.beam.shapes(Ends::ClampedFree, self.tip, count)
    }

    /// Its motion at the tip by its first `count` modes.
    pub(crate) fn modal(&self, count: usize) -> Result<Modal, BeamError> {
        Ok(Modal::new(&self.shapes(count)?, 0.5 * self.loss_factor, self.compliance_m_per_n()))
    }

    /// Deflection at the tip per force `e^{i omega t}` there, m/N.
    ///
    /// Equation: `sum of W(L)^2/(w_n^2 (1 + i eta) - w^2)` over the modes W of unit mass, eta
    /// the loss factor, and the static deflection of the modes left out; (56) has the
    /// amplitude of a normalised mode, which has none. Without a spring at the tip.
    /// Range: frequencies up to a few modes. Error: 1e-6 below 600 Hz.
    pub(crate) fn receptance_m_per_n(&self, frequency_hz: f64) -> Result<Complex<f64>, BeamError> {
        let loss = Complex::new(1.0, self.loss_factor);
        let square = (TAU * frequency_hz).powi(2);
        let mut sum = Complex::from(self.compliance_m_per_n()) / loss;
        for shape in self.shapes(2 * MODES)? {
            let stiffness = loss * (TAU * shape.mode.frequency_hz).powi(2);
            let gain = shape.tip().powi(2);
            sum += (stiffness - square).inv() * gain - stiffness.inv() * gain;
        }
        Ok(sum)
    }
}

/// One mode as an oscillator `u'' + 2 zeta w u' + w^2 u = W(L) F`.
#[derive(Clone, Copy, Debug)]
struct Oscillator {
    omega: f64,
    zeta: f64,
    /// W(L), 1/sqrt(kg).
    gain: f64,
    /// u and u', with the mode's scale.
    state: (f64, f64),
}

/// Motion of the tip over time as a sum of modes, each exact for a force that runs in
/// straight pieces.
#[derive(Clone, Debug)]
pub(crate) struct Modal {
    oscillators: Vec<Oscillator>,
    /// Static deflection per force that the modes left out give, m/N.
    rest_compliance: f64,
    force_n: f64,
}

impl Modal {
    /// At rest and unloaded: modes of one damping ratio, and the deflection per static
    /// force, m/N, to which the modes beyond them are taken to follow at once.
    fn new(shapes: &[Shape], zeta: f64, compliance: f64) -> Self {
        let oscillators: Vec<Oscillator> = shapes
            .iter()
            .map(|shape| Oscillator {
                omega: TAU * shape.mode.frequency_hz,
                zeta,
                gain: shape.tip(),
                state: (0.0, 0.0),
            })
            .collect();
        let held: f64 = oscillators.iter().map(|o| (o.gain / o.omega).powi(2)).sum();
        Self { oscillators, rest_compliance: compliance - held, force_n: 0.0 }
    }

    /// Runs the force linearly to `force_n` within `dt_s`, which must be above 0.
    ///
    /// Equation: with `f = F_0 + F' t` the motion is `(f - 2 zeta F'/w)/w^2` and a
    /// damped oscillation. Range: zeta from 0 to below 1. Error: rounding.
    pub(crate) fn step(&mut self, force_n: f64, dt_s: f64) {
        let rate = (force_n - self.force_n) / dt_s;
        for oscillator in &mut self.oscillators {
            oscillator.step(self.force_n, rate, dt_s);
        }
        self.force_n = force_n;
    }

    pub(crate) fn deflection_m(&self) -> f64 {
        let modes: f64 = self.oscillators.iter().map(|o| o.gain * o.state.0).sum();
        modes + self.rest_compliance * self.force_n
    }
}

impl Oscillator {
    fn step(&mut self, force_n: f64, rate: f64, dt: f64) {
        let (w, z) = (self.omega, self.zeta);
        let still = |force: f64| self.gain * (force - 2.0 * z * rate / w) / (w * w);
        let drift = self.gain * rate / (w * w);
        let (u, v) = (self.state.0 - still(force_n), self.state.1 - drift);
        let damped = w * (1.0 - z * z).sqrt();
        let decay = (-z * w * dt).exp();
        let (sin, cos) = (damped * dt).sin_cos();
        let (a, b) = (z * w / damped, 1.0 / damped);
        let moved = decay * ((cos + a * sin) * u + b * sin * v);
        let speed = decay * ((cos - a * sin) * v - w * w * b * sin * u);
        self.state = (still(force_n + rate * dt) + moved, drift + speed);
    }
}
