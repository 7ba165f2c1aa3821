//! The inclined drive arm: geometry, and its first modes as oscillators.

/// Geometry of the arm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arm {
    /// Length, mm.
    pub length_mm: f64,
    /// Pivot's distance from the pillar axis, mm.
    pub pivot_mm: f64,
    /// Sense of the axial coupling, see [`interstage::rig::Loads::arm_coupling`].
    pub coupling: f64,
}

impl Arm {
    /// Angle from the pillar with the wheel centre at this radius, rad.
    #[must_use]
    pub fn angle(&self, radius_mm: f64) -> f64 {
        ((radius_mm - self.pivot_mm) / self.length_mm).clamp(-1.0, 1.0).asin()
    }

    /// Radial force that an axial thrust adds, per unit of thrust.
    #[must_use]
    pub fn wedge(&self, radius_mm: f64) -> f64 {
        self.coupling * self.angle(radius_mm).tan()
    }
}

/// One mode of the arm: a damped oscillator, integrated exactly for a force held
/// over the step.
#[derive(Clone, Copy, Debug)]
pub struct Mode {
    /// Circular frequency, rad/s.
    omega: f64,
    /// Damping ratio.
    zeta: f64,
    /// Modal stiffness, N/mm.
    stiffness: f64,
    /// Deflection, mm.
    deflection: f64,
    /// Its rate, mm/s.
    rate: f64,
    /// Step that the propagator is made for, s.
    step: f64,
    /// Propagator of (deflection - static, rate).
    propagator: [[f64; 2]; 2],
}

impl Mode {
    /// A mode at rest: frequency in Hz, damping ratio, modal mass in kg.
    #[must_use]
    pub fn new(frequency_hz: f64, zeta: f64, mass_kg: f64) -> Self {
        let omega = std::f64::consts::TAU * frequency_hz;
        Self {
            omega,
            zeta,
            stiffness: mass_kg * omega * omega * 1e-3,
            deflection: 0.0,
            rate: 0.0,
            step: 0.0,
            propagator: [[1.0, 0.0], [0.0, 1.0]],
        }
    }

    /// Advances by `dt_s` under `force_n`, held over the step.
    pub fn step(&mut self, force_n: f64, dt_s: f64) {
        if self.step != dt_s {
            self.prepare(dt_s);
        }
        let rest = force_n / self.stiffness;
        let (u, v) = (self.deflection - rest, self.rate);
        let m = &self.propagator;
        self.deflection = rest + m[0][0] * u + m[0][1] * v;
        self.rate = m[1][0] * u + m[1][1] * v;
    }

    /// Deflection, mm.
    #[must_use]
    pub fn deflection_mm(&self) -> f64 {
        self.deflection
    }

    /// Elastic force of the deflection, N.
    #[must_use]
    pub fn force_n(&self) -> f64 {
        self.deflection * self.stiffness
    }

    /// exp(A dt) of the underdamped oscillator.
    fn prepare(&mut self, dt_s: f64) {
        let (w, z) = (self.omega, self.zeta);
        let damped = w * (1.0 - z * z).sqrt();
        let decay = (-z * w * dt_s).exp();
        let (sin, cos) = (damped * dt_s).sin_cos();
        self.propagator = [
            [decay * (cos + z * w / damped * sin), decay * sin / damped],
            [-decay * w * w / damped * sin, decay * (cos - z * w / damped * sin)],
        ];
        self.step = dt_s;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_force_rings_down_to_its_static_deflection() {
        let mut mode = Mode::new(276.0, 0.02, 0.2);
        let rest = 5.0 / (0.2 * (std::f64::consts::TAU * 276.0).powi(2) * 1e-3);
        let mut peak = 0.0f64;
        for _ in 0..4000 {
            mode.step(5.0, 2.5e-4);
            peak = peak.max(mode.deflection_mm());
        }
        let overshoot = 1.0 + (-std::f64::consts::PI * 0.02 / (1.0f64 - 4e-4).sqrt()).exp();
        assert!((peak / rest - overshoot).abs() < 0.02, "{}", peak / rest);
        assert!((mode.deflection_mm() / rest - 1.0).abs() < 1e-9);
    }

    #[test]
    fn the_wedge_falls_as_the_sleeve_narrows() {
        let arm = Arm { length_mm: 145.0, pivot_mm: 20.0, coupling: 1.0 };
        assert!((arm.angle(125.0).to_degrees() - 46.397).abs() < 1e-2);
        assert!(arm.wedge(125.0) > arm.wedge(113.0));
        assert!(arm.wedge(113.0) > 0.8);
    }
}
