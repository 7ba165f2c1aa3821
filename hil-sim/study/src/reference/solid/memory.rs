//! The solid through any history of strain or stress, exact on straight pieces.

use super::Solid;

/// The state of one solid: where it is and what it still remembers.
///
/// Equation: `sigma = E_2 eps - (E_2 - q_0) m`, `m' = (eps - m)/p_1`, or, written for
/// a given stress, `m' = (sigma/q_0 - m)/T`, T = p_1 E_2/q_0. Both are integrated
/// exactly for what runs linearly within a step, whatever the step; a step of no length
/// is a jump.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Memory {
    solid: Solid,
    strain: f64,
    stress: f64,
    memory: f64,
}

impl Memory {
    /// A solid that has always been at rest.
    #[must_use]
    pub fn new(solid: Solid) -> Self {
        Self { solid, strain: 0.0, stress: 0.0, memory: 0.0 }
    }

    /// Strain now.
    #[must_use]
    pub fn strain(&self) -> f64 {
        self.strain
    }

    /// Stress now.
    #[must_use]
    pub fn stress(&self) -> f64 {
        self.stress
    }

    /// Runs the strain linearly to `strain` within `dt_s` and returns the stress there.
    /// Negative times are taken as none.
    pub fn strain_to(&mut self, strain: f64, dt_s: f64) -> f64 {
        self.memory = blend(self.memory, self.strain, strain, dt_s / self.solid.tau_s);
        self.strain = strain;
        // From the difference, so that a relaxed solid shows no residue of rounding.
        self.stress = self.solid.relaxed * strain + self.solid.excess() * (strain - self.memory);
        self.stress
    }

    /// Runs the stress linearly to `stress` within `dt_s` and returns the strain there.
    /// Negative times are taken as none.
    pub fn stress_to(&mut self, stress: f64, dt_s: f64) -> f64 {
        let ratio = dt_s / self.solid.retardation_time_s();
        let relaxed = self.solid.relaxed;
        self.memory = blend(self.memory, self.stress / relaxed, stress / relaxed, ratio);
        self.stress = stress;
        self.strain = (stress + self.solid.excess() * self.memory) / self.solid.instant;
        self.strain
    }

    /// Energy held, per volume: `q_0 eps^2/2 + (E_2 - q_0)(eps - m)^2/2`. What the
    /// damper has lost is the work done less this.
    #[must_use]
    pub fn energy(&self) -> f64 {
        let delayed = self.strain - self.memory;
        0.5 * (self.solid.relaxed * self.strain.powi(2) + self.solid.excess() * delayed.powi(2))
    }
}

/// A first-order lag after `ratio` time constants, its input running from `old` to `new`.
fn blend(lag: f64, old: f64, new: f64, ratio: f64) -> f64 {
    if ratio <= 0.0 {
        return lag;
    }
    // (1 - e^{-r})/r, the mean of the kernel.
    let mean = -(-ratio).exp_m1() / ratio;
    let keep = (-ratio).exp();
    // 1 - mean cancels for short steps.
    let from_new = if ratio < 1e-3 {
        ratio * (0.5 - ratio * (1.0 / 6.0 - ratio * (1.0 / 24.0 - ratio / 120.0)))
    } else {
        1.0 - mean
    };
    keep * lag + (mean - keep) * old + from_new * new
}
