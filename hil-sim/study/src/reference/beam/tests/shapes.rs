//! Shapes against the classical ones, their orthogonality, and end conditions.

use super::super::*;
use super::assert_close;

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
    for ends in Ends::ALL {
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

#[test]
fn the_waves_are_real_together_and_bounded_at_every_mode() {
    let arm = Beam::drive_arm();
    for shape in arm.shapes(Ends::ClampedFree, Tip::default(), MAX_COUNT).unwrap() {
        let most = 2.01 / arm.mass_kg().sqrt();
        for step in 0..=400 {
            let deflection = shape.at(arm.length_m * f64::from(step) / 400.0);
            assert!(deflection.abs() <= most, "{deflection}");
        }
        assert_close(shape.at(0.0), 0.0, 1e-10 * most);
    }
}

#[test]
fn a_soft_spring_carries_the_rigid_arm() {
    let arm = Beam::drive_arm();
    let tip = Tip { mass_kg: 0.0, spring_n_per_m: 1.0 };
    let shape = &arm.shapes(Ends::PinnedFree, tip, 1).unwrap()[0];
    // Turning about its pivot: W = sqrt(3/m) x/L.
    let wanted = (3.0 / arm.mass_kg()).sqrt();
    for part in [0.25, 0.5, 1.0] {
        assert_close(shape.at(part * arm.length_m) / (wanted * part), 1.0, 1e-5);
    }
}
