//! Hereditary contact against Lee's and Radok's, and Ting's, closed forms.

use std::f64::consts::{FRAC_PI_4, PI};

use proptest::prelude::*;

use super::super::hereditary::{Indentation, Indenter};
use crate::reference::solid::{Memory, Solid};

const CONE: Indenter = Indenter::Cone { slope_rad: FRAC_PI_4 };
const CYLINDER: Indenter = Indenter::Cylinder { radius_m: 0.025, width_m: 0.028 };

fn solid() -> Solid {
    Solid::of_relaxation(4.8e6, 20.3e6, 0.1059).unwrap()
}

#[track_caller]
fn assert_close(found: f64, wanted: f64, relative: f64) {
    let error = (found / wanted - 1.0).abs();
    assert!(error <= relative, "{found} against {wanted}: {error:e}");
}

#[test]
fn a_ramp_gives_lees_and_radoks_closed_forms() {
    let (s, v) = (solid(), 2.7e-3);
    let tau = s.relaxation_time_s();
    // Cut unevenly, which must not show.
    let course: Vec<(f64, f64)> =
        [1e-4, 0.013, 0.2, 0.21, 0.7].map(|t| (t, v * t)).into_iter().collect();
    let cone = Indentation::new(CONE, s, &course).unwrap();
    let cylinder = Indentation::new(CYLINDER, s, &course).unwrap();
    for t in [2e-3, 0.05, 0.2, 0.33, 0.7] {
        let fall = -(-t / tau).exp_m1();
        let square = s.relaxed() * t * t + 2.0 * s.excess() * tau * (t - tau * fall);
        assert_close(cone.force_n(t), 2.0 / PI * v * v * square, 1e-12);
        let line = s.relaxed() * t + s.excess() * tau * fall;
        assert_close(cylinder.force_n(t), 0.25 * PI * 0.028 * v * line, 1e-12);
    }
}

#[test]
fn a_quick_push_held_relaxes_as_the_solid() {
    let s = solid();
    let depth = 1e-3;
    let held = Indentation::new(CONE, s, &[(1e-9, depth), (2.0, depth)]).unwrap();
    for t in [0.01, 0.1, 1.0] {
        assert_close(held.force_n(t), 2.0 / PI * depth * depth * s.relaxation(t), 1e-7);
        assert_close(held.contact_m(t), 2.0 / PI * depth, 1e-12);
    }
}

#[test]
fn a_triangle_is_tings_closed_form() {
    // In at v until t_m, out at v: Phi(t - t_1) = 2 Phi(t - t_m), Phi the integral of E_r.
    let (s, v, peak) = (solid(), 2.7e-3, 0.3);
    let tau = s.relaxation_time_s();
    let triangle = Indentation::new(CONE, s, &[(peak, v * peak), (2.0 * peak, 0.0)]).unwrap();
    let phi = |t: f64| s.relaxed() * t - s.excess() * tau * (-t / tau).exp_m1();
    let mut ended = 0;
    for step in 1..60 {
        let t = peak + 0.005 * f64::from(step);
        let target = 2.0 * phi(t - peak);
        let Some(turn) = triangle.contact_time_s(t) else {
            assert!(target >= phi(t) * (1.0 - 1e-12), "ended too early at {t}");
            assert_eq!((triangle.force_n(t), triangle.contact_m(t)), (0.0, 0.0));
            ended += 1;
            continue;
        };
        assert_close(phi(t - turn), target, 1e-11);
        let kept = (-t / tau).exp()
            * (tau * turn * (turn / tau).exp() - tau * tau * (turn / tau).exp_m1());
        let law = s.relaxed() * turn * turn + 2.0 * s.excess() * kept;
        assert_close(triangle.force_n(t), 2.0 / PI * v * v * law, 1e-10);
        assert_close(triangle.contact_m(t), 2.0 / PI * v * turn, 1e-12);
    }
    // The tread cannot follow: it is left before the indenter is back.
    assert!(ended > 3, "{ended}");
}

