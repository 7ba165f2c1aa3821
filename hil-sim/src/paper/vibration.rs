//! Deflection of the arm under a force at the wheel: the modes that the plant has,
//! driven by the collision instead of by the torque ripple.

use crate::plant::arm::Mode;

/// Damping ratio and modal mass of the plant's modes, kg.
const DAMPING: f64 = 0.02;
const MODAL_KG: f64 = 0.2;

/// Shortest time that a mode is stepped by, s.
const PART_S: f64 = 2.5e-4;

/// The arm's modes under a force.
#[derive(Clone, Debug)]
pub struct ArmResponse {
    modes: Vec<Mode>,
    before_n: f64,
}

impl ArmResponse {
    /// An arm at rest with these modes, Hz.
    #[must_use]
    pub fn new(modes_hz: &[f64]) -> Self {
        let modes = modes_hz.iter().map(|&hz| Mode::new(hz, DAMPING, MODAL_KG)).collect();
        Self { modes, before_n: 0.0 }
    }

    /// Deflection after `dt_s` in which the force ran linearly to `force_n`, mm.
    pub fn step(&mut self, force_n: f64, dt_s: f64) -> f64 {
        let parts = (dt_s / PART_S).ceil().max(1.0);
        let part = dt_s / parts;
        for index in 0..parts as usize {
            let mean = (index as f64 + 0.5) / parts;
            let force = self.before_n + mean * (force_n - self.before_n);
            for mode in &mut self.modes {
                mode.step(force, part);
            }
        }
        self.before_n = force_n;
        self.modes.iter().map(Mode::deflection_mm).sum()
    }
}
