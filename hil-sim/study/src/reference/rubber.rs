//! The tread as a material: the three-parameter solid (the study, eqs 1-10), with density.
//!
//! `sigma + p_1 sigma' = q_0 eps + q_1 eps'`, held as the two limits of its relaxation,
//! q_0 and E_2 = q_1/p_1, and the relaxation time p_1.

use super::case::ReferenceCase;

/// Thickness of the tread, mm. Not published; chosen: with it the fitted relaxed
/// stiffness, 0.6044e9 Pa/m, is a modulus of 4.8 MPa, that of the rubber's data sheets.
pub(crate) const THICKNESS_MM: f64 = 8.0;

/// Density of styrene butadiene rubber, kg/m^3, from material sheets.
pub(crate) const DENSITY_KG_M3: f64 = 1140.0;

/// A three-parameter solid with density; `0 < relaxed_pa <= instant_pa`, or it would not be
/// passive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Rubber {
    /// Modulus after a long time, Pa: q_0.
    pub relaxed_pa: f64,
    /// Modulus at once, Pa: E_2.
    pub instant_pa: f64,
    /// Relaxation time at held strain, s: p_1.
    pub tau_s: f64,
    pub density_kg_m3: f64,
}

impl Rubber {
    /// The fitted tread: its stiffness per area times its thickness.
    pub(crate) fn of(case: &ReferenceCase) -> Self {
        let thick_m = THICKNESS_MM * 1e-3;
        Self {
            relaxed_pa: case.rig.tread.k_inf_pa_per_m * thick_m,
            instant_pa: case.instant_pa_per_m() * thick_m,
            tau_s: case.rig.tread.tau_s,
            density_kg_m3: DENSITY_KG_M3,
        }
    }

    /// Speed of the front of a wave, m/s: `sqrt(E_2/rho)`.
    pub(crate) fn front_speed_m_s(&self) -> f64 {
        (self.instant_pa / self.density_kg_m3).sqrt()
    }

    /// Impedance of the front, Pa s/m: `rho c`; Z of (35) per area.
    pub(crate) fn impedance(&self) -> f64 {
        self.density_kg_m3 * self.front_speed_m_s()
    }
}
