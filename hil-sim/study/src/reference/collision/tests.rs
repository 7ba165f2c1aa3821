//! The ring against its closed form without memory, its limits, and what inertia adds.
//!
//! With stiffness k per area the sums over floor, face and top are integrals of
//! `(R - distance) cos psi` and `(R - distance) sin psi`, distance being `y/cos psi`,
//! `d/sin psi` and `(y - h)/cos psi`, over the angles at which they are positive.

use hil_sim::plant::ring::RingParameters;
use interstage::rig::Rig;
use proptest::prelude::*;

use super::*;
use crate::reference::beam::bisect;
use crate::reference::case::Resolution;

/// An elastic wheel and a step.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Elastic {
    ring: RingParameters,
    step_height_mm: f64,
}

/// Forces of the wall on the wheel, N.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Forces {
    /// Away from the lower wall.
    radial_n: f64,
    /// Of this by face and top.
    step_n: f64,
    /// Against the motion.
    axial_n: f64,
}

impl Elastic {
    /// Forces with the centre at `(x, y)`, x < 0 before the face, y above the lower wall.
    ///
    /// Equation: with `k R L` taken out, floor `[R sin psi - y psi]`, face
    /// `[R sin psi - d ln sin psi]` and `[-R cos psi - d psi]`, top `[R sin psi - z psi]`
    /// and `[-R cos psi + z ln cos psi]`, z = y - h, d = -x.
    /// Units: mm, N. Range: x in (-R, 0), y in (h, 2R). Error: rounding of the bracketed
    /// differences, 1e-15 `k R^2 L`.
    fn forces(&self, x_mm: f64, y_mm: f64) -> Forces {
        let (r, h) = (self.ring.radius_mm, self.step_height_mm);
        let (d, y, z) = (-x_mm, y_mm, y_mm - h);
        let scale = self.ring.k_inf * r * self.ring.width_mm;
        // Angles at which rays meet root and corner, and at which depth ends.
        let (root, corner) = (d.atan2(y), d.atan2(z));
        let half = |height: f64| (height / r).min(1.0).acos();
        let between = |f: &dyn Fn(f64) -> f64, from: f64, to: f64| {
            if to > from { f(to) - f(from) } else { 0.0 }
        };
        let flat = |height: f64| move |psi: f64| r * psi.sin() - height * psi;
        let floor = between(&flat(y), -half(y), half(y).min(root));
        let floor_axial =
            between(&|psi: f64| -r * psi.cos() + y * psi.cos().ln(), -half(y), half(y).min(root));
        // On the face depth grows with the angle: from sin psi = d/R on.
        let bites = (d / r).min(1.0).asin().max(root);
        let face = between(&|psi: f64| r * psi.sin() - d * psi.sin().ln(), bites, corner);
        let face_axial = between(&|psi: f64| -r * psi.cos() - d * psi, bites, corner);
        let top = between(&flat(z), corner, half(z));
        let top_axial = between(&|psi: f64| -r * psi.cos() + z * psi.cos().ln(), corner, half(z));
        Forces {
            radial_n: scale * (floor + face + top),
            step_n: scale * (face + top),
            axial_n: scale * (floor_axial + face_axial + top_axial),
        }
    }

    /// Height of the centre, mm, at which the contact carries `preload_n` at `x_mm`.
    ///
    /// Bisection to the last bit: the force falls steadily as the centre rises.
    fn height_mm(&self, x_mm: f64, preload_n: f64) -> f64 {
        let (low, high) = (self.step_height_mm, 2.0 * self.ring.radius_mm);
        bisect(low, high, 1.0, |y| preload_n - self.forces(x_mm, y).radial_n)
    }

