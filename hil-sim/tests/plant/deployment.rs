//! Complete deployments and retractions of the plant alone.

use hil_sim::plant::balance::Axial;
use hil_sim::plant::draw::PlantParameters;
use hil_sim::plant::rig::{Drives, Resolution, Truth, VirtualRig};
use hil_sim::plant::wall::{Step, Wall};
use hil_sim::scenario::Scenario;

use super::bench::{TICK_S, close, crossed, deploy, fine, ideal, nominal, off, pairs};

/// As runs are computed.
const USUAL: Resolution = Resolution { stride_mm: 0.02, always_awake: false };
/// With the ring resolved everywhere.
const AWAKE: Resolution = Resolution { always_awake: true, ..USUAL };

/// Presets with their cruise preload, N.
const PRESETS: [(&str, f64); 2] = [("prototype", 33.3), ("fe", 100.0)];

#[test]
fn every_crossing_of_a_deployment_is_the_isolated_one() {
    for (preset, speed, preload) in
        [("prototype", 5.0, 33.3), ("prototype", 20.0, 48.0), ("fe", 12.0, 100.0)]
    {
        for speed in [speed, -speed] {
            let plant = ideal(preset);
            let alone = crossed(&fine(speed, preload, Axial::Driven(plant.load_n)));
            let rig = deploy(plant, USUAL, speed, preload, |_| {});
            assert_eq!(rig.ledger().crossings().len(), 3);
            for crossing in rig.ledger().crossings() {
                assert_eq!(crossing.climbing, speed > 0.0);
                // At lift-off the axle is a tenth slower than the tread, which relaxes more: 2 % of
                // the gap at most.
                let wider = off(crossing.gap_mm, alone.gap_mm);
                assert!((-0.025..0.004).contains(&wider), "{wider}");
                // A wheel that pivots is longer on the corner: the tread relaxes there, and the
                // climb needs a little less friction.
                let needed = off(crossing.peak_utilisation, alone.mu_needed);
                assert!((-0.03..0.004).contains(&needed), "{needed}");
                // The wheel pivots: no more than a rigid one at the touch of the corner, and its
                // rolling radius is less than the undeformed one.
                let pivots = 1.0 - 4.0 / 25.0;
                let part = crossing.speed_mm_s / speed.abs();
                assert!((pivots..0.99).contains(&part), "{part} {pivots}");
            }
        }
    }
}

/// The same deployment with the ring asleep where it may be and always awake: every state.
fn asleep_and_awake(
    plant: &PlantParameters,
    speed: f64,
    preload: f64,
) -> [(VirtualRig, Vec<Truth>); 2] {
    [USUAL, AWAKE].map(|resolution| {
        let mut states = Vec::new();
        let look = |rig: &VirtualRig| states.push(*rig.truth());
        (deploy(plant.clone(), resolution, speed, preload, look), states)
    })
}

#[test]
fn the_sleeping_ring_changes_nothing() {
    for (preset, preload) in PRESETS {
        for speed in [6.0, 30.0, -6.0, -30.0] {
            let [(usual, slept), (awake, woke)] =
                asleep_and_awake(&nominal(preset), speed, preload);
            for (usual, awake) in pairs(&usual, &awake) {
                close(usual.gap_mm, awake.gap_mm, 0.001);
                close(usual.corner_n, awake.corner_n, 0.005);
            }
            assert_alike(&slept, &woke);
        }
    }
}

#[test]
fn on_a_long_wall_the_ring_sleeps() {
    let mut plant = nominal("prototype");
    plant.wall = Wall::new(vec![Step { position_mm: 70.0, height_mm: 4.0 }]);
    let [(usual, slept), (awake, woke)] = asleep_and_awake(&plant, 10.0, 33.3);
    let asleep = slept.iter().filter(|truth| !truth.ring_awake).count();
    assert!(asleep * 2 > slept.len(), "asleep for {asleep} of {}", slept.len());
    let gaps = [&usual, &awake].map(|rig| rig.ledger().crossings()[0].gap_mm);
    // They differ by the phase of the ring's elements in the patch.
    close(gaps[0], gaps[1], 0.003);
    assert_alike(&slept, &woke);
}

