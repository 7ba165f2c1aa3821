//! Hunt and Crossley's impact against its first integral and its limits.

use proptest::prelude::*;

use super::super::hunt_crossley::HuntCrossley;

#[test]
fn the_impact_over_time_keeps_the_first_integral() {
    for (chi, exponent) in [(0.0, 1.0), (0.5, 2.0), (20.0, 2.0), (3.0, 1.5)] {
        let law = HuntCrossley::new(4e6, exponent, chi).unwrap();
        let course = law.impact(3.0, 0.3, 20_000).unwrap();
        let peak = course.iter().map(|now| now.depth_m).fold(0.0, f64::max);
        assert!((peak / law.peak_depth_m(3.0, 0.3) - 1.0).abs() < 1e-6, "{peak}");
        let left = -course.last().unwrap().speed_m_s;
        assert!((left / law.rebound_m_s(0.3) - 1.0).abs() < 1e-6, "{left}");
    }
}

#[test]
fn without_loss_it_is_a_spring() {
    let law = HuntCrossley::new(3e5, 1.0, 0.0).unwrap();
    assert_eq!(law.rebound_m_s(0.2), 0.2);
    let omega = (3e5_f64 / 3.0).sqrt();
    assert!((law.peak_depth_m(3.0, 0.2) * omega / 0.2 - 1.0).abs() < 1e-12);
    let course = law.impact(3.0, 0.2, 4000).unwrap();
    let end = course.last().unwrap();
    let half = std::f64::consts::PI / omega;
    assert!((end.t_s - half).abs() < 2.0 * half / 2000.0, "{} {half}", end.t_s);
}

#[test]
fn little_loss_takes_two_thirds_of_chi_v_from_the_rebound() {
    let law = HuntCrossley::new(1e6, 2.0, 0.1).unwrap();
    for speed in [1e-4, 1e-3, 1e-2] {
        let lost = 1.0 - law.rebound_m_s(speed) / speed;
        assert!((lost / (2.0 / 3.0 * 0.1 * speed) - 1.0).abs() < 2e-3, "{lost:e}");
    }
}

#[test]
fn the_velocity_factor_as_printed_is_no_force() {
    // (14) has V alone as a factor: at rest nothing would carry the preload.
    let law = HuntCrossley::new(1e6, 2.0, 0.1).unwrap();
    assert_eq!(law.force_n(1e-3, 0.0), 1.0);
    assert!(law.force_n(1e-3, 5e-3) < 1.001);
}

#[test]
fn what_is_no_contact_is_refused() {
    assert!(HuntCrossley::new(0.0, 2.0, 0.1).is_err());
    assert!(HuntCrossley::new(1.0, 0.5, 0.1).is_err());
    assert!(HuntCrossley::new(1.0, 2.0, -0.1).is_err());
    let law = HuntCrossley::new(1.0, 2.0, 0.1).unwrap();
    assert!(law.impact(0.0, 1.0, 100).is_err() && law.impact(1.0, 1.0, 3).is_err());
}

proptest! {
    #[test]
    fn it_only_pushes_and_never_gives_energy(
        chi in 0.0..100.0_f64, exponent in 1.0..3.0_f64, speed in 1e-4..10.0_f64,
        depth in -1e-3..1e-2_f64, rate in -10.0..10.0_f64,
    ) {
        let law = HuntCrossley::new(1e6, exponent, chi).unwrap();
        prop_assert!(law.force_n(depth, rate) >= 0.0);
        let left = law.rebound_m_s(speed);
        prop_assert!(left >= 0.0 && left <= speed);
        prop_assert!(chi * left <= 1.0 + 1e-12);
        // More arrives, more leaves; less of it.
        let more = law.rebound_m_s(1.3 * speed);
        prop_assert!(more >= left && more <= 1.3 * left * (1.0 + 1e-9));
        prop_assert!(law.peak_depth_m(2.0, speed) > law.peak_depth_m(1.0, speed));
    }
}