    /// The gap, mm: at lift-off the centre is at y = R, so that
    /// `step_n(x, R) = P` gives x and `sqrt(x^2 + R^2) - R` the gap. None if even with
    /// the face under the centre the step does not carry the preload.
    fn gap_mm(&self, preload_n: f64) -> Option<f64> {
        let r = self.ring.radius_mm;
        let carried = |x: f64| self.forces(x, r).step_n;
        // At x = 0 the floor ahead is gone and the quarter ahead of the top carries.
        let nearest = -1e-9 * r;
        if carried(nearest) < preload_n {
            return None;
        }
        let x = bisect(-r, nearest, 1.0, |x| carried(x) - preload_n);
        Some(x.hypot(r) - r)
    }
}

/// The study's wheel with a tread that does not relax.
fn without_memory(speed_mm_s: f64, preload_n: f64) -> (ReferenceCase, Elastic) {
    let mut rig = Rig::fe();
    rig.tread.stiffening = 1.0;
    let case = ReferenceCase {
        resolution: Resolution { elements: 5760, stride_mm: 0.005, step_s: 2e-4 },
        ..ReferenceCase::new(rig, speed_mm_s, preload_n)
    };
    let elastic = Elastic { ring: case.ring(), step_height_mm: case.rig.rig.step_height_mm };
    (case, elastic)
}

fn coarse(case: ReferenceCase) -> ReferenceCase {
    let resolution = Resolution { elements: 1440, stride_mm: 0.02, step_s: 4e-4 };
    ReferenceCase { resolution, ..case }
}

/// A movement to the centre `(x, y)` on this wall.
fn at(wall: &Wall, x_mm: f64, y_mm: f64, dt_s: f64) -> Motion {
    Motion { wall: wall.local(x_mm), height_mm: y_mm, turn_rad: 0.0, dt_s }
}

fn step() -> Wall {
    Wall::new(vec![Step { position_mm: 0.0, height_mm: 4.0 }])
}

#[test]
fn without_memory_the_ring_is_its_closed_form() {
    for preload in [40.0, 100.0, 150.0] {
        let (case, elastic) = without_memory(5.0, preload);
        let crossing = case.still().unwrap();
        let gap = elastic.gap_mm(preload).unwrap();
        assert!((crossing.gap_mm / gap - 1.0).abs() < 5e-5, "{} {gap}", crossing.gap_mm);
        let mut ring = Ring::new(case.ring());
        let mut worst = (0.0_f64, 0.0_f64);
        for index in 0..300 {
            let x = -16.0 + 0.05 * f64::from(index);
            let height = elastic.height_mm(x, preload);
            let forces = elastic.forces(x, height);
            let solved = case.balance().solve(&mut ring, at(&step(), x, height, 1.0)).unwrap();
            worst.0 = worst.0.max((solved.height_mm - height).abs());
            worst.1 = worst.1.max((solved.contact.sine_n - forces.axial_n).abs());
        }
        let allowed_n = 5e-4 * crossing.corner_force_n;
        assert!(worst.0 < 5e-4 && worst.1 < allowed_n, "{worst:?}");
    }
}

#[test]
fn finer_rings_come_closer_to_the_closed_form() {
    let (case, elastic) = without_memory(5.0, 100.0);
    let gap = elastic.gap_mm(100.0).unwrap();
    let error = |elements: usize| {
        let resolution = Resolution { elements, stride_mm: 14.4 / elements as f64, step_s: 1e-4 };
        (ReferenceCase { resolution, ..case.clone() }.still().unwrap().gap_mm / gap - 1.0).abs()
    };
    let (few, more, many) = (error(720), error(1440), error(5760));
    assert!(few < 2e-3 && more < 5e-4 && many < 5e-5, "{few} {more} {many}");
}

#[test]
fn a_stiff_tread_climbs_as_a_rigid_wheel() {
    let (case, mut elastic) = without_memory(5.0, 100.0);
    // P tan(phi).
    let rigid = 100.0 * case.climb_angle().tan();
    assert!((rigid - 64.6).abs() < 0.05);
    let mut last = f64::INFINITY;
    for stiffness in [1.0, 1e1, 1e2, 1e3, 1e4] {
        elastic.ring.k_inf = stiffness;
        let lift_x = -((elastic.gap_mm(100.0).unwrap() + 25.0).powi(2) - 625.0).sqrt();
        let short = rigid - elastic.forces(lift_x, 25.0).axial_n;
        assert!(short > 0.0 && short < last, "{short}");
        last = short;
    }
    assert!(last < 0.02 * rigid, "{last}");
}

