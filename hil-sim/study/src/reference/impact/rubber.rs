//! The tread as a material that carries waves.

use crate::reference::case::Case;
use crate::reference::error::{ReferenceError, positive};
use crate::reference::solid::Solid;

/// Thickness of the tread, mm. Not published; chosen: with it the fitted relaxed
/// stiffness, 0.6044e9 Pa/m, is a modulus of 4.8 MPa, that of the rubber's data sheets.
pub const THICKNESS_MM: f64 = 8.0;

/// Density of styrene butadiene rubber, kg/m^3, from material sheets.
pub const DENSITY_KG_M3: f64 = 1140.0;

/// Long-term modulus of the rubber, Pa, from material sheets.
pub const SHEET_MODULUS_PA: f64 = 4.8e6;

/// A solid with density.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rubber {
    /// Moduli, Pa.
    pub solid: Solid,
    /// Density, kg/m^3.
    pub density_kg_m3: f64,
}

impl Rubber {
    /// The fitted tread: its stiffness per area times its thickness.
    ///
    /// # Errors
    /// If the rig's numbers are none of a passive solid.
    pub fn of(case: &Case) -> Result<Self, ReferenceError> {
        let tread = case.tread()?;
        let thick_m = THICKNESS_MM * 1e-3;
        let (relaxed, instant) = (tread.relaxed() * thick_m, tread.instant() * thick_m);
        let solid = Solid::of_relaxation(relaxed, instant, tread.relaxation_time_s())?;
        Ok(Self { solid, density_kg_m3: DENSITY_KG_M3 })
    }

    /// The rubber of the sheets, with this largest loss tangent, at this frequency, Hz:
    /// 0.1 to 0.25 between 10 and 100 Hz.
    ///
    /// Equation: `tan delta = (s - 1)/(2 sqrt s)` at `omega p_1 = 1/sqrt s`, s = E_2/q_0.
    ///
    /// # Errors
    /// If one of them is not above 0.
    pub fn of_sheets(loss_tangent: f64, at_hz: f64) -> Result<Self, ReferenceError> {
        positive("loss_tangent", loss_tangent)?;
        positive("at_hz", at_hz)?;
        let root = loss_tangent + loss_tangent.hypot(1.0);
        let tau_s = 1.0 / (std::f64::consts::TAU * at_hz * root);
        let solid = Solid::of_relaxation(SHEET_MODULUS_PA, SHEET_MODULUS_PA * root * root, tau_s)?;
        Ok(Self { solid, density_kg_m3: DENSITY_KG_M3 })
    }

    /// Speed of the front of a wave, m/s: `sqrt(E_2/rho)`.
    #[must_use]
    pub fn front_speed_m_s(&self) -> f64 {
        (self.solid.instant() / self.density_kg_m3).sqrt()
    }

    /// Speed of a slow wave, m/s: `sqrt(q_0/rho)`.
    #[must_use]
    pub fn slow_speed_m_s(&self) -> f64 {
        (self.solid.relaxed() / self.density_kg_m3).sqrt()
    }

    /// Impedance of the front, Pa s/m: `rho c`; Z of (35) per area.
    #[must_use]
    pub fn impedance(&self) -> f64 {
        self.density_kg_m3 * self.front_speed_m_s()
    }
}