#[test]
fn without_memory_it_is_sneddons_cone_and_hertzs_line() {
    let s = Solid::of_relaxation(5e6, 5e6, 0.1).unwrap();
    let course = [(0.2, 1e-3), (0.3, 1e-3), (0.6, 0.0)];
    let cone = Indentation::new(CONE, s, &course).unwrap();
    let cylinder = Indentation::new(CYLINDER, s, &course).unwrap();
    for t in [0.05, 0.2, 0.25, 0.4, 0.55] {
        let depth = cone.depth_m(t);
        assert_close(cone.force_n(t), 2.0 / PI * 5e6 * depth * depth, 1e-12);
        // a^2 = 4 F R/(pi L E*).
        let force = cylinder.force_n(t);
        assert_close(
            cylinder.contact_m(t).powi(2),
            4.0 * force * 0.025 / (PI * 0.028 * 5e6),
            1e-12,
        );
    }
}

#[test]
fn a_cylinder_going_in_is_the_solid_itself() {
    let s = solid();
    let mut memory = Memory::new(s);
    let course = [(0.1, 2e-4), (0.15, 7e-4), (0.4, 8e-4)];
    let line = Indentation::new(CYLINDER, s, &course).unwrap();
    let mut last = 0.0;
    for (t, depth) in course {
        memory.strain_to(depth, t - last);
        last = t;
        assert_close(line.force_n(t), 0.25 * PI * 0.028 * memory.stress(), 1e-12);
    }
}

#[test]
fn impossible_courses_are_refused() {
    let s = solid();
    let new = |indenter, course: &[(f64, f64)]| Indentation::new(indenter, s, course);
    assert!(new(CONE, &[(0.1, 1e-3), (0.1, 2e-3)]).is_err());
    assert!(new(CONE, &[(0.1, -1e-3)]).is_err());
    let error = new(CONE, &[(0.1, 1e-3), (0.2, 0.0), (0.3, 1e-3)]).unwrap_err();
    assert_eq!(error.to_string(), "depth_m is 0.001, expected rising once, then falling");
    assert!(new(Indenter::Cone { slope_rad: 0.5 * PI }, &[(0.1, 1e-3)]).is_err());
    assert!(new(Indenter::Cylinder { radius_m: 0.0, width_m: 1.0 }, &[(0.1, 1e-3)]).is_err());
}

proptest! {
    #[test]
    fn what_comes_out_is_at_most_what_went_in(
        stiffening in 1.0..20.0_f64, tau in -3.0..1.0_f64, hold in 1e-3..1.0_f64,
        out in 1e-2..2.0_f64, cone in any::<bool>(),
    ) {
        let s = Solid::of_relaxation(5e6, 5e6 * stiffening, 10_f64.powf(tau)).unwrap();
        let end = 0.2 + hold + out;
        let course = [(0.2, 1e-3), (0.2 + hold, 1e-3), (end, 0.0)];
        let contact = Indentation::new(if cone { CONE } else { CYLINDER }, s, &course).unwrap();
        let count = 2000;
        let (mut work, mut scale) = (0.0, 0.0_f64);
        let mut radius = 0.0;
        for step in 1..=count {
            let [a, b] = [step - 1, step].map(|i| end * f64::from(i) / f64::from(count));
            let mean = contact.force_n(0.5 * (a + b));
            prop_assert!(mean >= 0.0);
            work += mean * (contact.depth_m(b) - contact.depth_m(a));
            scale = scale.max(mean * 1e-3);
            // The contact grows, then shrinks.
            let now = contact.contact_m(b);
            let grows = now >= radius || a >= 0.2;
            let shrinks = now <= radius * (1.0 + 1e-9) || a < 0.2;
            prop_assert!(grows && shrinks, "{} after {} at {}", now, radius, b);
            radius = now;
        }
        prop_assert!(work >= -1e-3 * scale, "{work} of {scale}");
    }

    #[test]
    fn force_grows_with_speed_and_lies_between_the_elastic_limits(
        time in 1e-4..10.0_f64, factor in 1.1..5.0_f64, depth in 1e-5..1e-3_f64,
    ) {
        let s = solid();
        for indenter in [CONE, CYLINDER] {
            let force = |t: f64| Indentation::new(indenter, s, &[(t, depth)]).unwrap().force_n(t);
            let law = indenter.factor() * depth.powi(indenter.exponent());
            let (quick, slow) = (force(time), force(factor * time));
            prop_assert!(quick > slow);
            prop_assert!(slow > law * s.relaxed() && quick < law * s.instant());
        }
    }
}
