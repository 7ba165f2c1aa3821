//! The rod against d'Alembert, against the dispersion relation, and its energy.

use std::f64::consts::{PI, TAU};

use nalgebra::Complex;
use proptest::prelude::*;

use super::super::dispersion::Wave;
use super::*;
use crate::reference::solid::Solid;

fn rubber(stiffening: f64, tau_s: f64) -> Rubber {
    let solid = Solid::of_relaxation(4.8e6, 4.8e6 * stiffening, tau_s).unwrap();
    Rubber { solid, density_kg_m3: 1140.0 }
}

#[test]
fn without_loss_a_pulse_is_dalemberts_there_and_back() {
    let cells = 50;
    let mut rod = Rod::new(rubber(1.0, 1.0), 8e-3, cells, 0.6).unwrap();
    // Pressure pulse of some shape on the face; P of (36) is it, delayed.
    let pulse = |step: i64| if (0..30).contains(&step) { (0.2 * step as f64).sin() } else { 0.0 };
    let n = cells as i64;
    for step in 0..160_i64 {
        rod.step(Face::Pressure(pulse(step)));
        // The free face turns what comes back over; twice round at most in this time.
        let inward = |at: i64| pulse(at) - 0.6 * pulse(at - 2 * n) + 0.36 * pulse(at - 4 * n);
        for cell in 0..cells {
            let at = cell as i64;
            let (p, q) = (inward(step - at), 0.6 * inward(step - 2 * n + 1 + at));
            assert!((rod.pressure_pa(cell) - (p + q)).abs() < 1e-12, "{step} {cell}");
            let speed = rod.speed_m_s(cell) * rod.rubber.impedance();
            assert!((speed - (p - q)).abs() < 1e-12, "{step} {cell}");
        }
    }
}

#[test]
fn a_struck_face_climbs_the_staircase() {
    // v held on the face, rigid hub: rho c v (1 + 2 n) after n returns.
    let mut rod = Rod::new(rubber(1.0, 1.0), 8e-3, 40, 1.0).unwrap();
    let jump = rod.rubber.impedance() * 2.7e-3;
    for step in 0..400 {
        rod.step(Face::Speed(2.7e-3));
        let returns = f64::from(step / 80);
        assert!((rod.face_pa() / (jump * (1.0 + 2.0 * returns)) - 1.0).abs() < 1e-12, "{step}");
    }
    assert!((jump - 199.7).abs() < 0.5, "{jump}");
}

#[test]
fn a_held_pressure_reaches_the_hub_in_one_transit_and_settles_there() {
    // Impedance of the hub a third above that of the rubber: the ringing dies down.
    let mut rod = Rod::new(rubber(1.0, 1.0), 8e-3, 40, 0.5).unwrap();
    for step in 0..4000 {
        rod.step(Face::Pressure(1e3));
        if step < 40 {
            assert_eq!(rod.hub_pa(), 0.0);
        } else if step == 40 {
            assert!((rod.hub_pa() - 1.5e3).abs() < 1e-9);
        }
    }
    assert!((rod.hub_pa() - 1e3).abs() < 1e-6);
}

/// Wave number and attenuation that a long rod shows at omega, from two cells.
fn measured(rubber: Rubber, omega: f64, cells: usize) -> Complex<f64> {
    // Ten waves long: what the far end sends back has faded when it arrives.
    let length = 10.0 * TAU / Wave::at(&rubber, omega).number_rad_m;
    let mut rod = Rod::new(rubber, length, cells, 0.0).unwrap();
    let (a, b) = (cells / 20, cells / 10);
    let period = TAU / omega;
    // Long enough for the transient to fade, then one period of correlation.
    let settle = (3.0 * length / rubber.slow_speed_m_s() + 30.0 * rubber.solid.relaxation_time_s())
        .max(4.0 * period);
    let mut t = 0.0;
    while t < settle {
        t += rod.step_s();
        rod.step(Face::Pressure((omega * t).sin()));
    }
    let count = (period / rod.step_s()).round();
    let mut sums = [Complex::new(0.0, 0.0); 2];
    for index in 0..count as usize {
        t += rod.step_s();
        rod.step(Face::Pressure((omega * t).sin()));
        // A window that forgives the rest of a period.
        let window = 1.0 - (TAU * index as f64 / count).cos();
        let phase = Complex::from_polar(window, -omega * t);
        for (sum, cell) in sums.iter_mut().zip([a, b]) {
            *sum += phase * rod.pressure_pa(cell);
        }
    }
    let way = (b - a) as f64 * rod.step_s() * rubber.front_speed_m_s();
    let ratio = sums[1] / sums[0];
    // e^{-i kappa way}, half a wave on: the phase is within a quarter turn of -pi.
    let phase = ratio.arg().rem_euclid(TAU) - TAU;
    Complex::new(-phase / way, -ratio.norm().ln() / way)
}

