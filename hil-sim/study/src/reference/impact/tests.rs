//! The rod against d'Alembert, against the dispersion relation, and its energy.

use std::f64::consts::{LN_10, TAU};

use nalgebra::Complex;
use proptest::prelude::*;

use super::*;
use crate::reference::ReferenceCase;
use crate::reference::rubber::THICKNESS_MM;

/// Long-term modulus and density of material sheets.
fn rubber(stiffening: f64, tau_s: f64) -> Rubber {
    let (relaxed_pa, instant_pa) = (4.8e6, 4.8e6 * stiffening);
    Rubber { relaxed_pa, instant_pa, tau_s, density_kg_m3: 1140.0 }
}

/// The rubber of the sheets with this largest loss tangent at this frequency, Hz:
/// `tan delta = (s - 1)/(2 sqrt s)` at `omega p_1 = 1/sqrt s`, s = E_2/q_0.
fn of_sheets(loss_tangent: f64, at_hz: f64) -> Rubber {
    let root = loss_tangent + loss_tangent.hypot(1.0);
    rubber(root * root, 1.0 / (TAU * at_hz * root))
}

/// Speed of a slow wave, m/s: `sqrt(q_0/rho)`.
fn slow_m_s(rubber: Rubber) -> f64 {
    (rubber.relaxed_pa / rubber.density_kg_m3).sqrt()
}

/// One step; the inward speed of the face in it, m/s.
fn step_for_speed(rod: &mut Rod, face_pa: f64) -> f64 {
    rod.relax();
    let leaving = rod.outward[0];
    rod.carry(face_pa);
    rod.relax();
    (face_pa - 2.0 * leaving) / rod.rubber.impedance()
}

/// Inward speed of a cell, m/s: (P - Q)/Z of (35).
fn speed_m_s(rod: &Rod, cell: usize) -> f64 {
    (rod.inward[cell] - rod.outward[cell]) / rod.rubber.impedance()
}

/// Energy in the rod, J/m^2: of motion and of the springs.
fn energy_j_m2(rod: &Rod) -> f64 {
    let Rubber { relaxed_pa, instant_pa, density_kg_m3, .. } = rod.rubber;
    let excess = instant_pa - relaxed_pa;
    let cells = (0..rod.strain.len()).map(|cell| {
        let strain = rod.strain[cell];
        // What the relaxing branch bears; none in an elastic solid.
        let borne = rod.pressure_pa(cell) - relaxed_pa * strain;
        let delayed = if excess > 0.0 { borne * borne / excess } else { 0.0 };
        let moving = density_kg_m3 * speed_m_s(rod, cell).powi(2);
        0.5 * (moving + relaxed_pa * strain * strain + delayed)
    });
    rod.dt_s * rod.rubber.front_speed_m_s() * cells.sum::<f64>()
}

#[test]
fn without_loss_a_pulse_is_dalemberts_there_and_back() {
    let cells = 50;
    let mut rod = Rod::new(rubber(1.0, 1.0), 8e-3, cells, 0.6);
    // Pressure pulse of some shape on the face; P of (36) is it, delayed.
    let pulse = |step: i64| if (0..30).contains(&step) { (0.2 * step as f64).sin() } else { 0.0 };
    let n = cells as i64;
    for step in 0..160_i64 {
        rod.step(pulse(step));
        // The free face inverts what comes back; twice round at most in this time.
        let inward = |at: i64| pulse(at) - 0.6 * pulse(at - 2 * n) + 0.36 * pulse(at - 4 * n);
        for cell in 0..cells {
            let at = cell as i64;
            let (p, q) = (inward(step - at), 0.6 * inward(step - 2 * n + 1 + at));
            assert!((rod.pressure_pa(cell) - (p + q)).abs() < 1e-12, "{step} {cell}");
            let speed = speed_m_s(&rod, cell) * rod.rubber.impedance();
            assert!((speed - (p - q)).abs() < 1e-12, "{step} {cell}");
        }
    }
}