#[test]
fn the_tread_closes_on_the_corner_at_millimetres_per_second() {
    let case = ReferenceCase::first();
    assert!((case.climb_angle().to_degrees() - 32.86).abs() < 5e-3);
    assert!((case.closing_speed_mm_s() - 2.713).abs() < 1e-3);
}

#[test]
fn slow_and_light_the_dynamic_form_is_the_quasi_static_one() {
    let mut case = coarse(ReferenceCase::first());
    case.rig.plant.moved_mass_kg = 1e-3;
    let (still, moving) = (case.still().unwrap(), dynamic(&case).unwrap());
    let lift = |s: &&Sample| s.t_s > 0.0 && s.floor_n == 0.0;
    let gap = moving.iter().find(lift).unwrap().clearance_mm;
    assert!((still.gap_mm / gap - 1.0).abs() < 3e-3, "{} {gap}", still.gap_mm);
    let peak_n = moving.iter().map(|sample| sample.axial_n).fold(0.0, f64::max);
    assert!((still.corner_force_n / peak_n - 1.0).abs() < 1e-2);
}

#[test]
fn inertia_is_small_at_millimetres_per_second_and_grows_with_speed() {
    // The radial force less the preload is what accelerates. As the edge passes under
    // the centre, elements lose their hold one by one, which shakes the wheel by part of
    // an element's force, the less the finer the ring: left out.
    let excess = |speed: f64| {
        let crossing = dynamic(&coarse(ReferenceCase::new(Rig::fe(), speed, 100.0))).unwrap();
        let climbing = crossing.iter().filter(|s| s.x_mm < -0.1);
        climbing.map(|s| (s.radial_n - 100.0).abs()).fold(0.0, f64::max)
    };
    let [slow, medium, fast] = [3.0, 8.0, 200.0].map(excess);
    assert!(slow < 1.3 && medium < 1.3, "{slow} {medium}");
    assert!(slow < medium && medium < fast && fast > 10.0, "{slow} {medium} {fast}");
}

/// A wheel that has settled on the level wall, its ring, and the stiffness that carries
/// it, N/m.
fn settled(case: &ReferenceCase) -> (Mass, Ring, f64) {
    let mut ring = Ring::new(case.ring());
    let (mut height, mut stiffness) = (24.5, 0.0);
    for _ in 0..3 {
        let long = at(&Wall::default(), 0.0, height, 1e4 * case.rig.tread.tau_s);
        let rest = case.balance().solve(&mut ring, long).unwrap();
        (height, stiffness) = (rest.height_mm, -1e3 * rest.contact.slope.0);
        ring.commit(&Motion { height_mm: height, ..long });
    }
    (Mass::at_rest(case, height), ring, stiffness)
}

/// Height above rest, mm, and rate, mm/s, over `time_s` after a blow so small that no
/// element comes or goes.
fn ringing(case: &ReferenceCase, blow_mm_s: f64, dt_s: f64, time_s: f64) -> Vec<(f64, f64)> {
    let (mut mass, mut ring, _) = settled(case);
    let rest = mass.y_mm;
    mass.rate_mm_s = blow_mm_s;
    let steps = (time_s / dt_s).round() as usize;
    let states = (0..steps).map(|_| {
        let motion = at(&Wall::default(), 0.0, mass.y_mm, dt_s);
        mass.step(&mut ring, motion);
        ring.commit(&Motion { height_mm: mass.y_mm, ..motion });
        (mass.y_mm - rest, mass.rate_mm_s)
    });
    states.collect()
}

fn fast_relaxing() -> ReferenceCase {
    let mut case = ReferenceCase::first();
    case.rig.tread.tau_s = 2e-3;
    case
}