#[test]
fn with_loss_waves_run_and_fade_as_the_dispersion_relation_says() {
    let rubber = rubber(2.0, 1e-3);
    for omega_tau in [0.3, 1.0, 4.0] {
        let omega = omega_tau / 1e-3;
        let exact = Wave::at(&rubber, omega);
        let error = |cells| {
            let found = measured(rubber, omega, cells);
            let number = found.re / exact.number_rad_m - 1.0;
            let fade = found.im / exact.attenuation_np_m - 1.0;
            number.abs().max(fade.abs())
        };
        let (coarse, fine) = (error(500), error(2000));
        // What is left is the reading, with its rest of a period, not the rod.
        assert!(coarse < 1e-2 && fine < 1e-3, "{omega_tau}: {coarse:e} {fine:e}");
    }
}

#[test]
fn its_error_is_of_second_order_in_the_step() {
    // A smooth blow, seen at the hub after two returns, on grids each twice as fine.
    let seen = |cells: usize| {
        let mut rod = Rod::new(rubber(3.0, 1e-4), 8e-3, cells, 0.9).unwrap();
        let transit = rod.step_s() * cells as f64;
        for step in 0..=5 * cells {
            let t = rod.step_s() * step as f64 / transit;
            rod.step(Face::Pressure((-4.0 * (t - 2.0).powi(2)).exp()));
        }
        rod.hub_pa()
    };
    let [a, b, c, d] = [32, 64, 128, 256].map(seen);
    for ratio in [(a - b) / (b - c), (b - c) / (c - d)] {
        assert!((3.5..4.5).contains(&ratio), "{ratio}");
    }
}

#[test]
fn a_slow_squeeze_finds_the_relaxed_spring() {
    let rubber = rubber(4.0, 1e-4);
    let mut rod = Rod::new(rubber, 8e-3, 20, 0.9).unwrap();
    for _ in 0..200_000 {
        rod.step(Face::Pressure(5e4));
    }
    assert!((rod.strain[10] / (5e4 / 4.8e6) - 1.0).abs() < 1e-9, "{}", rod.strain[10]);
}

#[test]
fn impossible_rods_are_refused() {
    let good = rubber(2.0, 1e-3);
    assert!(Rod::new(good, 0.0, 10, 0.0).is_err());
    assert!(Rod::new(good, 1.0, 1, 0.0).is_err());
    let error = Rod::new(good, 1.0, 10, 1.1).unwrap_err();
    assert_eq!(error.to_string(), "hub is 1.1, expected -1 to 1");
}

proptest! {
    #[test]
    fn no_rod_gives_more_than_it_was_given(
        stiffening in 1.0..20.0_f64, tau in -6.0..0.0_f64, hub in -1.0..=1.0_f64,
        blows in prop::collection::vec((-1.0..1.0_f64, any::<bool>()), 1..200),
    ) {
        let mut rod = Rod::new(rubber(stiffening, 10_f64.powf(tau)), 8e-3, 16, hub).unwrap();
        let mut work = 0.0;
        let mut most = 0.0_f64;
        for (value, pressed) in blows {
            rod.step(if pressed { Face::Pressure(1e4 * value) } else { Face::Speed(0.1 * value) });
            work += rod.face_pa() * rod.face_m_s() * rod.step_s();
            most = most.max(rod.energy_j_m2());
            prop_assert!(rod.energy_j_m2() <= work + 1e-12 * most, "{}", rod.energy_j_m2());
        }
    }

    #[test]
    fn nothing_arrives_before_the_front(
        stiffening in 1.0..20.0_f64, tau in -6.0..0.0_f64,
        blows in prop::collection::vec(-1.0..1.0_f64, 16),
    ) {
        let mut rod = Rod::new(rubber(stiffening, 10_f64.powf(tau)), 8e-3, 16, 1.0).unwrap();
        for (step, value) in blows.into_iter().enumerate() {
            rod.step(Face::Pressure(value));
            for cell in step + 1..16 {
                prop_assert_eq!(rod.pressure_pa(cell), 0.0);
            }
        }
        prop_assert_eq!(rod.hub_pa(), 0.0);
    }

    #[test]
    fn pulses_fade_by_pi_over_nothing_but_the_loss(hub in 0.0..=1.0_f64) {
        // Elastic, nothing driven: each return keeps the hub's part of a pulse.
        let mut rod = Rod::new(rubber(1.0, 1.0), 8e-3, 10, hub).unwrap();
        rod.step(Face::Pressure(PI));
        for _ in 0..20 {
            rod.step(Face::Pressure(0.0));
        }
        prop_assert!((rod.pressure_pa(0) + hub * PI).abs() < 1e-12);
    }
}
