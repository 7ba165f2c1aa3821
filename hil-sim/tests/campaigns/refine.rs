//! Convergence of the plant with stride and step of time.
//!
//! A figure must be smooth in what is refined: taken at a fixed position, reached by an integer
//! number of strides, on a ring so fine that single elements do not show, and free of events,
//! whose instants jump between strides. The height of a wheel halfway up a step is of second
//! order: the ring is exact in time for a linear depth. The work up to there is of first order:
//! the start of a contact is known to a stride. So is the distance of the rig over the step of
//! time: its friction is that of the step's end.

use hil_sim::plant::balance::{Axial, Balance};
use hil_sim::plant::rig::{Drives, Resolution, VirtualRig};
use hil_sim::plant::ring::{Motion, Ring, RingParameters};
use hil_sim::plant::wall::{Step, Wall};
use hil_sim::scenario::Scenario;
use interstage::rig::Rig;

/// Part of the stated order that a finite refinement has to show by Richardson's quotient.
const SHOWN: f64 = 0.85;

/// Last differences below this part of the value count as converged, whatever their quotient:
/// a tread so fast that it does not relax shows nothing but its elements.
const GRAIN: f64 = 5e-4;

/// Differences below this part of the value are rounding, and what the balance leaves.
const ROUNDING: f64 = 1e-8;

const STRIDES_MM: [f64; 3] = [0.08, 0.04, 0.02];

/// Halfway up the step of 4 mm, before its face, and where the wheel starts, mm.
const PLACE_MM: f64 = -6.72;
const FROM_MM: (f64, f64) = (-20.16, 10.08);

/// Order of convergence that three values show, each on half the resolution of the one
/// before: Richardson's quotient. None where the differences are rounding.
fn order([coarse, middle, fine]: [f64; 3]) -> Option<f64> {
    let (first, second) = ((middle - coarse).abs(), (fine - middle).abs());
    (first > ROUNDING * fine.abs()).then(|| (first / second.max(f64::MIN_POSITIVE)).log2())
}

/// The values are finite, and of the stated order or converged.
fn assert_converges(name: &str, stated: f64, values: [f64; 3]) {
    let [_, middle, fine] = values;
    let converged = (fine - middle).abs() <= GRAIN * fine.abs();
    let shows = order(values).is_some_and(|order| order >= SHOWN * stated);
    assert!(values.iter().all(|value| value.is_finite()), "{name}: {values:?}");
    assert!(converged || shows, "{name}: {values:?}, order {:?}", order(values));
}

#[test]
fn height_and_work_of_a_climb_converge_with_the_stride() {
    let long = hil_sim::testing::long();
    let speeds: &[f64] = if long { &[5.0, -5.0, 60.0, -500.0, 2000.0] } else { &[5.0] };
    for &speed in speeds {
        for (k_inf, stiffening, tau_s) in [(0.6, 4.2, 0.1), (0.06, 1.0, 1.0), (3.0, 20.0, 0.01)] {
            for preload in [15.0, 100.0] {
                let k_0 = k_inf * stiffening;
                let rubber = RingParameters::of(&Rig::prototype(), 11_520);
                let ring = RingParameters { k_inf, k_0, tau_s, ..rubber };
                let ends = STRIDES_MM.map(|stride| {
                    climb(ring, speed, preload, stride).unwrap_or((f64::NAN, f64::NAN))
                });
                let at = format!("{speed} mm/s, {preload} N, {k_inf} x {stiffening}, {tau_s} s");
                assert_converges(&format!("work, {at}"), 1.0, ends.map(|end| end.1));
                // Without memory, or too fast for it, the height does not depend on the stride.
                if stiffening > 1.0 && speed.abs() < 10.0 {
                    assert_converges(&format!("height, {at}"), 2.0, ends.map(|end| end.0));
                }
            }
        }
    }
}

#[test]
fn the_distance_of_the_rig_converges_with_the_step_of_time() {
    for speed in [8.0, 30.0, 120.0] {
        let at = |dt_s| distance(speed, dt_s).unwrap_or(f64::NAN);
        assert_converges(&format!("{speed} mm/s"), 1.0, [at(1e-3), at(5e-4), at(2.5e-4)]);
    }
}

#[test]
fn the_order_is_that_of_the_differences() {
    let shown = order([1.16, 1.04, 1.01]).expect("a difference");
    assert!((shown - 2.0).abs() < 1e-9);
    assert!(order([1.09, 1.03, 1.0]).expect("a difference") < 0.85 * 2.0);
    assert_eq!(order([1.0, 1.0, 1.0]), None);
}

/// Height of the wheel halfway up the step, mm, and the work of the axial force up to there,
/// mJ, pushed at constant speed.
fn climb(ring: RingParameters, speed: f64, preload_n: f64, stride: f64) -> Option<(f64, f64)> {
    let wall = Wall::new(vec![Step { position_mm: 0.0, height_mm: 4.0 }]);
    let balance = Balance::under(preload_n, Axial::Pushed);
    let from = if speed > 0.0 { FROM_MM.0 } else { FROM_MM.1 };
    let strides = ((PLACE_MM - from).abs() / stride).round();
    let dx = (PLACE_MM - from) / strides;
    let mut wheel = Ring::new(ring);
    let mut height = ring.radius_mm - 0.01 + wall.local(from).base_mm;
    let (mut work, mut before) = (0.0, None);
    for index in 1..=strides as usize {
        let local = wall.local(from + dx * index as f64);
        let motion = Motion {
            wall: local,
            height_mm: height - local.base_mm,
            turn_rad: dx / ring.radius_mm,
            dt_s: dx / speed,
        };
        let solved = balance.solve(&mut wheel, motion).ok()?;
        wheel.commit(&Motion { height_mm: solved.height_mm, ..motion });
        height = solved.height_mm + local.base_mm;
        let axial = solved.contact.sine_n;
        work += before.map_or(0.0, |before: f64| 0.5 * (before + axial) * dx);
        before = Some(axial);
    }
    Some((height, work))
}

/// Where the rig is 0.2 s after full duty for this speed, mm.
fn distance(speed: f64, dt_s: f64) -> Option<f64> {
    let mut plant = Scenario::default().plant();
    plant.ripple.0 = 0.0;
    plant.drive.no_load_mm_s = 2.0 * speed;
    // The step of time alone: no stride divides it.
    let undivided = Resolution { stride_mm: 1e3, ..Resolution::default() };
    let mut rig = VirtualRig::new(plant, 0.0, 33.3, dt_s).with_resolution(undivided);
    for _ in 0..(0.2 / dt_s).round() as usize {
        rig.step(&Drives { drive: 0.5, drive_on: true, ..Drives::default() }, dt_s).ok()?;
    }
    Some(rig.truth().position_mm)
}
