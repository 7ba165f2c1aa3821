//! The arm against statics, the published mode and the cantilever's receptance.

use proptest::prelude::*;

use super::*;

fn arm() -> Arm {
    Arm::of(&Rig::fe()).unwrap()
}

/// Tip receptance of a cantilever with a mass, m/N (Bishop and Johnson), for complex `E I`:
/// `L^3/(EI) (sin cosh - cos sinh)/(l^3 (1 + cos cosh))`.
fn cantilever(arm: &Arm, hz: f64) -> Complex<f64> {
    let (beam, omega) = (arm.beam, TAU * hz);
    let ei = Complex::new(1.0, arm.loss_factor) * beam.bending_stiffness_n_m2();
    let per_length = beam.mass_kg() / beam.length_m;
    let l = (Complex::from(omega * omega * per_length) / ei).powf(0.25) * beam.length_m;
    let bare = (l.sin() * l.cosh() - l.cos() * l.sinh())
        / (l.powi(3) * (Complex::from(1.0) + l.cos() * l.cosh()))
        * beam.length_m.powi(3)
        / ei;
    bare / (bare * (-arm.tip.mass_kg * omega * omega) + 1.0)
}

#[test]
fn tip_response_is_the_cantilevers_receptance() {
    for loss_factor in [0.0, 0.02, 0.3] {
        let arm = Arm { loss_factor, ..arm() };
        for hz in [20.0, 150.0, 260.0, 290.0, 600.0] {
            let found = arm.receptance_m_per_n(hz).unwrap();
            let wanted = cantilever(&arm, hz);
            let error = (found - wanted).norm() / wanted.norm();
            assert!(error < 1e-6, "{hz} Hz, loss {loss_factor}: {error:e}");
        }
    }
}

#[test]
fn it_settles_to_the_static_deflection() {
    let arm = arm();
    let mut modal = arm.modal(4).unwrap();
    modal.step(50.0, 1e-6);
    for _ in 0..200 {
        modal.step(50.0, 0.1);
    }
    let wanted = 50.0 * arm.beam.length_m.powi(3) / (3.0 * 244.6875);
    assert!((modal.deflection_m() / wanted - 1.0).abs() < 1e-9);
}

#[test]
fn a_sine_is_followed_as_its_straight_pieces_get_short() {
    let arm = Arm { loss_factor: 0.1, ..arm() };
    let mut modal = arm.modal(1).unwrap();
    let (omega, dt) = (TAU * 200.0, 2e-5);
    let own = TAU * 276.0;
    let gain = arm.shapes(1).unwrap()[0].tip().powi(2);
    let rest = arm.compliance_m_per_n() - gain / own.powi(2);
    let mut worst = 0.0_f64;
    for step in 1..=20_000 {
        let t = dt * f64::from(step);
        modal.step((omega * t).sin(), dt);
        if step > 15_000 {
            let (a, b) = (own * own - omega * omega, 0.1 * own * omega);
            let wanted = gain * (a * (omega * t).sin() - b * (omega * t).cos()) / (a * a + b * b);
            worst = worst.max((modal.deflection_m() - wanted - rest * (omega * t).sin()).abs());
        }
    }
    // (omega dt)^2/12 of the force is lost with the corners; 2.1 is the resonance.
    let lost = (omega * dt).powi(2) / 12.0;
    assert!(worst < 2.2 * lost * gain / own.powi(2), "{worst:e}");
}

proptest! {
    #[test]
    fn no_tip_mass_brings_the_free_arm_below_the_clamped_one(exponent in -3.0..4.0_f64) {
        let beam = Beam::drive_arm();
        let tip = Tip { mass_kg: beam.mass_kg() * 10_f64.powf(exponent), spring_n_per_m: 0.0 };
        let first = |ends| beam.modes(ends, tip, 1).unwrap()[0].frequency_hz;
        prop_assert!(first(Ends::FreeFree) > first(Ends::ClampedFree));
        prop_assert!(first(Ends::PinnedFree) > first(Ends::ClampedFree));
    }

    #[test]
    fn the_cut_into_pieces_does_not_matter(
        forces in prop::collection::vec(-100.0..100.0_f64, 1..12), cuts in 2..9_u32,
    ) {
        let [mut uncut, mut cut] = [arm().modal(5).unwrap(), arm().modal(5).unwrap()];
        let mut last = 0.0;
        for force in forces {
            uncut.step(force, 3e-3);
            for piece in 1..=cuts {
                let part = f64::from(piece) / f64::from(cuts);
                cut.step(last + part * (force - last), 3e-3 / f64::from(cuts));
            }
            last = force;
            prop_assert!((uncut.deflection_m() - cut.deflection_m()).abs() < 1e-12);
        }
    }

    #[test]
    fn left_alone_it_only_calms_down(force in 1.0..100.0_f64, dt in 1e-5..1e-1_f64) {
        let mut modal = arm().modal(1).unwrap();
        modal.step(force, 1e-3);
        modal.step(0.0, 1e-6);
        let energy = |modal: &Modal| {
            let o = modal.oscillators[0];
            (o.omega * o.state.0).powi(2) + o.state.1.powi(2)
        };
        let mut last = energy(&modal);
        for _ in 0..50 {
            modal.step(0.0, dt);
            prop_assert!(energy(&modal) <= last);
            last = energy(&modal);
        }
    }
}