/// Asserts that two runs are the same but for the element that enters the patch.
fn assert_alike(a: &[Truth], b: &[Truth]) {
    assert!(a.len().abs_diff(b.len()) <= 1, "{} {}", a.len(), b.len());
    for (a, b) in a.iter().zip(b) {
        // The axle's travel changes with the tread's where the wheel pivots, and an element is
        // 0.109 mm.
        assert!((a.position_mm - b.position_mm).abs() < 0.1 * 0.109, "{a:?} {b:?}");
        assert!((a.height_mm - b.height_mm).abs() < 0.02, "{a:?} {b:?}");
        assert!((a.utilisation - b.utilisation).abs() < 0.02, "{a:?} {b:?}");
    }
}

#[test]
fn the_spring_gives_the_preload_that_the_climb_puts_in() {
    let plant = nominal("prototype");
    let (rate, radius) = (plant.spring_n_per_mm, plant.ring.radius_mm);
    let mut levels = [0.0f64; 4];
    let rig = deploy(plant, USUAL, 10.0, 33.3, |rig| {
        let truth = rig.truth();
        let seat = truth.preload_n - rate * (truth.height_mm - radius);
        // The locked screw keeps its seat, which is the preload of the unloaded wheel.
        assert!((33.3..34.0).contains(&seat), "{seat}");
        if truth.corner_n == 0.0 {
            levels[((truth.height_mm - 24.0) / 4.0) as usize] = truth.preload_n;
        }
    });
    for pair in levels.windows(2) {
        // A little less than the step's height, for the tread yields.
        let gained = (pair[1] - pair[0]) / (4.0 * rate);
        assert!((0.98..1.0).contains(&gained), "{levels:?}");
    }
    assert!(rig.ledger().crossings().windows(2).all(|c| c[1].gap_mm < c[0].gap_mm));
}

#[test]
fn the_arm_follows_the_wheel() {
    let plant = nominal("prototype");
    let (length, pivot, wall) = (plant.arm.length_mm, plant.arm.pivot_mm, plant.wall_radius_mm);
    let mut last = f64::INFINITY;
    let rig = deploy(plant, USUAL, 30.0, 33.3, |rig| {
        let truth = rig.truth();
        assert!((wall - truth.height_mm - truth.radius_mm).abs() < 1e-9);
        assert!((length * truth.arm_rad.sin() - (truth.radius_mm - pivot)).abs() < 1e-9);
        last = truth.arm_rad;
    });
    // Three steps inwards: the arm has folded by what 12 mm of radius take.
    let expected = ((wall - 12.0 - rig.parameters().ring.radius_mm - pivot) / length).asin();
    assert!((last - expected).abs() < 0.005, "{last} {expected}");
}

#[test]
fn radial_inertia_may_be_neglected() {
    // Quasi-static radially: what it takes to accelerate the moved mass inwards.
    for (preset, preload) in PRESETS {
        let mut heights = Vec::new();
        deploy(ideal(preset), USUAL, 30.0, preload, |rig| heights.push(rig.truth().height_mm));
        let span = 10;
        let squared = (span as f64 * TICK_S).powi(2);
        let most = (span..heights.len() - span)
            .map(|i| heights[i + span] - 2.0 * heights[i] + heights[i - span])
            .fold(0.0f64, |most, bend| most.max(bend.abs() / squared));
        let force = 1e-3 * most * nominal(preset).mass_kg;
        assert!(force < 0.03 * preload, "{force}");
    }
}

#[test]
fn the_screw_of_a_rig_of_high_steps_follows_them_to_the_end() {
    let mut plant = Scenario::default().plant();
    let steps = plant.wall.steps().iter().map(|step| Step { height_mm: 16.0, ..*step }).collect();
    plant.wall = Wall::new(steps);
    let mut rig = VirtualRig::new(plant, 80.0, 33.0, 1e-3);
    let releases = Drives { preload: -0.1, preload_on: true, ..Drives::default() };
    (0..400).for_each(|_| rig.step(&releases, 1e-3).expect("at rest"));
    let preload_n = rig.truth().preload_n;
    assert!((30.0..33.0).contains(&preload_n), "{preload_n}");
}
