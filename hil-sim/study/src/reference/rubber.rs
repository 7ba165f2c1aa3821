//! The tread as a material: the three-parameter solid (the study, eqs 1-10), with density.
//!
//! `sigma + p_1 sigma' = q_0 eps + q_1 eps'`, held as the two limits of its relaxation,
//! q_0 and E_2 = q_1/p_1, and the relaxation time p_1.

use std::f64::consts::{LN_10, TAU};

use super::case::ReferenceCase;

/// Thickness of the tread, mm. Not published; chosen: with it the fitted relaxed
/// stiffness, 0.6044e9 Pa/m, is a modulus of 4.8 MPa, that of the rubber's data sheets.
pub const THICKNESS_MM: f64 = 8.0;

/// Density of styrene butadiene rubber, kg/m^3, from material sheets.
pub const DENSITY_KG_M3: f64 = 1140.0;

/// Long-term modulus of the rubber, Pa, from material sheets.
pub const SHEET_MODULUS_PA: f64 = 4.8e6;

/// A three-parameter solid with density; `0 < relaxed_pa <= instant_pa`, or it would not be
/// passive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rubber {
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
    pub fn of(case: &ReferenceCase) -> Self {
        let thick_m = THICKNESS_MM * 1e-3;
        Self {
            relaxed_pa: case.rig.tread.k_inf_pa_per_m * thick_m,
            instant_pa: case.instant_pa_per_m() * thick_m,
            tau_s: case.rig.tread.tau_s,
            density_kg_m3: DENSITY_KG_M3,
        }
    }

    /// The rubber of the sheets, with this largest loss tangent, at this frequency, Hz:
    /// 0.1 to 0.25 between 10 and 100 Hz.
    ///
    /// Equation: `tan delta = (s - 1)/(2 sqrt s)` at `omega p_1 = 1/sqrt s`, s = E_2/q_0.
    /// Range: both above 0.
    pub fn of_sheets(loss_tangent: f64, at_hz: f64) -> Self {
        let root = loss_tangent + loss_tangent.hypot(1.0);
        Self {
            relaxed_pa: SHEET_MODULUS_PA,
            instant_pa: SHEET_MODULUS_PA * root * root,
            tau_s: 1.0 / (TAU * at_hz * root),
            density_kg_m3: DENSITY_KG_M3,
        }
    }

    /// Speed of the front of a wave, m/s: `sqrt(E_2/rho)`.
    pub fn front_speed_m_s(&self) -> f64 {
        (self.instant_pa / self.density_kg_m3).sqrt()
    }

    /// Speed of a slow wave, m/s: `sqrt(q_0/rho)`.
    pub fn slow_speed_m_s(&self) -> f64 {
        (self.relaxed_pa / self.density_kg_m3).sqrt()
    }

    /// Impedance of the front, Pa s/m: `rho c`; Z of (35) per area.
    pub fn impedance(&self) -> f64 {
        self.density_kg_m3 * self.front_speed_m_s()
    }

    /// Largest attenuation of any wave, dB, over `travel_m`: that of the front,
    /// `(1 - q_0/E_2)/(2 p_1 c)` Np/m, c the speed of the front.
    pub fn loss_db(&self, travel_m: f64) -> f64 {
        let relaxing = (self.instant_pa - self.relaxed_pa) / self.instant_pa;
        let front_np_m = relaxing / (2.0 * self.tau_s * self.front_speed_m_s());
        20.0 * front_np_m * travel_m / LN_10
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Complex;

    use super::*;

    #[test]
    fn the_tread_is_crossed_in_a_tenth_of_a_millisecond_and_next_to_nothing_is_lost() {
        let thick_m = THICKNESS_MM * 1e-3;
        for (loss, hz) in [(0.1, 10.0), (0.1, 100.0), (0.25, 10.0), (0.25, 100.0)] {
            let rubber = Rubber::of_sheets(loss, hz);
            for speed in [rubber.slow_speed_m_s(), rubber.front_speed_m_s()] {
                let transit_ms = THICKNESS_MM / speed;
                assert!((0.08..0.15).contains(&transit_ms), "{transit_ms}");
            }
            let loss = rubber.loss_db(thick_m);
            assert!(loss > 0.0 && loss < 0.16, "{loss} dB");
        }
        // The fitted tread stiffens more, so its front is faster.
        let fitted = Rubber::of(&ReferenceCase::first());
        assert!((THICKNESS_MM / fitted.slow_speed_m_s() - 0.1228).abs() < 1e-4);
        assert!((THICKNESS_MM / fitted.front_speed_m_s() - 0.0598).abs() < 1e-4);
        assert!(fitted.loss_db(thick_m) < 0.002);
    }

    #[test]
    fn the_sheets_loss_is_met_at_its_frequency() {
        let rubber = Rubber::of_sheets(0.25, 100.0);
        let tangent = |omega: f64| {
            let q_1 = rubber.tau_s * rubber.instant_pa;
            let modulus = Complex::new(rubber.relaxed_pa, omega * q_1)
                / Complex::new(1.0, omega * rubber.tau_s);
            modulus.im / modulus.re
        };
        let peak = TAU * 100.0;
        assert!((tangent(peak) - 0.25).abs() < 1e-12);
        assert!(tangent(0.9 * peak) < 0.25 && tangent(1.1 * peak) < 0.25);
    }
}
