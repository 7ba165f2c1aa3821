//! The forced response against the cantilever's receptance, statics, reciprocity,
//! passivity.

use nalgebra::Complex;
use proptest::prelude::*;

use super::super::*;
use super::{assert_close, ratio};

/// Tip receptance of a cantilever, m/N (Bishop and Johnson), for any complex `E I`:
/// `L^3/(EI) (sin cosh - cos sinh)/(l^3 (1 + cos cosh))`, with a mass and a spring there.
fn cantilever(arm: &Beam, tip: Tip, hz: f64, loss: f64) -> Complex<f64> {
    let omega = 2.0 * PI * hz;
    let ei = Complex::new(1.0, loss) * arm.bending_stiffness_n_m2();
    let per_length = arm.mass_kg() / arm.length_m;
    let l = (Complex::from(omega * omega * per_length) / ei).powf(0.25) * arm.length_m;
    let bare = (l.sin() * l.cosh() - l.cos() * l.sinh())
        / (l.powi(3) * (Complex::from(1.0) + l.cos() * l.cosh()))
        * arm.length_m.powi(3)
        / ei;
    let load = tip.spring_n_per_m - tip.mass_kg * omega * omega;
    bare / (bare * load + 1.0)
}

fn at_tip(arm: &Beam, tip: Tip, hz: f64, loss: f64) -> Complex<f64> {
    let forcing = Forcing { at_m: arm.length_m, frequency_hz: hz, loss_factor: loss };
    arm.receptance(Ends::ClampedFree, tip, forcing, arm.length_m).unwrap()
}

#[test]
fn tip_response_is_the_cantilevers_receptance() {
    let arm = Beam::drive_arm();
    for tip in [Tip::default(), Tip { mass_kg: 0.062_857, spring_n_per_m: 3e5 }] {
        for loss in [0.0, 0.02, 0.3] {
            for step in 0..120 {
                let hz = 5.0 * 1.09_f64.powi(step);
                let (found, wanted) =
                    (at_tip(&arm, tip, hz, loss), cantilever(&arm, tip, hz, loss));
                let error = (found - wanted).norm() / wanted.norm();
                // Towards no frequency l^4 is what is left of numbers of order one.
                let l = (hz / 588.548).sqrt() * 1.875;
                assert!(error < 1e-9 + 1e-14 / l.powi(4), "{hz} Hz, loss {loss}: {error:e}");
            }
        }
    }
}

#[test]
fn slow_forces_bend_the_arm_as_still_ones_do() {
    let arm = Beam::drive_arm();
    let ei = arm.bending_stiffness_n_m2();
    for (at, seen) in [(1.0, 1.0), (0.6, 1.0), (0.6, 0.3), (0.4, 0.4)] {
        let (a, x) = (at * arm.length_m, seen * arm.length_m);
        let (short, long) = (f64::min(a, x), f64::max(a, x));
        let wanted = short * short * (3.0 * long - short) / (6.0 * ei);
        let forcing = Forcing { at_m: a, frequency_hz: 2.0, loss_factor: 0.0 };
        let found = arm.receptance(Ends::ClampedFree, Tip::default(), forcing, x).unwrap();
        // (2 Hz/588 Hz)^2 of inertia.
        assert_close(found.re / wanted, 1.0, 3e-5);
    }
}

#[test]
fn a_long_lossy_beam_answers_as_one_without_end() {
    // F/(4 EI k^3) (-1 - i): from (51) alone, nothing coming back.
    let beam = Beam { length_m: 20.0, ..Beam::drive_arm() };
    let forcing = Forcing { at_m: 10.0, frequency_hz: 500.0, loss_factor: 0.4 };
    let found = beam.receptance(Ends::FreeFree, Tip::default(), forcing, 10.0).unwrap();
    let ei = Complex::new(1.0, 0.4) * beam.bending_stiffness_n_m2();
    let per_length = beam.mass_kg() / beam.length_m;
    let k = (Complex::from((2.0 * PI * 500.0).powi(2) * per_length) / ei).powf(0.25);
    let wanted = Complex::new(-1.0, -1.0) / (ei * k.powi(3) * 4.0);
    assert!((found / wanted - 1.0).norm() < 1e-6, "{found} {wanted}");
}

#[test]
fn resonances_stand_at_the_natural_frequencies() {
    let arm = Beam::drive_arm();
    let tip = Tip { mass_kg: 0.062_857, spring_n_per_m: 0.0 };
    for mode in arm.modes(Ends::ClampedFree, tip, 4).unwrap() {
        let response = |part: f64| at_tip(&arm, tip, part * mode.frequency_hz, 1e-4).norm();
        assert!(response(1.0) > 100.0 * response(0.97) && response(1.0) > 100.0 * response(1.03));
    }
}

#[test]
fn places_and_frequencies_out_of_range_are_named() {
    let arm = Beam::drive_arm();
    let good = Forcing { at_m: 0.1, frequency_hz: 50.0, loss_factor: 0.0 };
    let cases = [
        ("at_m", Forcing { at_m: 0.2, ..good }, 0.1),
        ("seen_m", good, -0.1),
        ("frequency_hz", Forcing { frequency_hz: 0.0, ..good }, 0.1),
        ("loss_factor", Forcing { loss_factor: -0.1, ..good }, 0.1),
    ];
    for (wanted, forcing, seen) in cases {
        let error = arm.receptance(Ends::ClampedFree, Tip::default(), forcing, seen).unwrap_err();
        let BeamError::OutOfRange { argument, .. } = &error else { panic!("{error}") };
        assert_eq!(*argument, wanted);
    }
}

proptest! {
    #[test]
    fn the_response_is_reciprocal_and_takes_power(
        ends in prop::sample::select(Ends::ALL.to_vec()),
        mass in ratio(-3.0, 3.0), spring in ratio(-2.0, 6.0),
        at in 0.02..1.0_f64, seen in 0.02..1.0_f64, hz in 1.5..4.5_f64, loss in 1e-3..0.5_f64,
    ) {
        let arm = Beam::drive_arm();
        let unit = arm.bending_stiffness_n_m2() / arm.length_m.powi(3);
        let tip = Tip { mass_kg: mass * arm.mass_kg(), spring_n_per_m: spring * unit };
        let response = |at: f64, seen: f64| {
            let forcing = Forcing {
                at_m: at * arm.length_m, frequency_hz: 10_f64.powf(hz), loss_factor: loss,
            };
            arm.receptance(ends, tip, forcing, seen * arm.length_m).unwrap()
        };
        let (there, back, own) = (response(at, seen), response(seen, at), response(at, at));
        prop_assert!((there - back).norm() <= 1e-7 * own.norm().max(there.norm()), "{there} {back}");
        // e^{i omega t}: power in is -omega Im(W)/2, which only losses take.
        prop_assert!(own.im < 1e-9 * own.norm(), "{own}");
    }
}
