//! The solid against its closed forms, its limits, and what no passive solid may do.

use std::f64::consts::PI;

use proptest::prelude::*;

use super::*;

/// The study's springs and damper in round numbers.
fn solid() -> Solid {
    Solid::of_parts(6.2e6, 20.4e6, 2.8e6).unwrap()
}

#[track_caller]
fn assert_close(found: f64, wanted: f64, relative: f64) {
    let error = (found - wanted).abs() / wanted.abs().max(f64::MIN_POSITIVE);
    assert!(error <= relative, "{found} against {wanted}: {error:e}, allowed {relative:e}");
}

#[test]
fn parts_and_coefficients_are_those_of_the_study() {
    let (e_1, e_2, c_1) = (6.2e6, 20.4e6, 2.8e6);
    let solid = solid();
    assert_close(solid.relaxed(), e_1 * e_2 / (e_1 + e_2), 1e-15);
    assert_close(solid.relaxation_time_s(), c_1 / (e_1 + e_2), 1e-15);
    assert_close(solid.q_1(), c_1 * e_2 / (e_1 + e_2), 1e-15);
    assert_close(solid.retardation_time_s(), c_1 / e_1, 1e-14);
    assert_close(solid.e_1(), e_1, 1e-14);
    assert_eq!(solid.instant(), e_2);
}

#[test]
fn creep_and_relaxation_are_their_closed_forms() {
    let (e_1, e_2, c_1): (f64, f64, f64) = (6.2e6, 20.4e6, 2.8e6);
    let solid = solid();
    for step in 0..200 {
        let t = 1e-6 * 1.1_f64.powi(step);
        assert_close(solid.creep(t), 1.0 / e_2 + (1.0 - (-e_1 * t / c_1).exp()) / e_1, 1e-12);
        let p_1 = c_1 / (e_1 + e_2);
        let fallen = e_2 * e_2 / (e_1 + e_2) * (1.0 - (-t / p_1).exp());
        assert_close(solid.relaxation(t), e_2 - fallen, 1e-12);
    }
    assert_eq!((solid.creep(-1e-9), solid.relaxation(-1e-9)), (0.0, 0.0));
}

#[test]
fn creep_and_relaxation_convolve_to_time() {
    // Their transforms multiply to 1/s^2, so J * E = t, which holds for no other pair.
    let solid = solid();
    for t in [0.01, 0.1, 0.4, 2.0] {
        let count = 20_000;
        let h = t / f64::from(count);
        let inner = |i: i32| solid.creep(h * f64::from(i)) * solid.relaxation(t - h * f64::from(i));
        let odd: f64 = (1..count).step_by(2).map(inner).sum();
        let even: f64 = (2..count).step_by(2).map(inner).sum();
        assert_close((inner(0) + inner(count) + 4.0 * odd + 2.0 * even) * h / 3.0, t, 1e-12);
    }
}

#[test]
fn complex_modulus_is_the_quotient_and_its_loss_peaks_where_it_should() {
    let solid = solid();
    let [p_1, q_0, q_1] = [solid.relaxation_time_s(), solid.relaxed(), solid.q_1()];
    for step in -60..60 {
        let omega = 10_f64.powf(0.1 * f64::from(step));
        let wanted = Complex::new(q_0, omega * q_1) / Complex::new(1.0, omega * p_1);
        assert_close(
            (solid.complex_modulus(omega) - wanted).norm() / wanted.norm() + 1.0,
            1.0,
            1e-12,
        );
    }
    assert_eq!(solid.complex_modulus(0.0), Complex::new(q_0, 0.0));
    let s = solid.instant() / q_0;
    let peak = 1.0 / (s.sqrt() * p_1);
    assert_close(solid.loss_tangent(peak), (s - 1.0) / (2.0 * s.sqrt()), 1e-12);
    assert!(solid.loss_tangent(0.9 * peak) < solid.loss_tangent(peak));
    assert!(solid.loss_tangent(1.1 * peak) < solid.loss_tangent(peak));
}

#[test]
fn a_jump_and_a_hold_relax_and_creep_as_the_closed_forms() {
    let solid = solid();
    let (mut strained, mut stressed) = (Memory::new(solid), Memory::new(solid));
    assert_close(strained.strain_to(0.01, 0.0), 0.01 * solid.instant(), 1e-15);
    assert_close(stressed.stress_to(3e4, 0.0), 3e4 / solid.instant(), 1e-15);
    let mut t = 0.0;
    for step in 0..400 {
        // Steps of all sizes, from far below the time constants to far above.
        let dt = 1e-7 * 10_f64.powi(step % 7);
        t += dt;
        assert_close(strained.strain_to(0.01, dt), 0.01 * solid.relaxation(t), 1e-12);
        assert_close(stressed.stress_to(3e4, dt), 3e4 * solid.creep(t), 1e-12);
    }
}

#[test]
fn a_ramp_follows_its_closed_form_however_it_is_cut() {
    let solid = solid();
    let tau = solid.relaxation_time_s();
    for cuts in [1, 7, 1000, 10_000] {
        let mut memory = Memory::new(solid);
        let dt = 0.25 / f64::from(cuts);
        for step in 1..=cuts {
            memory.strain_to(0.4 * dt * f64::from(step), dt);
        }
        let wanted = 0.4 * (solid.relaxed() * 0.25 - solid.excess() * tau * (-0.25 / tau).exp_m1());
        assert_close(memory.stress(), wanted, 1e-12);
    }
}