#[test]
fn a_wheel_at_rest_rings_on_its_tread_at_the_frequency_of_a_mass_on_the_solid() {
    // m s^2 + K(s) = 0 with K = K_inf + (K_0 - K_inf) s tau/(1 + s tau): three exponentials,
    // the roots of m tau s^3 + m s^2 + K_0 tau s + K_inf, from the blow v:
    // u = v sum of (tau s + 1) m e^{s t}/(derivative of the cubic at s).
    let case = fast_relaxing();
    let tau = case.rig.tread.tau_s;
    let (_, _, k_inf) = settled(&case);
    let (k_0, m) = (k_inf * case.rig.tread.stiffening, 3.0);
    let mut cubic = nalgebra::Matrix3::new(0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0);
    cubic.set_row(0, &[-1.0 / tau, -k_0 / m, -k_inf / (m * tau)].into());
    let roots = cubic.complex_eigenvalues();
    let exact = |t: f64| -> f64 {
        let parts = roots.iter().map(|s| {
            let slope = s * s * (3.0 * m * tau) + s * (2.0 * m) + k_0 * tau;
            ((s * tau + 1.0) * m * (s * t).exp() / slope).re
        });
        1e-4 * parts.sum::<f64>()
    };
    let dt = 2e-5;
    let states = ringing(&case, 1e-4, dt, 0.04);
    let largest = states.iter().fold(0.0_f64, |most, (u, _)| most.max(u.abs()));
    for (step, (u, _)) in states.iter().enumerate() {
        let wanted = exact(dt * (step + 1) as f64);
        assert!((u - wanted).abs() < 1e-3 * largest, "{step}: {u:e} {wanted:e} of {largest:e}");
    }
}

#[test]
fn the_dynamic_form_is_of_second_order_in_its_step() {
    let end = |dt: f64| ringing(&fast_relaxing(), 1e-4, dt, 0.016).last().unwrap().0;
    let [a, b, c] = [2e-4, 1e-4, 5e-5].map(end);
    let ratio = (a - b) / (b - c);
    assert!((3.5..4.5).contains(&ratio), "{ratio}");
}

#[test]
fn without_memory_a_ringing_wheel_keeps_its_energy() {
    let mut case = ReferenceCase::first();
    case.rig.tread.stiffening = 1.0;
    let stiffness_n_per_mm = 1e-3 * settled(&case).2;
    // Kinetic, mJ, and that of the contact linearised about rest.
    let energy = |(u, rate): (f64, f64)| 0.5 * (3e-3 * rate.powi(2) + stiffness_n_per_mm * u * u);
    let last = *ringing(&case, 1e-3, 1e-4, 2.0).last().unwrap();
    let kept = energy(last) / energy((0.0, 1e-3));
    assert!((kept - 1.0).abs() < 1e-2, "{kept}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn closed_form_forces_are_the_sums_over_rays(x in -16.0..-0.05_f64, y in 22.0..25.2_f64) {
        let (_, elastic) = without_memory(5.0, 100.0);
        let wall = step().local(x);
        let (mut radial, mut axial) = (0.0, 0.0);
        let count = 200_000;
        let h = 2.4 / f64::from(count);
        for i in 0..count {
            let psi = -1.2 + h * (f64::from(i) + 0.5);
            // To the floor, to the face ahead, or to the top above it.
            let (sin, cos) = psi.sin_cos();
            let (ahead, over) = (wall.ahead_mm * cos, y - wall.rise_mm);
            let distance = match (y * sin > ahead, over * sin > ahead) {
                (false, _) => y / cos,
                (true, false) => wall.ahead_mm / sin,
                (true, true) => over / cos,
            };
            let depth = 25.0 - distance;
            if depth > 0.0 {
                radial += depth * psi.cos();
                axial += depth * psi.sin();
            }
        }
        let scale = 0.6044 * 25.0 * 28.0 * h;
        let forces = elastic.forces(x, y);
        prop_assert!((forces.radial_n - scale * radial).abs() < 1e-6 * (1.0 + radial));
        prop_assert!((forces.axial_n - scale * axial).abs() < 1e-6 * (1.0 + radial));
    }
}
