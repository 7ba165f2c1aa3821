//! Impact: stress waves in the tread between corner and hub.
//!
//! A rod of the rubber as long as the tread is thick, loaded on its face, bounded by the
//! hub: positive waves run inwards, negative ones come back (33-36). The study writes
//! Kelvin-Voigt's equation (37) and attenuation (40) under the three-parameter law (38);
//! here it is that law throughout, `rho (u_tt + p_1 u_ttt) = q_0 u_xx + q_1 u_xxt`.
//!
//! A step carries the two waves by one cell exactly, between two halves of a relaxation
//! that is exact as well (Strang's splitting): without relaxation the result is
//! d'Alembert's to rounding, with it the error is of second order in the step.

use super::Rubber;
use super::beam::Beam;
use super::rubber::THICKNESS_MM;

#[cfg(test)]
mod tests;

/// A rod at some time. Pressure and inward motion are positive.
#[derive(Clone, Debug)]
pub(crate) struct Rod {
    rubber: Rubber,
    /// Part of a wave's pressure that the hub sends back: 1 rigid, 0 absorbing, -1 free.
    hub: f64,
    dt_s: f64,
    /// Waves inwards (positive) and outwards (negative), Pa, per cell.
    inward: Vec<f64>,
    outward: Vec<f64>,
    /// Strain in compression per cell.
    strain: Vec<f64>,
    hub_pa: f64,
    keep: f64,
}

impl Rod {
    /// A rod at rest, of `length_m` in `cells`, two at least, against a hub that sends back
    /// `hub` of the pressure that arrives: `(Z_hub - Z)/(Z_hub + Z)`, -1 to 1.
    pub(crate) fn new(rubber: Rubber, length_m: f64, cells: usize, hub: f64) -> Self {
        let dt_s = length_m / cells as f64 / rubber.front_speed_m_s();
        Self {
            rubber,
            hub,
            dt_s,
            inward: vec![0.0; cells],
            outward: vec![0.0; cells],
            strain: vec![0.0; cells],
            hub_pa: 0.0,
            keep: (-0.5 * dt_s / rubber.tau_s).exp(),
        }
    }

    /// The tread at rest on a hub of the arm's alloy, in `cells`. That has a hundred times
    /// the impedance of rubber and sends back 0.98 of a wave.
    pub(crate) fn tread(rubber: Rubber, cells: usize) -> Self {
        let alloy = Beam::drive_arm();
        let hub = (alloy.e_pa * alloy.rho_kg_m3).sqrt();
        let reflection = (hub - rubber.impedance()) / (hub + rubber.impedance());
        Self::new(rubber, THICKNESS_MM * 1e-3, cells, reflection)
    }

    /// Length of a step, s: that in which the front crosses a cell.
    pub(crate) fn step_s(&self) -> f64 {
        self.dt_s
    }

    /// Pressure on the hub, Pa, in the step just taken.
    pub(crate) fn hub_pa(&self) -> f64 {
        self.hub_pa
    }

    /// Pressure in a cell, Pa: P + Q of (35).
    pub(crate) fn pressure_pa(&self, cell: usize) -> f64 {
        self.inward[cell] + self.outward[cell]
    }

    /// One step with this pressure held on the face, Pa.
    ///
    /// Equation: `rho v_t = -sigma_x`, `eps_t = -v_x`,
    /// `sigma + p_1 sigma_t = q_0 eps + q_1 eps_t`, as waves P and Q with
    /// `sigma = P + Q`, `rho c v = P - Q`, c the speed of the front. Cost: a few operations a cell.
    pub(crate) fn step(&mut self, face_pa: f64) {
        self.relax();
        self.carry(face_pa);
        self.relax();
    }

    /// Half a step of relaxation at held strain and speed: the pressure above that of
    /// the relaxed spring fades.
    fn relax(&mut self) {
        let relaxed = self.rubber.relaxed_pa;
        if self.rubber.instant_pa - relaxed == 0.0 {
            return;
        }
        for cell in 0..self.strain.len() {
            let above = self.pressure_pa(cell) - relaxed * self.strain[cell];
            // Both waves alike: the speed stays.
            let fall = 0.5 * (self.keep - 1.0) * above;
            self.inward[cell] += fall;
            self.outward[cell] += fall;
        }
    }

    /// One cell on, as an elastic rod of the instant modulus would.
    fn carry(&mut self, face_pa: f64) {
        let last = self.strain.len() - 1;
        let instant = self.rubber.instant_pa;
        for cell in 0..=last {
            // Strain and pressure change together.
            self.strain[cell] -= self.pressure_pa(cell) / instant;
        }
        let (leaving, arriving) = (self.outward[0], self.inward[last]);
        self.inward.copy_within(..last, 1);
        self.outward.copy_within(1.., 0);
        self.inward[0] = face_pa - leaving;
        self.outward[last] = self.hub * arriving;
        self.hub_pa = arriving * (1.0 + self.hub);
        for cell in 0..=last {
            self.strain[cell] += self.pressure_pa(cell) / instant;
        }
    }
}