#[test]
fn a_held_pressure_reaches_the_hub_in_one_transit_and_settles_there() {
    // Impedance of the hub three times that of the rubber: the ringing dies down.
    let mut rod = Rod::new(rubber(1.0, 1.0), 8e-3, 40, 0.5);
    for step in 0..4000 {
        rod.step(1e3);
        if step < 40 {
            assert_eq!(rod.hub_pa(), 0.0);
        } else if step == 40 {
            assert!((rod.hub_pa() - 1.5e3).abs() < 1e-9);
        }
    }
    assert!((rod.hub_pa() - 1e3).abs() < 1e-6);
}

/// Wave number and attenuation of a wave at omega, `k - i alpha`, 1/m (R. M. Christensen,
/// "Theory of Viscoelasticity", 2nd ed., section 2.2), in place of (40).
fn dispersion(rubber: Rubber, omega: f64) -> Complex<f64> {
    let Rubber { relaxed_pa, instant_pa, tau_s, density_kg_m3 } = rubber;
    let numerator = Complex::new(1.0, omega * tau_s) * density_kg_m3;
    (numerator / Complex::new(relaxed_pa, omega * tau_s * instant_pa)).sqrt() * omega
}

/// Wave number and attenuation that a long rod shows at omega, from two cells.
fn measured(rubber: Rubber, omega: f64, cells: usize) -> Complex<f64> {
    // Ten waves long: what the far end sends back has faded when it arrives.
    let length = 10.0 * TAU / dispersion(rubber, omega).re;
    let mut rod = Rod::new(rubber, length, cells, 0.0);
    let (a, b) = (cells / 20, cells / 10);
    let period = TAU / omega;
    // Long enough for the transient to fade, then one period of correlation.
    let settle = (3.0 * length / slow_m_s(rubber) + 30.0 * rubber.tau_s).max(4.0 * period);
    let mut t = 0.0;
    while t < settle {
        t += rod.step_s();
        rod.step((omega * t).sin());
    }
    let count = (period / rod.step_s()).round();
    let mut sums = [Complex::new(0.0, 0.0); 2];
    for index in 0..count as usize {
        t += rod.step_s();
        rod.step((omega * t).sin());
        // A window that forgives the rest of a period.
        let window = 1.0 - (TAU * index as f64 / count).cos();
        let phase = Complex::from_polar(window, -omega * t);
        for (sum, cell) in sums.iter_mut().zip([a, b]) {
            *sum += phase * rod.pressure_pa(cell);
        }
    }
    let distance = (b - a) as f64 * rod.step_s() * rubber.front_speed_m_s();
    let ratio = sums[1] / sums[0];
    // Half a wave on: the phase is within a quarter turn of -pi.
    let phase = ratio.arg().rem_euclid(TAU) - TAU;
    Complex::new(-phase / distance, -ratio.norm().ln() / distance)
}

#[test]
fn the_tread_is_crossed_in_a_tenth_of_a_millisecond_and_next_to_nothing_is_lost() {
    // No wave fades as fast as the front, the limit of short ones.
    let loss_db = |rubber| -dispersion(rubber, 1e9).im * 20.0 / LN_10 * THICKNESS_MM * 1e-3;
    for (loss, hz) in [(0.1, 10.0), (0.1, 100.0), (0.25, 10.0), (0.25, 100.0)] {
        let rubber = of_sheets(loss, hz);
        for speed in [slow_m_s(rubber), rubber.front_speed_m_s()] {
            let transit_ms = THICKNESS_MM / speed;
            assert!((0.08..0.15).contains(&transit_ms), "{transit_ms}");
        }
        let loss = loss_db(rubber);
        assert!(loss > 0.0 && loss < 0.16, "{loss} dB");
    }
    // The fitted tread stiffens more, so its front is faster.
    let fitted = Rubber::of(&ReferenceCase::first());
    assert!((THICKNESS_MM / slow_m_s(fitted) - 0.1228).abs() < 1e-4);
    assert!((THICKNESS_MM / fitted.front_speed_m_s() - 0.0598).abs() < 1e-4);
    assert!(loss_db(fitted) < 0.002);
}

