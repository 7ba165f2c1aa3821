//! Waves in a rod of the rubber over time.
//!
//! A step carries the two waves by one cell exactly, between two halves of a relaxation
//! that is exact as well (Strang's splitting): without relaxation the result is
//! d'Alembert's to rounding, with it the error is of second order in the step.

use super::Rubber;
use crate::reference::error::{ReferenceError, positive, require};

/// What is held on the face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Face {
    /// A pressure, Pa.
    Pressure(f64),
    /// A speed inwards, m/s.
    Speed(f64),
}

/// A rod at some time. Pressure and inward motion are positive.
#[derive(Clone, Debug)]
pub struct Rod {
    rubber: Rubber,
    /// Part of a wave's pressure that the hub sends back: 1 rigid, 0 absorbing, -1 free.
    hub: f64,
    dt_s: f64,
    /// Waves inwards (positive) and outwards (negative), Pa, per cell.
    inward: Vec<f64>,
    outward: Vec<f64>,
    /// Strain in compression per cell.
    strain: Vec<f64>,
    /// Face and hub after the last step: pressure, Pa, and inward speed, m/s.
    face: (f64, f64),
    hub_pa: f64,
    keep: f64,
}

impl Rod {
    /// A rod at rest, of `length_m` in `cells`, against a hub that sends back `hub` of
    /// the pressure that arrives: `(Z_hub - Z)/(Z_hub + Z)`.
    ///
    /// # Errors
    /// [`ReferenceError::OutOfRange`] if the length is not above 0, there are fewer than
    /// two cells, or `hub` lies outside -1 to 1: the hub would give energy.
    pub fn new(
        rubber: Rubber,
        length_m: f64,
        cells: usize,
        hub: f64,
    ) -> Result<Self, ReferenceError> {
        positive("length_m", length_m)?;
        positive("density_kg_m3", rubber.density_kg_m3)?;
        require("cells", cells as f64, cells >= 2, "2 at least")?;
        require("hub", hub, (-1.0..=1.0).contains(&hub), "-1 to 1")?;
        let dt_s = length_m / cells as f64 / rubber.front_speed_m_s();
        Ok(Self {
            rubber,
            hub,
            dt_s,
            inward: vec![0.0; cells],
            outward: vec![0.0; cells],
            strain: vec![0.0; cells],
            face: (0.0, 0.0),
            hub_pa: 0.0,
            keep: (-0.5 * dt_s / rubber.solid.relaxation_time_s()).exp(),
        })
    }

    /// Length of a step, s: that in which the front crosses a cell.
    #[must_use]
    pub fn step_s(&self) -> f64 {
        self.dt_s
    }

    /// Pressure on the face, Pa, in the step just taken.
    #[must_use]
    pub fn face_pa(&self) -> f64 {
        self.face.0
    }

    /// Inward speed of the face, m/s, in the step just taken.
    #[must_use]
    pub fn face_m_s(&self) -> f64 {
        self.face.1
    }

    /// Pressure on the hub, Pa, in the step just taken.
    #[must_use]
    pub fn hub_pa(&self) -> f64 {
        self.hub_pa
    }

    /// Pressure in a cell, Pa: P + Q of (35).
    #[must_use]
    pub fn pressure_pa(&self, cell: usize) -> f64 {
        self.inward[cell] + self.outward[cell]
    }

    /// Inward speed of a cell, m/s: (P - Q)/Z of (35).
    #[must_use]
    pub fn speed_m_s(&self, cell: usize) -> f64 {
        (self.inward[cell] - self.outward[cell]) / self.rubber.impedance()
    }

    /// One step with `face` held.
    ///
    /// Equation: `rho v_t = -sigma_x`, `eps_t = -v_x`,
    /// `sigma + p_1 sigma_t = q_0 eps + q_1 eps_t`, as waves P and Q with
    /// `sigma = P + Q`, `rho c v = P - Q`, c the speed of the front.
    /// Cost: a few operations a cell.
    pub fn step(&mut self, face: Face) {
        self.relax();
        self.carry(face);
        self.relax();
    }

    /// Energy in the rod, J/m^2: of motion and of the springs.
    #[must_use]
    pub fn energy_j_m2(&self) -> f64 {
        let solid = self.rubber.solid;
        let cell_m = self.dt_s * self.rubber.front_speed_m_s();
        let cells = (0..self.strain.len()).map(|cell| {
            let strain = self.strain[cell];
            // What the relaxing branch bears; none in an elastic solid.
            let borne = self.pressure_pa(cell) - solid.relaxed() * strain;
            let delayed = if solid.excess() > 0.0 { borne * borne / solid.excess() } else { 0.0 };
            let moving = self.rubber.density_kg_m3 * self.speed_m_s(cell).powi(2);
            0.5 * (moving + solid.relaxed() * strain * strain + delayed)
        });
        cell_m * cells.sum::<f64>()
    }

    /// Half a step of relaxation at held strain and speed: the pressure above that of
    /// the relaxed spring fades.
    fn relax(&mut self) {
        if self.rubber.solid.excess() == 0.0 {
            return;
        }
        let relaxed = self.rubber.solid.relaxed();
        for cell in 0..self.strain.len() {
            let above = self.pressure_pa(cell) - relaxed * self.strain[cell];
            // Both waves alike: the speed is left.
            let fall = 0.5 * (self.keep - 1.0) * above;
            self.inward[cell] += fall;
            self.outward[cell] += fall;
        }
    }

    /// One cell on, as an elastic rod of the instant modulus would.
    fn carry(&mut self, face: Face) {
        let last = self.strain.len() - 1;
        let (instant, impedance) = (self.rubber.solid.instant(), self.rubber.impedance());
        for cell in 0..=last {
            // Strain and pressure change together.
            self.strain[cell] -= self.pressure_pa(cell) / instant;
        }
        let (leaving, arriving) = (self.outward[0], self.inward[last]);
        let entering = match face {
            Face::Pressure(pressure) => pressure - leaving,
            Face::Speed(speed) => impedance * speed + leaving,
        };
        self.inward.copy_within(..last, 1);
        self.outward.copy_within(1.., 0);
        self.inward[0] = entering;
        self.outward[last] = self.hub * arriving;
        self.face = (entering + leaving, (entering - leaving) / impedance);
        self.hub_pa = arriving * (1.0 + self.hub);
        for cell in 0..=last {
            self.strain[cell] += self.pressure_pa(cell) / instant;
        }
    }
}

#[cfg(test)]
mod tests;
