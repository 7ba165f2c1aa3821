//! The ring against its closed form without memory, its limits, and what inertia adds.

mod hereditary;
mod hunt_crossley;

use interstage::rig::Rig;
use proptest::prelude::*;

use super::dynamic::Mass;
use super::elastic::{Elastic, rigid_climb_n};
use super::*;
use crate::plant::ring::{Motion, Ring};
use crate::plant::wall::Wall;
use crate::reference::Resolution;

/// The study's wheel with a tread that does not relax.
fn without_memory(speed_mm_s: f64, preload_n: f64) -> (Case, Elastic) {
    let mut rig = Rig::fe();
    rig.tread.stiffening = 1.0;
    let case = Case::new(rig, speed_mm_s, preload_n);
    let ring = case.ring();
    let elastic = Elastic {
        radius_mm: ring.radius_mm,
        width_mm: ring.width_mm,
        stiffness: ring.k_inf,
        step_height_mm: case.step_height_mm,
    };
    (case, elastic)
}

fn coarse(case: Case) -> Case {
    let resolution = Resolution { elements: 1440, stride_mm: 0.02, step_s: 4e-4 };
    Case { resolution, ..case }
}

#[test]
fn without_memory_the_ring_is_its_closed_form() {
    for preload in [40.0, 100.0, 150.0] {
        let (case, elastic) = without_memory(5.0, preload);
        let crossing = quasi_static(&case).unwrap();
        let lift = crossing.lift.unwrap();
        let gap = elastic.gap_mm(preload).unwrap();
        assert!((lift.gap_mm / gap - 1.0).abs() < 2e-3, "{} {gap}", lift.gap_mm);
        let peak = crossing.peak_n();
        let mut worst = (0.0_f64, 0.0_f64);
        for sample in crossing.samples.iter().filter(|s| s.x_mm < -0.1).step_by(10) {
            let height = elastic.height_mm(sample.x_mm, preload);
            let forces = elastic.forces(sample.x_mm, height);
            worst.0 = worst.0.max((sample.y_mm - height).abs());
            worst.1 = worst.1.max((sample.axial_n - forces.axial_n).abs() / peak);
        }
        assert!(worst.0 < 2e-3 && worst.1 < 2e-3, "{worst:?}");
    }
}

#[test]
fn finer_rings_come_closer_to_the_closed_form() {
    let (case, elastic) = without_memory(5.0, 100.0);
    let gap = elastic.gap_mm(100.0).unwrap();
    let error = |elements: usize| {
        let resolution = Resolution { elements, stride_mm: 14.4 / elements as f64, step_s: 1e-4 };
        let crossing = quasi_static(&Case { resolution, ..case.clone() }).unwrap();
        (crossing.lift.unwrap().gap_mm / gap - 1.0).abs()
    };
    let (few, more, many) = (error(720), error(1440), error(5760));
    assert!(few < 1e-2 && more < 5e-3 && many < 1e-3 && many < 0.5 * few, "{few} {more} {many}");
}

#[test]
fn the_two_resolutions_are_converged() {
    let at = |elements: usize| {
        let resolution = Resolution { elements, stride_mm: 28.8 / elements as f64, step_s: 1e-4 };
        let crossing = quasi_static(&Case { resolution, ..Case::study()[0].clone() }).unwrap();
        (crossing.lift.unwrap().gap_mm, crossing.peak_n())
    };
    let (rough, fine, finest) = (at(2880), at(5760), at(11520));
    for (rough, fine, finest) in [(rough.0, fine.0, finest.0), (rough.1, fine.1, finest.1)] {
        assert!((rough / finest - 1.0).abs() < 1e-3, "{rough} {finest}");
        assert!((fine / finest - 1.0).abs() < 2e-4, "{fine} {finest}");
    }
    assert_eq!(28.8 / 5760.0, Resolution::FIGURE.stride_mm);
}

