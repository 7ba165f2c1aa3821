//! How a wave of one frequency runs and fades.

use nalgebra::Complex;

use super::Rubber;

/// Wave number and attenuation at one frequency.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wave {
    /// Wave number k, rad/m.
    pub number_rad_m: f64,
    /// Attenuation alpha, Np/m.
    pub attenuation_np_m: f64,
}

impl Wave {
    /// The wave `e^{-alpha x} e^{i(omega t - k x)}` of (39).
    ///
    /// Equation: `k - i alpha = omega sqrt(rho (1 + i omega p_1)/(q_0 + i omega q_1))`
    /// in place of (40), which is Kelvin-Voigt's.
    /// Sign: alpha >= 0 fades along the way. Units: omega in rad/s.
    /// Range: omega >= 0. Error: 1e-12, relative, alpha's against that of the wave that
    /// loses most (where nothing relaxes, alpha is the difference of what cancels, so it
    /// is taken from `alpha = -Im(E*) k_c^2/(2 k)` instead).
    /// Source: R. M. Christensen, "Theory of Viscoelasticity", 2nd ed., section 2.2.
    #[must_use]
    pub fn at(rubber: &Rubber, omega: f64) -> Self {
        let modulus = rubber.solid.complex_modulus(omega);
        // kappa^2 = rho omega^2/E* = a - i b, b >= 0.
        let scale = rubber.density_kg_m3 * omega * omega / modulus.norm_sqr();
        let square = Complex::new(scale * modulus.re, -scale * modulus.im);
        let number = (0.5 * (square.norm() + square.re)).sqrt();
        let attenuation = if number > 0.0 { -0.5 * square.im / number } else { 0.0 };
        Self { number_rad_m: number, attenuation_np_m: attenuation }
    }

    /// Phase speed, m/s, of the wave at this omega, rad/s.
    #[must_use]
    pub fn speed_m_s(&self, omega: f64) -> f64 {
        omega / self.number_rad_m
    }

    /// What is lost over a way, dB.
    #[must_use]
    pub fn loss_db(&self, way_m: f64) -> f64 {
        20.0 * self.attenuation_np_m * way_m / std::f64::consts::LN_10
    }
}

/// The largest attenuation at any frequency, Np/m: that of the front,
/// `(1 - q_0/E_2)/(2 p_1 c)`, c the speed of the front.
#[must_use]
pub fn front_attenuation_np_m(rubber: &Rubber) -> f64 {
    let solid = rubber.solid;
    let relaxing = solid.excess() / solid.instant();
    relaxing / (2.0 * solid.relaxation_time_s() * rubber.front_speed_m_s())
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::rubber::THICKNESS_MM;
    use super::*;
    use crate::reference::Case;
    use crate::reference::solid::Solid;

    fn rubbers() -> Vec<Rubber> {
        let mut rubbers = vec![Rubber::of(&Case::study()[0]).unwrap()];
        for loss in [0.1, 0.25] {
            for hz in [10.0, 100.0] {
                rubbers.push(Rubber::of_sheets(loss, hz).unwrap());
            }
        }
        rubbers
    }

    #[test]
    fn it_is_the_root_of_the_wave_equation() {
        for rubber in rubbers() {
            for step in -20..80 {
                let omega = 10_f64.powf(0.1 * f64::from(step));
                let wave = Wave::at(&rubber, omega);
                let kappa = Complex::new(wave.number_rad_m, -wave.attenuation_np_m);
                // rho (u_tt + p_1 u_ttt) = q_0 u_xx + q_1 u_xxt for e^{i(omega t - kappa x)}.
                let s = Complex::new(0.0, omega);
                let solid = rubber.solid;
                let left = s * s * (s * solid.relaxation_time_s() + 1.0) * rubber.density_kg_m3;
                let right = -kappa * kappa * (s * solid.q_1() + solid.relaxed());
                assert!((left - right).norm() < 1e-12 * left.norm(), "{omega}");
            }
        }
    }

    #[test]
    fn slow_and_fast_waves_have_the_speeds_of_the_two_moduli() {
        for rubber in rubbers() {
            let (slow, fast) = (Wave::at(&rubber, 1e-6), Wave::at(&rubber, 1e9));
            assert!((slow.speed_m_s(1e-6) / rubber.slow_speed_m_s() - 1.0).abs() < 1e-9);
            assert!((fast.speed_m_s(1e9) / rubber.front_speed_m_s() - 1.0).abs() < 1e-9);
            let limit = front_attenuation_np_m(&rubber);
            assert!((fast.attenuation_np_m / limit - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn the_tread_is_crossed_in_a_tenth_of_a_millisecond_and_next_to_nothing_is_lost() {
        let way = THICKNESS_MM * 1e-3;
        for rubber in &rubbers()[1..] {
            for speed in [rubber.slow_speed_m_s(), rubber.front_speed_m_s()] {
                let transit_ms = 1e3 * way / speed;
                assert!((0.08..0.15).contains(&transit_ms), "{transit_ms}");
            }
            let loss = Wave::at(rubber, 1e7).loss_db(way);
            assert!(loss > 0.0 && loss < 0.16, "{loss} dB");
        }
        // The fitted tread stiffens more, so its front is faster.
        let fitted = rubbers()[0];
        let transit_ms = |speed: f64| 1e3 * way / speed;
        assert!((transit_ms(fitted.slow_speed_m_s()) - 0.1228).abs() < 1e-4);
        assert!((transit_ms(fitted.front_speed_m_s()) - 0.0598).abs() < 1e-4);
        assert!(Wave::at(&fitted, 1e7).loss_db(way) < 0.002);
    }

    #[test]
    fn the_sheets_loss_is_met_at_its_frequency() {
        let rubber = Rubber::of_sheets(0.25, 100.0).unwrap();
        let peak = std::f64::consts::TAU * 100.0;
        assert!((rubber.solid.loss_tangent(peak) - 0.25).abs() < 1e-12);
        assert!(rubber.solid.loss_tangent(0.9 * peak) < 0.25);
        assert!(rubber.solid.loss_tangent(1.1 * peak) < 0.25);
        assert!(Rubber::of_sheets(0.0, 1.0).is_err());
    }

    proptest! {
        #[test]
        fn faster_waves_fade_more_and_run_faster(
            relaxed in 5.0..8.0_f64, stiffening in 0.01..1.5_f64, tau in -5.0..1.0_f64,
            omega in -2.0..6.0_f64, factor in 1.01..10.0_f64,
        ) {
            let relaxed = 10_f64.powf(relaxed);
            let solid = Solid::of_relaxation(
                relaxed, relaxed * 10_f64.powf(stiffening), 10_f64.powf(tau)).unwrap();
            let rubber = Rubber { solid, density_kg_m3: 1140.0 };
            let omega = 10_f64.powf(omega);
            let (low, high) = (Wave::at(&rubber, omega), Wave::at(&rubber, factor * omega));
            prop_assert!(high.attenuation_np_m > low.attenuation_np_m * (1.0 - 1e-12));
            let limit = front_attenuation_np_m(&rubber);
            prop_assert!(low.attenuation_np_m > 0.0 && low.attenuation_np_m <= limit * (1.0 + 1e-9));
            let (slow, fast) = (low.speed_m_s(omega), high.speed_m_s(factor * omega));
            prop_assert!(fast >= slow * (1.0 - 1e-12));
            prop_assert!(slow >= rubber.slow_speed_m_s() * (1.0 - 1e-12));
            prop_assert!(fast <= rubber.front_speed_m_s() * (1.0 + 1e-12));
        }
    }
}