#[test]
fn the_sheets_loss_is_met_at_its_frequency() {
    let rubber = of_sheets(0.25, 100.0);
    let tangent = |omega: f64| {
        let modulus = (omega / dispersion(rubber, omega)).powi(2) * rubber.density_kg_m3;
        modulus.im / modulus.re
    };
    let peak = TAU * 100.0;
    assert!((tangent(peak) - 0.25).abs() < 1e-12);
    assert!(tangent(0.9 * peak) < 0.25 && tangent(1.1 * peak) < 0.25);
}

#[test]
fn with_loss_waves_run_and_fade_as_the_dispersion_relation_says() {
    let rubber = rubber(2.0, 1e-3);
    for omega_tau in [0.3, 1.0, 4.0] {
        let omega = omega_tau / 1e-3;
        let exact = dispersion(rubber, omega);
        let error = |cells| {
            let found = measured(rubber, omega, cells);
            (found.re / exact.re - 1.0).abs().max((found.im / -exact.im - 1.0).abs())
        };
        let (coarse, fine) = (error(500), error(2000));
        // What is left is the reading, with its rest of a period, not the rod.
        assert!(coarse < 1e-2 && fine < 1e-3, "{omega_tau}: {coarse:e} {fine:e}");
    }
}

#[test]
fn its_error_is_of_second_order_in_the_step() {
    // A smooth blow, observed at the hub after two returns, on grids each twice as fine.
    let at_hub = |cells: usize| {
        let mut rod = Rod::new(rubber(3.0, 1e-4), 8e-3, cells, 0.9);
        let transit = rod.step_s() * cells as f64;
        for step in 0..=5 * cells {
            let t = rod.step_s() * step as f64 / transit;
            rod.step((-4.0 * (t - 2.0).powi(2)).exp());
        }
        rod.hub_pa()
    };
    let [a, b, c, d] = [32, 64, 128, 256].map(at_hub);
    for ratio in [(a - b) / (b - c), (b - c) / (c - d)] {
        assert!((3.5..4.5).contains(&ratio), "{ratio}");
    }
}

#[test]
fn a_slow_squeeze_finds_the_relaxed_spring() {
    let mut rod = Rod::new(rubber(4.0, 1e-4), 8e-3, 20, 0.9);
    for _ in 0..200_000 {
        rod.step(5e4);
    }
    assert!((rod.strain[10] / (5e4 / 4.8e6) - 1.0).abs() < 1e-9, "{}", rod.strain[10]);
}

proptest! {
    #[test]
    fn no_rod_gives_more_than_it_was_given(
        stiffening in 1.0..20.0_f64, tau in -6.0..0.0_f64, hub in -1.0..=1.0_f64,
        blows in prop::collection::vec(-1.0..1.0_f64, 1..200),
    ) {
        let mut rod = Rod::new(rubber(stiffening, 10_f64.powf(tau)), 8e-3, 16, hub);
        let mut work = 0.0;
        let mut most = 0.0_f64;
        for value in blows {
            let face_pa = 1e4 * value;
            work += face_pa * step_for_speed(&mut rod, face_pa) * rod.step_s();
            most = most.max(energy_j_m2(&rod));
            prop_assert!(energy_j_m2(&rod) <= work + 1e-12 * most, "{}", energy_j_m2(&rod));
        }
    }

    #[test]
    fn nothing_arrives_before_the_front(
        stiffening in 1.0..20.0_f64, tau in -6.0..0.0_f64,
        blows in prop::collection::vec(-1.0..1.0_f64, 16),
    ) {
        let mut rod = Rod::new(rubber(stiffening, 10_f64.powf(tau)), 8e-3, 16, 1.0);
        for (step, value) in blows.into_iter().enumerate() {
            rod.step(value);
            for cell in step + 1..16 {
                prop_assert_eq!(rod.pressure_pa(cell), 0.0);
            }
        }
        prop_assert_eq!(rod.hub_pa(), 0.0);
    }
}
