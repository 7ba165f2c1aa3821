//! Junctions: power, limits, and the arm cut in two.

use nalgebra::Complex;
use proptest::prelude::*;

use super::super::junction::Junction;
use super::super::waves::{End, Transfer, propagation};
use super::super::*;
use super::assert_close;

#[test]
fn no_discontinuity_lets_everything_through() {
    let through = Junction::NONE.forwards();
    assert_close(through.reflection.norm(), 0.0, 1e-15);
    assert_close((through.transmission - Transfer::identity()).norm(), 0.0, 1e-15);
}

#[test]
fn an_immovable_support_reflects_as_a_pin_between_two_beams() {
    let pinned = Junction { deflection_load: 1e12, ..Junction::NONE }.forwards();
    // Deflection is none on both sides: the waves that pass cancel each other.
    for column in 0..2 {
        let passed = pinned.transmission[(0, column)] + pinned.transmission[(1, column)];
        assert_close(passed.norm(), 0.0, 1e-11);
    }
    // With the slope held as well, it is a clamp and nothing passes.
    let clamped = Junction { deflection_load: 1e12, slope_load: 1e12, ..Junction::NONE }.forwards();
    assert_close(clamped.transmission.norm(), 0.0, 1e-11);
    assert_close((clamped.reflection - End::Clamped.reflection()).norm(), 0.0, 1e-11);
}

#[test]
fn a_vanishing_section_is_a_free_end_and_a_massive_one_a_clamp() {
    let onto = |ratio: f64| Junction::of_sections((1.0, ratio), (1.0, ratio)).forwards();
    assert_close((onto(1e-13).reflection - End::Free.reflection()).norm(), 0.0, 1e-11);
    assert_close((onto(1e13).reflection - End::Clamped.reflection()).norm(), 0.0, 1e-11);
}

#[test]
fn a_point_load_scatters_as_the_force_it_exerts() {
    // (50, 51) with Q = -(K - m omega^2) W and no moment, W = [1 1] (xi^+ + q), solved by
    // hand: q = g/(1 + z (1 + i)/4) [i, 1]^T [1 1] xi^+, g = z/4, R = q and T = I + q.
    let i = Complex::<f64>::i();
    let one = Complex::from(1.0);
    for load in [-3.0, 0.2, 5.0] {
        let found = Junction { deflection_load: load, ..Junction::NONE }.forwards();
        let g = 0.25 * load;
        let q = Transfer::new(i, i, one, one) * (Complex::from(g) / (one - (i + 1.0) * g));
        assert_close((found.reflection - q).norm(), 0.0, 1e-14);
        assert_close((found.transmission - q - Transfer::identity()).norm(), 0.0, 1e-14);
    }
}

#[test]
fn an_arm_with_a_mass_along_it_has_the_roots_of_its_coupled_receptance() {
    let arm = Beam::drive_arm();
    let (part, mass_kg) = (0.55, 0.04);
    let at_m = part * arm.length_m;
    // 1 = m omega^2 alpha(x, x) of the bare arm.
    let coupled = |hz: f64| {
        let forcing = Forcing { at_m, frequency_hz: hz, loss_factor: 0.0 };
        let own = arm.receptance(Ends::ClampedFree, Tip::default(), forcing, at_m).unwrap();
        1.0 - mass_kg * (2.0 * PI * hz).powi(2) * own.re
    };
    let (mut low, mut high) = (300.0, 588.0);
    assert!(coupled(low) > 0.0 && coupled(high) < 0.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if coupled(middle) > 0.0 { low = middle } else { high = middle }
    }
    let beta_l = (low / arm.frequency_scale_hz()).sqrt();
    let load = -mass_kg / arm.mass_kg() * beta_l;
    let junction = Junction { deflection_load: load, ..Junction::NONE };
    let determinant = |beta_l: f64| {
        let (near, far) = (propagation(part * beta_l), propagation((1.0 - part) * beta_l));
        let behind = junction.before(&(far * End::Free.reflection() * far));
        (End::Clamped.reflection() * near * behind * near - Transfer::identity()).determinant()
    };
    assert!(determinant(beta_l).norm() < 1e-9, "{}", determinant(beta_l));
    assert!(determinant(1.02 * beta_l).norm() > 1e-2);
}

/// A junction anywhere in its range.
fn junctions() -> impl Strategy<Value = Junction> {
    (-1.0..1.0_f64, -2.0..2.0_f64, -20.0..20.0_f64, -20.0..20.0_f64).prop_map(|(k, s, d, m)| {
        Junction {
            number_ratio: 10_f64.powf(k),
            stiffness_ratio: 10_f64.powf(s),
            deflection_load: d,
            slope_load: m,
        }
    })
}

proptest! {
    #[test]
    fn a_junction_neither_takes_nor_gives_power(junction in junctions()) {
        for (scattering, ratio) in [
            (junction.forwards(), junction.power_ratio()),
            (junction.backwards(), 1.0 / junction.power_ratio()),
        ] {
            let back = scattering.reflection[(0, 0)].norm_sqr();
            let through = ratio * scattering.transmission[(0, 0)].norm_sqr();
            prop_assert!((back + through - 1.0).abs() < 1e-10, "{back} {through}");
        }
        // The same part of the power passes either way.
        let there = junction.forwards().transmission[(0, 0)].norm_sqr() * junction.power_ratio();
        let back = junction.backwards().transmission[(0, 0)].norm_sqr() / junction.power_ratio();
        prop_assert!((there - back).abs() < 1e-10, "{there} {back}");
    }

    #[test]
    fn behind_a_junction_a_lossless_end_returns_all_power(
        junction in junctions(), way in 0.01..20.0_f64,
    ) {
        let f = propagation(way);
        let end = f * End::Free.reflection() * f;
        let seen = junction.before(&end);
        prop_assert!((seen[(0, 0)].norm() - 1.0).abs() < 1e-7, "{}", seen[(0, 0)].norm());
    }

    #[test]
    fn a_cut_through_a_uniform_arm_changes_nothing(part in 0.05..0.95_f64, beta_l in 0.5..30.0_f64) {
        let (near, far) = (propagation(part * beta_l), propagation((1.0 - part) * beta_l));
        let cut = near * Junction::NONE.before(&(far * End::Free.reflection() * far)) * near;
        let whole = propagation(beta_l) * End::Free.reflection() * propagation(beta_l);
        prop_assert!((cut - whole).norm() < 1e-12);
    }
}
