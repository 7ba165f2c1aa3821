//! The wave roots against the classical frequency equations, their limits and ranges.

use clap::ValueEnum;
use proptest::prelude::*;

use super::*;

/// The arm with a tip in beam masses and EI / L^3.
fn roots_of(ends: Ends, mass: f64, spring: f64, count: usize) -> Vec<f64> {
    let arm = Beam::drive_arm();
    let unit = arm.bending_stiffness_n_m2() / arm.length_m.powi(3);
    let tip = Tip { mass_kg: mass * arm.mass_kg(), spring_n_per_m: spring * unit };
    let modes = arm.modes(ends, tip, count).unwrap();
    modes.into_iter().map(|mode| mode.beta_l).collect()
}

#[track_caller]
fn assert_close(found: f64, wanted: f64, tolerance: f64) {
    let error = (found - wanted).abs();
    assert!(error <= tolerance, "{found} is {error:e} from {wanted}, allowed {tolerance:e}");
}

/// The classical frequency equation, from `W'' = 0` and `W''' = z W` at B put into the
/// trigonometric solution, times `e^{-x}`. Near x = 0 its leading terms cancel, so the
/// first two terms of the load that it asks for take over there.
fn classical(ends: Ends, mass: f64, spring: f64, x: f64) -> f64 {
    let (s, c) = x.sin_cos();
    let fall = (-2.0 * x).exp();
    let (one, sinh, cosh) = ((-x).exp(), 0.5 * (1.0 - fall), 0.5 * (1.0 + fall));
    let z = spring / x.powi(3) - mass * x;
    if x < 0.1 {
        return match ends {
            Ends::ClampedFree => z + 3.0 / x.powi(3) * (1.0 - 11.0 / 140.0 * x.powi(4)),
            Ends::PinnedFree => z - x / 3.0 * (1.0 + 2.0 / 315.0 * x.powi(4)),
            Ends::FreeFree => z - x / 4.0 * (1.0 + x.powi(4) / 420.0),
        };
    }
    match ends {
        Ends::ClampedFree => one + c * cosh - z * (c * sinh - s * cosh),
        Ends::PinnedFree => s * cosh - c * sinh - 2.0 * z * s * sinh,
        Ends::FreeFree => one - c * cosh - z * (s * cosh - c * sinh),
    }
}

#[test]
fn bare_ends_have_the_classical_roots() {
    let classical = [
        (Ends::ClampedFree, [1.875_104_068_7, 4.694_091_133_0, 7.854_757_438_2]),
        (Ends::PinnedFree, [3.926_602_312_0, 7.068_582_745_6, 10.210_176_122_8]),
        (Ends::FreeFree, [4.730_040_744_9, 7.853_204_624_1, 10.995_607_838_0]),
    ];
    for (ends, wanted) in classical {
        for (found, wanted) in roots_of(ends, 0.0, 0.0, 3).into_iter().zip(wanted) {
            assert_close(found, wanted, 1e-9);
        }
    }
}

#[test]
fn reflected_waves_meet_the_conditions_of_a_loaded_end() {
    let load = Load::mass_and_spring(0.7, 30.0, 2.3);
    let z = 30.0 / 2.3_f64.powi(3) - 0.7 * 2.3;
    let r = load.reflection();
    let i = nalgebra::Complex::I;
    for column in 0..2 {
        // (propagating, evanescent) arriving and leaving, at the end itself.
        let (a, n) = if column == 0 { (1.0, 0.0) } else { (0.0, 1.0) };
        let (b, m) = (r[(0, column)], r[(1, column)]);
        let deflection = b + m + a + n;
        let moment = -b + m - a + n;
        let shear = -i * b + m + i * a - n;
        assert_close(moment.norm(), 0.0, 1e-14);
        assert_close((shear - deflection * z).norm(), 0.0, 1e-14);
    }
}

#[test]
fn two_roots_at_a_tip_resonance_are_both_found() {
    // Mass and spring cancel at the second root, clamped and pinned: a mode on either side of it.
    let (mass, resonance) = (1e6, 7.068_582_745_f64);
    let roots = roots_of(Ends::ClampedFree, mass, mass * resonance.powi(4), 3);
    assert!(roots[1] < resonance && resonance < roots[2], "{roots:?}");
    assert!(roots[2] - roots[1] < 5e-3, "{roots:?}");
}

/// No load, or one anywhere in its range.
fn ratio(low_exponent: f64, high_exponent: f64) -> impl Strategy<Value = f64> {
    prop_oneof![
        1 => Just(0.0),
        4 => (low_exponent..high_exponent).prop_map(|exponent| 10_f64.powf(exponent)),
    ]
}

proptest! {
    #[test]
    fn roots_are_those_of_the_classical_equation_and_none_is_missed(
        ends in prop::sample::select(Ends::value_variants()),
        mass in ratio(-3.0, 5.99),
        spring in ratio(-5.99, 11.99),
    ) {
        let roots = roots_of(ends, mass, spring, MAX_COUNT);
        let sign = |x| classical(ends, mass, spring, x).signum();
        for &root in &roots {
            let (below, above) = (sign(root * (1.0 - 1e-9)), sign(root * (1.0 + 1e-9)));
            prop_assert!(below != above, "no root of the classical equation at {}", root);
        }
        // Bare rigid motion makes the equation vanish at 0; look from beside it.
        let from = if roots[0] > 0.5 { 0.3 } else { roots[0] };
        let edges = [&[from], roots.as_slice()].concat();
        for pair in edges.windows(2) {
            let (low, high) = (pair[0] * (1.0 + 1e-8), pair[1] * (1.0 - 1e-8));
            if low >= high || (low < 0.1) != (high < 0.1) {
                continue;
            }
            for step in 0..=60 {
                let x = low + (high - low) * f64::from(step) / 60.0;
                prop_assert_eq!(sign(x), sign(high), "a root near {} is missing", x);
            }
        }
    }

    #[test]
    fn tip_mass_for_closes(part in 0.01_f64..1.0) {
        let arm = Beam::drive_arm();
        let bare_hz = first_hz(arm, 0.0);
        let mass_kg = arm.tip_mass_for(part * bare_hz).unwrap();
        prop_assert!((first_hz(arm, mass_kg) / (part * bare_hz) - 1.0).abs() < 1e-10);
    }
}

