//! The ring against its closed form without memory, its limits, and what inertia adds.

use interstage::rig::Rig;
use proptest::prelude::*;

use super::dynamic::Mass;
use super::elastic::{Elastic, rigid_climb_n};
use super::*;
use crate::reference::{Case, Resolution};
use hil_sim::plant::balance::{Axial, Balance};
use hil_sim::plant::ring::{Motion, Ring};
use hil_sim::plant::wall::Wall;

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
        let case = Case { resolution: Resolution::FIGURE, ..case };
        let crossing = quasi_static(&case).unwrap();
        let lift = crossing.lift.unwrap();
        let gap = elastic.gap_mm(preload).unwrap();
        assert!((lift.gap_mm / gap - 1.0).abs() < 5e-5, "{} {gap}", lift.gap_mm);
        let peak = crossing.peak_n();
        let mut worst = (0.0_f64, 0.0_f64);
        for sample in crossing.samples.iter().filter(|s| s.x_mm < -1.0).step_by(10) {
            let height = elastic.height_mm(sample.x_mm, preload);
            let forces = elastic.forces(sample.x_mm, height);
            worst.0 = worst.0.max((sample.y_mm - height).abs());
            worst.1 = worst.1.max((sample.axial_n - forces.axial_n).abs() / peak);
        }
        assert!(worst.0 < 5e-4 && worst.1 < 5e-4, "{worst:?}");
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
    assert!(few < 2e-3 && more < 5e-4 && many < 5e-5, "{few} {more} {many}");
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
    // From before the touch to the face; the rest, where the edge passes under the patch,
    // from the ring. Short of P h by what the rays lean from the wall's normal.
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
    for work in [work + after, crossing.work_mj()] {
        assert!((0.999..1.0).contains(&(work / 400.0)), "{work}");
    }
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

/// A wheel that has settled on the level wall with this relaxation time, its ring, and
/// the relaxed stiffness it stands on, N/m.
fn settled(tau_s: f64) -> (Mass, Ring, f64) {
    let mut case = Case::study()[0].clone();
    case.rig.tread.tau_s = tau_s;
    let mut ring = Ring::new(case.ring());
    let balance = Balance {
        preload_n: case.preload_n,
        spring_n_per_mm: 0.0,
        arm_n: 0.0,
        axial: Axial::Pushed,
    };
    let (mut height, mut stiffness) = (24.5, 0.0);
    for _ in 0..3 {
        let rest = balance.solve(&mut ring, level(height, 1e4 * tau_s)).unwrap();
        (height, stiffness) = (rest.height_mm, -1e3 * rest.contact.slope.0);
        ring.commit(&level(height, 1e4 * tau_s));
    }
    (Mass::on(&case, height), ring, stiffness)
}

/// On the level wall, without rolling.
fn level(height_mm: f64, dt_s: f64) -> Motion {
    Motion { wall: Wall::default().local(0.0), height_mm, turn_rad: 0.0, dt_s }
}

/// Heights above rest over `time_s` after a blow so small that no element comes or goes.
fn ringing(tau_s: f64, blow_mm_s: f64, dt_s: f64, time_s: f64) -> Vec<f64> {
    let (mut mass, mut ring, _) = settled(tau_s);
    let rest = mass.y_mm;
    mass.rate_mm_s = blow_mm_s;
    let steps = (time_s / dt_s).round() as usize;
    let heights = (0..steps).map(|_| {
        let motion = level(mass.y_mm, dt_s);
        mass.step(&mut ring, motion);
        ring.commit(&Motion { height_mm: mass.y_mm, ..motion });
        mass.y_mm - rest
    });
    heights.collect()
}