#[test]
fn an_oscillation_settles_to_the_complex_modulus() {
    let solid = solid();
    let omega = 4.0;
    let count = 200_000;
    let dt = 60.0 * PI / omega / f64::from(count);
    let mut memory = Memory::new(solid);
    let mut worst = 0.0_f64;
    for step in 1..=count {
        let t = dt * f64::from(step);
        let stress = memory.strain_to((omega * t).sin(), dt);
        if step > count / 2 {
            let modulus = solid.complex_modulus(omega);
            let wanted = modulus.re * (omega * t).sin() + modulus.im * (omega * t).cos();
            worst = worst.max((stress - wanted).abs() / modulus.norm());
        }
    }
    // The sine is cut into straight pieces: (omega dt)^2 / 8 of it is missing.
    assert!(worst < (omega * dt).powi(2), "{worst:e}");
}

#[test]
fn an_elastic_solid_remembers_nothing() {
    let elastic = Solid::of_relaxation(5e6, 5e6, 0.1).unwrap();
    assert!(elastic.e_1().is_infinite());
    assert_eq!(elastic.loss_tangent(3.0), 0.0);
    let mut memory = Memory::new(elastic);
    memory.strain_to(0.3, 0.02);
    assert_eq!(memory.strain_to(0.1, 0.01), 5e5);
    assert_eq!(elastic.creep(0.0), elastic.creep(9.0));
}

#[test]
fn what_is_not_passive_is_refused() {
    for (wanted, result) in [
        ("relaxed", Solid::of_relaxation(0.0, 1.0, 1.0)),
        ("instant", Solid::of_relaxation(2.0, 1.0, 1.0)),
        ("instant", Solid::of_relaxation(2.0, f64::NAN, 1.0)),
        ("tau_s", Solid::of_relaxation(1.0, 2.0, 0.0)),
        ("c_1", Solid::of_parts(1.0, 2.0, f64::INFINITY)),
        ("e_1", Solid::of_parts(-1.0, 2.0, 1.0)),
    ] {
        assert!(result.unwrap_err().to_string().starts_with(wanted));
    }
}

/// Any passive solid, and a history of strains with the times between them.
fn histories() -> impl Strategy<Value = (Solid, Vec<(f64, f64)>)> {
    let solid = (-3.0..9.0_f64, 0.0..2.0_f64, -4.0..2.0_f64).prop_map(|(e, s, tau)| {
        let relaxed = 10_f64.powf(e);
        Solid::of_relaxation(relaxed, relaxed * 10_f64.powf(s), 10_f64.powf(tau)).unwrap()
    });
    let piece = (-1.0..1.0_f64, -5.0..3.0_f64).prop_map(|(x, t)| (x, 10_f64.powf(t)));
    (solid, prop::collection::vec(piece, 1..40))
}

proptest! {
    #[test]
    fn no_history_gets_more_out_than_was_put_in((solid, pieces) in histories()) {
        let mut memory = Memory::new(solid);
        let mut work = 0.0;
        let mut scale = 0.0_f64;
        for (strain, dt) in pieces {
            let (strain_0, stress_0) = (memory.strain(), memory.stress());
            memory.strain_to(strain, dt);
            // The law itself, integrated over the piece, gives the mean stress exactly.
            let impulse = solid.relaxed() * 0.5 * (strain + strain_0) * dt
                + solid.q_1() * (strain - strain_0)
                - solid.relaxation_time_s() * (memory.stress() - stress_0);
            work += (strain - strain_0) / dt * impulse;
            scale = scale.max(solid.instant() * (1.0 + solid.relaxation_time_s() / dt));
            prop_assert!(memory.energy() <= work + 1e-11 * scale, "{} of {work}", memory.energy());
        }
    }

    #[test]
    fn strain_and_stress_histories_undo_each_other((solid, pieces) in histories()) {
        // What runs linearly in strain does not in stress, so jumps and holds.
        let (mut strained, mut stressed) = (Memory::new(solid), Memory::new(solid));
        for (stress, dt) in pieces {
            let stress = stress * solid.relaxed();
            stressed.stress_to(stress, 0.0);
            strained.strain_to(stressed.strain(), 0.0);
            prop_assert!((strained.stress() - stress).abs() <= 1e-6 * solid.instant());
            for _ in 0..2000 {
                let hold = (1e-3 * solid.relaxation_time_s()).min(dt / 2000.0);
                stressed.stress_to(stress, hold);
                strained.strain_to(stressed.strain(), hold);
            }
            prop_assert!((strained.stress() - stress).abs() <= 1e-6 * solid.instant());
        }
    }

    #[test]
    fn creep_rises_and_relaxation_falls_within_their_limits(
        (solid, pieces) in histories(),
    ) {
        let mut t = 0.0;
        let (mut creep, mut modulus) = (solid.creep(0.0), solid.relaxation(0.0));
        for (_, dt) in pieces {
            t += dt;
            let (next_creep, next_modulus) = (solid.creep(t), solid.relaxation(t));
            prop_assert!(next_creep >= creep && next_creep <= (1.0 + 1e-15) / solid.relaxed());
            prop_assert!(next_modulus <= modulus && next_modulus >= solid.relaxed());
            // J E <= 1: stress held creeps more than the relaxed modulus accounts for.
            prop_assert!(next_creep * next_modulus <= 1.0 + 1e-12);
            (creep, modulus) = (next_creep, next_modulus);
        }
    }

    #[test]
    fn responses_add_up(
        (solid, pieces) in histories(),
        (_, others) in histories(),
        factor in -3.0..3.0_f64,
    ) {
        let [mut one, mut two, mut sum] = [Memory::new(solid); 3];
        for (&(a, dt), &(b, _)) in pieces.iter().zip(&others) {
            let apart = one.strain_to(a, dt) + factor * two.strain_to(b, dt);
            let together = sum.strain_to(a + factor * b, dt);
            prop_assert!((together - apart).abs() <= 1e-12 * solid.instant());
        }
    }
}