fn first_hz(arm: Beam, mass_kg: f64) -> f64 {
    let tip = Tip { mass_kg, spring_n_per_m: 0.0 };
    arm.modes(Ends::ClampedFree, tip, 1).unwrap()[0].frequency_hz
}

#[test]
fn drive_arm_has_these_frequencies_and_meets_276_hz_with_this_mass() {
    let deep = Beam::drive_arm();
    assert_close(deep.mass_kg(), 0.072_558, 1e-12);
    assert_close(deep.bending_stiffness_n_m2(), 244.6875, 1e-9);
    // sqrt(EI / rho A) / (2 pi L^2) (beta L)^2 by hand.
    let scale = (244.6875_f64 / 0.5004).sqrt() / (2.0 * PI * 0.145 * 0.145);
    assert_close(first_hz(deep, 0.0), scale * 1.875_104_068_7_f64.powi(2), 1e-6);
    assert_close(first_hz(deep, 0.0), 588.548, 5e-4);
    let mass_kg = deep.tip_mass_for(276.0).unwrap();
    assert_close(mass_kg, 0.062_857, 5e-7);
    assert_close(first_hz(deep, mass_kg), 276.0, 1e-9);
}

#[test]
fn arguments_out_of_range_are_named() {
    let arm = Beam::drive_arm();
    let tip = |mass_kg, spring_n_per_m| Tip { mass_kg, spring_n_per_m };
    let modes = |tip, count| arm.modes(Ends::ClampedFree, tip, count).unwrap_err();
    let cases = [
        ("tip.mass_kg", modes(tip(-0.1, 0.0), 1)),
        ("tip.mass_kg", modes(tip(f64::NAN, 0.0), 1)),
        ("tip.mass_kg", modes(tip(1e9, 0.0), 1)),
        ("tip.spring_n_per_m", modes(tip(0.0, -1.0), 1)),
        ("tip.spring_n_per_m", modes(tip(0.0, f64::INFINITY), 1)),
        ("tip.spring_n_per_m", modes(tip(0.0, 1e-9), 1)),
        ("count", modes(Tip::default(), 0)),
        ("count", modes(Tip::default(), MAX_COUNT + 1)),
        ("frequency_hz", arm.tip_mass_for(1000.0).unwrap_err()),
        ("frequency_hz", arm.tip_mass_for(0.0).unwrap_err()),
        ("frequency_hz", arm.tip_mass_for(f64::NAN).unwrap_err()),
    ];
    for (wanted, error) in cases {
        assert_eq!(error.argument, wanted, "{error}");
    }
    assert_eq!(modes(Tip::default(), 0).to_string(), "count is 0, expected 1 to 20 modes");
}

#[test]
fn bare_cantilever_has_the_classical_shapes() {
    let arm = Beam::drive_arm();
    let shapes = arm.shapes(Ends::ClampedFree, Tip::default(), 6).unwrap();
    // cosh - cos - sigma (sinh - sin) has the norm rho A L and the tip 2.
    let scale = 1.0 / arm.mass_kg().sqrt();
    for (index, shape) in shapes.iter().enumerate() {
        let beta_l = shape.mode.beta_l;
        let (sin, cos) = beta_l.sin_cos();
        let sigma = (beta_l.cosh() + cos) / (beta_l.sinh() + sin);
        let sign = if index % 2 == 0 { 1.0 } else { -1.0 };
        for step in 0..=50 {
            let part = f64::from(step) / 50.0;
            let (s, c) = (beta_l * part).sin_cos();
            let (sinh, cosh) = ((beta_l * part).sinh(), (beta_l * part).cosh());
            let wanted = sign * scale * (cosh - c - sigma * (sinh - s));
            // The classical form cancels cosh against sinh: it is the worse of the two.
            let cancelled = 1e-15 * cosh * scale;
            assert_close(shape.at(part * arm.length_m), wanted, 1e-8 * scale + cancelled);
        }
        assert_close(shape.tip(), 2.0 * scale, 1e-8 * scale);
    }
}

#[test]
fn shapes_of_a_loaded_arm_are_orthogonal_and_of_unit_mass() {
    let arm = Beam::drive_arm();
    for &ends in Ends::value_variants() {
        let tip = Tip { mass_kg: 0.062_857, spring_n_per_m: 3e5 };
        let shapes = arm.shapes(ends, tip, 5).unwrap();
        let count = 20_000;
        let h = arm.length_m / f64::from(count);
        for (i, one) in shapes.iter().enumerate() {
            for (j, two) in shapes.iter().enumerate() {
                let middle = |k: i32| h * (f64::from(k) + 0.5);
                let integral: f64 = (0..count).map(|k| one.at(middle(k)) * two.at(middle(k))).sum();
                let product = arm.mass_kg() / f64::from(count) * integral
                    + tip.mass_kg * one.tip() * two.tip();
                assert_close(product, if i == j { 1.0 } else { 0.0 }, 1e-6);
            }
        }
    }
}
