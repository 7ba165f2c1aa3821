//! The three-parameter solid: a spring E_2 in series with a spring E_1 beside a
//! damper C_1 (the study, eqs 1-10, with C_1 for its c_1 and p_1 for its p_2).
//!
//! `sigma + p_1 sigma' = q_0 eps + q_1 eps'` with `q_0 = E_1 E_2/(E_1 + E_2)`,
//! `p_1 = C_1/(E_1 + E_2)`, `q_1 = p_1 E_2`. Held as the two limits of its relaxation,
//! q_0 and E_2, and p_1, so that the elastic solid (E_1 infinite) is one of them.
//! "Modulus" may be per length as well: the tread's is in Pa/m, its strain in m.

mod memory;

#[cfg(test)]
mod tests;

use nalgebra::Complex;

use super::error::{ReferenceError, positive, require};

pub use memory::Memory;

/// A three-parameter solid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Solid {
    relaxed: f64,
    instant: f64,
    tau_s: f64,
}

impl Solid {
    /// From springs (Pa) and damper (Pa s), as the study draws it.
    ///
    /// # Errors
    /// [`ReferenceError::OutOfRange`] if one of them is not a finite number above 0.
    pub fn of_parts(e_1: f64, e_2: f64, c_1: f64) -> Result<Self, ReferenceError> {
        positive("e_1", e_1)?;
        positive("e_2", e_2)?;
        positive("c_1", c_1)?;
        // Products of two moduli are avoided: they overflow first.
        Self::of_relaxation(e_1 / (1.0 + e_1 / e_2), e_2, c_1 / (e_1 + e_2))
    }

    /// From the modulus that is left after a long time, that of an instant, and the
    /// relaxation time, s.
    ///
    /// # Errors
    /// [`ReferenceError::OutOfRange`] if `0 < relaxed <= instant` or `tau_s > 0` does
    /// not hold: such a solid would not be passive.
    pub fn of_relaxation(relaxed: f64, instant: f64, tau_s: f64) -> Result<Self, ReferenceError> {
        positive("relaxed", relaxed)?;
        let ordered = instant.is_finite() && instant >= relaxed;
        require("instant", instant, ordered, "finite, not below the relaxed modulus")?;
        positive("tau_s", tau_s)?;
        Ok(Self { relaxed, instant, tau_s })
    }

    /// Modulus after a long time: q_0.
    #[must_use]
    pub fn relaxed(&self) -> f64 {
        self.relaxed
    }

    /// Modulus of an instant: E_2, q_1/p_1.
    #[must_use]
    pub fn instant(&self) -> f64 {
        self.instant
    }

    /// Relaxation time at held strain, s: p_1.
    #[must_use]
    pub fn relaxation_time_s(&self) -> f64 {
        self.tau_s
    }

    /// Retardation time at held stress, s: C_1/E_1 = q_1/q_0.
    #[must_use]
    pub fn retardation_time_s(&self) -> f64 {
        self.tau_s * (self.instant / self.relaxed)
    }

    /// q_1, Pa s.
    #[must_use]
    pub fn q_1(&self) -> f64 {
        self.tau_s * self.instant
    }

    /// Spring beside the damper, E_1; infinite if the solid is elastic.
    #[must_use]
    pub fn e_1(&self) -> f64 {
        self.relaxed / (1.0 - self.relaxed / self.instant)
    }

    /// Part of the modulus that relaxes.
    #[must_use]
    pub fn excess(&self) -> f64 {
        self.instant - self.relaxed
    }

    /// Strain per stress held since `t_s`.
    ///
    /// Equation: `J(t) = 1/E_2 + (1 - e^{-t/T})/E_1`, T = C_1/E_1 (9).
    /// Units: 1/Pa; 0 for t < 0. Range: any t. Error: 4 units in the last place.
    #[must_use]
    pub fn creep(&self, t_s: f64) -> f64 {
        if t_s < 0.0 {
            return 0.0;
        }
        let delayed = 1.0 / self.relaxed - 1.0 / self.instant;
        1.0 / self.instant - delayed * (-t_s / self.retardation_time_s()).exp_m1()
    }

    /// Stress per strain held since `t_s`.
    ///
    /// Equation: `E_r(t) = q_0 + (E_2 - q_0) e^{-t/p_1}` (10).
    /// Units: Pa; 0 for t < 0. Range: any t. Error: 4 units in the last place.
    #[must_use]
    pub fn relaxation(&self, t_s: f64) -> f64 {
        if t_s < 0.0 {
            return 0.0;
        }
        self.relaxed + self.excess() * (-t_s / self.tau_s).exp()
    }

    /// Stress per strain `e^{i omega t}`.
    ///
    /// Equation: `E*(omega) = (q_0 + i omega q_1)/(1 + i omega p_1)`: Q/P, where (13)
    /// prints P/Q. The real part stores, the imaginary part loses.
    /// Units: omega in rad/s, Pa. Range: omega >= 0.
    #[must_use]
    pub fn complex_modulus(&self, omega: f64) -> Complex<f64> {
        let x = omega * self.tau_s;
        let excess = self.excess() / (1.0 + 1.0 / (x * x));
        // At 0 the quotient is 1/inf, that is 0.
        let loss = self.excess() * x / (1.0 + x * x);
        Complex::new(self.relaxed + excess, loss)
    }

    /// Loss over storage at omega, rad/s. Largest, `(s - 1)/(2 sqrt s)` with
    /// s = E_2/q_0, at `omega p_1 = 1/sqrt s`.
    #[must_use]
    pub fn loss_tangent(&self, omega: f64) -> f64 {
        let modulus = self.complex_modulus(omega);
        modulus.im / modulus.re
    }
}