#[test]
fn a_wheel_at_rest_rings_on_its_tread_at_the_frequency_of_a_mass_on_the_solid() {
    // m s^2 + K(s) = 0 with K = K_inf + (K_0 - K_inf) s tau/(1 + s tau): three exponentials,
    // the roots of m tau s^3 + m s^2 + K_0 tau s + K_inf, from the blow v:
    // u = v sum of (tau s + 1) m e^{s t}/(derivative of the cubic at s).
    let tau = 2e-3;
    let (_, _, k_inf) = settled(tau);
    let (k_0, m) = (k_inf * Case::study()[0].rig.tread.stiffening, 3.0);
    let cubic = nalgebra::Matrix3::new(
        -1.0 / tau,
        -k_0 / m,
        -k_inf / (m * tau),
        1.0,
        0.0,
        0.0,
        0.0,
        1.0,
        0.0,
    );
    let roots = cubic.complex_eigenvalues();
    let exact = |t: f64| -> f64 {
        let parts = roots.iter().map(|s| {
            let slope = s * s * (3.0 * m * tau) + s * (2.0 * m) + k_0 * tau;
            ((s * tau + 1.0) * m * (s * t).exp() / slope).re
        });
        1e-4 * parts.sum::<f64>()
    };
    let dt = 2e-5;
    let heights = ringing(tau, 1e-4, dt, 0.04);
    let largest = heights.iter().fold(0.0_f64, |most, u| most.max(u.abs()));
    for (step, u) in heights.iter().enumerate() {
        let wanted = exact(dt * (step + 1) as f64);
        assert!((u - wanted).abs() < 1e-3 * largest, "{step}: {u:e} {wanted:e} of {largest:e}");
    }
}

#[test]
fn the_dynamic_form_is_of_second_order_in_its_step() {
    let end = |dt: f64| *ringing(2e-3, 1e-4, dt, 0.016).last().unwrap();
    let [a, b, c] = [2e-4, 1e-4, 5e-5].map(end);
    let ratio = (a - b) / (b - c);
    assert!((3.5..4.5).contains(&ratio), "{ratio}");
}

#[test]
fn without_memory_a_ringing_wheel_keeps_its_energy() {
    let mut case = Case::study()[0].clone();
    case.rig.tread.stiffening = 1.0;
    let mut ring = Ring::new(case.ring());
    let balance = Balance {
        preload_n: case.preload_n,
        spring_n_per_mm: 0.0,
        arm_n: 0.0,
        axial: Axial::Pushed,
    };
    let rest = balance.solve(&mut ring, level(24.5, 1.0)).unwrap();
    ring.commit(&level(rest.height_mm, 1.0));
    let mut mass = Mass::on(&case, rest.height_mm);
    mass.rate_mm_s = 1e-3;
    // Kinetic, mJ, and that of the contact linearised about rest.
    let energy = |mass: &Mass| {
        let u = mass.y_mm - rest.height_mm;
        0.5 * (3e-3 * mass.rate_mm_s.powi(2) - rest.contact.slope.0 * u * u)
    };
    let first = energy(&mass);
    for _ in 0..20_000 {
        let motion = level(mass.y_mm, 1e-4);
        mass.step(&mut ring, motion);
        ring.commit(&Motion { height_mm: mass.y_mm, ..motion });
    }
    assert!((energy(&mass) / first - 1.0).abs() < 1e-2, "{}", energy(&mass) / first);
}

#[test]
fn memory_costs_work_and_a_driven_wheel_opens_a_wider_gap() {
    let pushed = coarse(Case::study()[0].clone());
    let (free, driven) = (quasi_static(&pushed).unwrap(), quasi_static(&pushed.driven()).unwrap());
    assert!(free.work_mj() > 1.05 * 400.0, "{}", free.work_mj());
    assert!(driven.lift.unwrap().gap_mm > 1.05 * free.lift.unwrap().gap_mm);
    let used = driven.samples.iter().map(|s| s.utilisation).fold(0.0, f64::max);
    // 20 N on this wheel at (5, 100).
    assert!((used - 0.86).abs() < 0.05, "{used}");
    assert!(free.samples.iter().all(|s| s.utilisation == 0.0));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn the_gap_falls_with_preload_and_grows_with_speed(
        speed in 1.0..30.0_f64, preload in 20.0..120.0_f64, factor in 1.15..1.5_f64,
    ) {
        let gap = |speed, preload| {
            let case = coarse(Case::new(Rig::fe(), speed, preload));
            quasi_static(&case).unwrap().lift.unwrap().gap_mm
        };
        let here = gap(speed, preload);
        prop_assert!(gap(speed, factor * preload) < here);
        prop_assert!(gap(factor * speed, preload) > here);
    }
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
        let wall = hil_sim::plant::wall::Wall::new(vec![hil_sim::plant::wall::Step {
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