#[test]
fn the_closed_form_climbs_with_the_work_of_lifting_the_preload() {
    let (_, elastic) = without_memory(5.0, 100.0);
    // From before the touch to over the edge: the path does not matter, only its ends,
    // so the last piece, where the edge lies under the patch, is what is missing of it.
    let count = 40_000;
    let from = -15.9;
    let h = -from / f64::from(count);
    let force = |i: i32| {
        let x = from + h * (f64::from(i) + 0.5);
        elastic.forces(x, elastic.height_mm(x, 100.0)).axial_n
    };
    let work: f64 = (0..count).map(|i| force(i) * h).sum();
    let crossing = quasi_static(&without_memory(5.0, 100.0).0).unwrap();
    let after: f64 = crossing
        .samples
        .windows(2)
        .filter(|pair| pair[0].x_mm >= 0.0)
        .map(|p| 0.5 * (p[0].axial_n + p[1].axial_n) * (p[1].x_mm - p[0].x_mm))
        .sum();
    assert!(((work + after) / 400.0 - 1.0).abs() < 2e-3, "{work} {after}");
    assert!((crossing.work_mj() / 400.0 - 1.0).abs() < 2e-3, "{}", crossing.work_mj());
}

#[test]
fn a_stiff_tread_climbs_as_a_rigid_wheel() {
    let (case, mut elastic) = without_memory(5.0, 100.0);
    let rigid = rigid_climb_n(100.0, case.climb_angle());
    assert!((rigid - 64.6).abs() < 0.05);
    let mut last = f64::INFINITY;
    for stiffness in [1.0, 1e1, 1e2, 1e3, 1e4] {
        elastic.stiffness = stiffness;
        let lift_x = -((elastic.gap_mm(100.0).unwrap() + 25.0).powi(2) - 625.0).sqrt();
        let short = rigid - elastic.forces(lift_x, 25.0).axial_n;
        assert!(short > 0.0 && short < last, "{short}");
        last = short;
    }
    assert!(last < 0.02 * rigid, "{last}");
}

#[test]
fn gaps_and_first_force_of_the_study() {
    // The three gaps are what the tread is fitted to; the force is not.
    for (speed, preload, gap) in [(5.0, 100.0, 1.743), (5.0, 120.0, 1.562), (8.0, 100.0, 1.902)] {
        let crossing = quasi_static(&Case::new(Rig::fe(), speed, preload)).unwrap();
        assert!((crossing.lift.unwrap().gap_mm / gap - 1.0).abs() < 6e-3);
        if (speed, preload) == (5.0, 100.0) {
            assert!((crossing.peak_n() - 53.6).abs() < 0.4, "{}", crossing.peak_n());
        }
    }
}

#[test]
fn slow_and_light_the_dynamic_form_is_the_quasi_static_one() {
    let mut case = coarse(Case::new(Rig::fe(), 5.0, 100.0));
    case.rig.plant.moved_mass_kg = 1e-3;
    let (still, moving) = (quasi_static(&case).unwrap(), dynamic(&case).unwrap());
    let (a, b) = (still.lift.unwrap().gap_mm, moving.lift.unwrap().gap_mm);
    assert!((a / b - 1.0).abs() < 3e-3, "{a} {b}");
    assert!((still.peak_n() / moving.peak_n() - 1.0).abs() < 1e-2);
}

#[test]
fn inertia_is_small_at_millimetres_per_second_and_grows_with_speed() {
    // The radial force less the preload is what accelerates. As the edge passes under
    // the centre, elements lose their hold one by one, which shakes the wheel by part of
    // an element's force, the less the finer the ring: left out.
    let excess = |speed: f64| {
        let case = coarse(Case::new(Rig::fe(), speed, 100.0));
        let crossing = dynamic(&case).unwrap();
        let climbing = crossing.samples.iter().filter(|s| s.x_mm < -0.1);
        let most = climbing.map(|s| (s.radial_n - 100.0).abs()).fold(0.0, f64::max);
        (most, crossing.lift.map(|lift| lift.gap_mm))
    };
    let (slow, medium, fast) = (excess(3.0).0, excess(8.0).0, excess(200.0).0);
    assert!(slow < 1.3 && medium < 1.3, "{slow} {medium}");
    assert!(slow < medium && medium < fast && fast > 10.0, "{slow} {medium} {fast}");
}

#[test]
fn a_wheel_at_rest_rings_on_its_tread_at_the_frequency_of_a_mass_on_the_solid() {
    // A small blow on a wheel that has settled: m s^2 + K(s) = 0 with
    // K = K_inf + (K_0 - K_inf) s tau/(1 + s tau), a cubic in s.
    let mut case = Case::new(Rig::fe(), 5.0, 100.0);
    case.rig.tread.tau_s = 2e-3;
    let (ring_of, way) = (case.ring(), Wall::default());
    let mut ring = Ring::new(ring_of);
    let at = |y: f64, dt_s: f64| Motion { wall: way.local(0.0), height_mm: y, turn_rad: 0.0, dt_s };
    let balance = crate::plant::balance::Balance {
        preload_n: 100.0,
        spring_n_per_mm: 0.0,
        axial: crate::plant::balance::Axial::Pushed,
    };
    let rest = balance.solve(&ring, at(24.5, 10.0)).unwrap();
    ring.commit(&at(rest.height_mm, 10.0));
    let rest = balance.solve(&ring, at(rest.height_mm, 10.0)).unwrap();
    ring.commit(&at(rest.height_mm, 10.0));
    let k_inf = -1e3 * rest.contact.slope.0;
    let (k_0, tau, m) = (k_inf * 4.2235, 2e-3, 3.0);
    let mut mass = Mass::on(&case, rest.height_mm);
    mass.rate_mm_s = 0.02;
    let dt = 2e-5;
    // The cubic m tau s^3 + m s^2 + K_0 tau s + K_inf: its state (u, v, f).
    let (mut u, mut v, mut q) = (0.0_f64, 0.02_f64, 0.0_f64);
    let mut worst = 0.0_f64;
    let mut largest = 0.0_f64;
    for _ in 0..2000 {
        let motion = at(mass.y_mm, dt);
        mass.step(&ring, motion);
        ring.commit(&Motion { height_mm: mass.y_mm, ..motion });
        // The same linear system, finely.
        for _ in 0..20 {
            let h = dt / 20.0;
            let rate = |u: f64, v: f64, q: f64| {
                (v, -(k_inf * u + (k_0 - k_inf) * (u - q)) / m, (u - q) / tau)
            };
            let a = rate(u, v, q);
            let b = rate(u + 0.5 * h * a.0, v + 0.5 * h * a.1, q + 0.5 * h * a.2);
            (u, v, q) = (u + h * b.0, v + h * b.1, q + h * b.2);
        }
        worst = worst.max((mass.y_mm - rest.height_mm - u).abs());
        largest = largest.max(u.abs());
    }
    assert!(worst < 0.02 * largest, "{worst:e} of {largest:e}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn closed_form_forces_fall_as_the_wheel_rises_and_only_push(
        x in -16.0..-0.05_f64, y in 20.0..25.2_f64, lift in 1e-4..0.5_f64,
    ) {
        let (_, elastic) = without_memory(5.0, 100.0);
        let (low, high) = (elastic.forces(x, y), elastic.forces(x, y + lift));
        prop_assert!(high.radial_n() <= low.radial_n() + 1e-9);
        prop_assert!(high.floor_n >= -1e-9 && high.step_n >= -1e-9);
    }

    #[test]
    fn closed_form_forces_are_the_sums_over_rays(x in -16.0..-0.05_f64, y in 22.0..25.2_f64) {
        let (_, elastic) = without_memory(5.0, 100.0);
        let wall = crate::plant::wall::Wall::new(vec![crate::plant::wall::Step {
            position_mm: 0.0, height_mm: 4.0,
        }]).local(x);
        let (mut radial, mut axial) = (0.0, 0.0);
        let count = 200_000;
        let h = 2.4 / f64::from(count);
        for i in 0..count {
            let psi = -1.2 + h * (f64::from(i) + 0.5);
            let depth = 25.0 - wall.ray(y, psi.sin(), psi.cos()).0;
            if depth > 0.0 {
                radial += depth * psi.cos();
                axial += depth * psi.sin();
            }
        }
        let scale = 0.6044 * 25.0 * 28.0 * h;
        let forces = elastic.forces(x, y);
        prop_assert!((forces.radial_n() - scale * radial).abs() < 1e-6 * (1.0 + radial));
        prop_assert!((forces.axial_n - scale * axial).abs() < 1e-6 * (1.0 + radial));
    }

    #[test]
    fn the_elastic_gap_falls_with_preload_and_is_one_function_of_preload_over_stiffness(
        preload in 5.0..150.0_f64, factor in 1.05..3.0_f64,
    ) {
        let (_, elastic) = without_memory(5.0, 100.0);
        let gap = elastic.gap_mm(preload).unwrap();
        prop_assert!(elastic.gap_mm(factor * preload).is_none_or(|more| more < gap));
        let stiffer = Elastic { stiffness: factor * elastic.stiffness, ..elastic };
        let same = stiffer.gap_mm(factor * preload).unwrap();
        prop_assert!((same / gap - 1.0).abs() < 1e-9);
    }
}
