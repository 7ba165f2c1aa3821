//! A rig under the rotation and preload of a run moves as in that run; changes of parameters
//! during a run have their effect.

use hil_sim::plant::rig::{Drives, VirtualRig};
use hil_sim::scenario::Scenario;
use hil_sim::session::{Options, RunningRig, Session};

use super::bench::{TICK_S, nominal, steps};

/// Bound on the position, mm, per millisecond of the step: a quarter of the travel. The
/// following wheel turns evenly within a step and pivots by the forces of the one before.
const POSITION_MM: f64 = 0.0075;
/// Bound on the height, mm, per millisecond of the step: the ripple on the arm's modes, which a
/// following rig does not have, and an axle that is late by a step on a corner.
const SHAKEN_MM: f64 = 0.002;

#[test]
fn following_the_rotation_and_preload_of_a_run_gives_that_run() {
    let mut scenario = Scenario::default();
    scenario.run.seed = 3;
    // The load does not shake the arm: no sensor shows what its modes press with, and the axle
    // swings on its tread by that.
    scenario.mismatch.mode_shape = 0.0;
    let mut session = Session::new(&scenario, Options::default()).unwrap();
    let mut parameters = scenario.plant();
    let mut truths = vec![*session.plant().truth()];
    for tick in 0..5000 {
        let command = (tick == 600).then_some(interstage::supervise::Command::Start);
        session.step(command).unwrap();
        truths.push(*session.plant().truth());
    }
    parameters.spring_n_per_mm = 0.0;
    for step in [1usize, 2, 4] {
        let dt = 1e-3 * step as f64;
        let mut rig = VirtualRig::new(parameters.clone(), 0.0, truths[0].preload_n, dt);
        let radius = parameters.ring.radius_mm;
        let (mut height, mut count) = (0.0, 0.0);
        for k in (step..5000).step_by(step) {
            let (a, b) = (truths[k - step], truths[k]);
            let tread = radius * (b.rotation_rad - a.rotation_rad) / dt;
            rig.follow(tread, b.preload_n, dt).unwrap();
            let t = rig.truth();
            let off = (t.position_mm - b.position_mm).abs();
            assert!(off < POSITION_MM * step as f64, "{step} {k}: {t:?} {b:?}");
            let high = (t.height_mm - b.height_mm).abs();
            assert!(high < SHAKEN_MM * step as f64, "{step} {k}: {t:?} {b:?}");
            height += t.height_mm - b.height_mm;
            count += 1.0;
        }
        // The arm's modes vanish in the mean, and most of what a step of time leaves, on corners.
        let mean: f64 = height / count;
        assert!(mean.abs() < 0.1 * SHAKEN_MM * step as f64, "{step}: {mean}");
    }
}

#[test]
fn a_broken_spring_and_a_soft_tread_have_their_effect() {
    let run = |rig: &mut VirtualRig| {
        steps(rig, &Drives::default(), 1000);
        *rig.truth()
    };
    let mut rig = VirtualRig::new(nominal("prototype"), 0.0, 30.0, TICK_S);
    let before = run(&mut rig);
    rig.break_spring(0.5);
    let part = run(&mut rig).preload_n / before.preload_n;
    assert!((part - 0.5).abs() < 0.01, "{part}");
    let mut rig = VirtualRig::new(nominal("prototype"), 0.0, 30.0, TICK_S);
    let (before, ring) = (run(&mut rig), rig.parameters().ring);
    rig.set_stiffness(0.3 * ring.k_inf, 0.3 * ring.k_0);
    // Force grows as compression to 3/2.
    let deeper = run(&mut rig).depth_mm / before.depth_mm / (1.0f64 / 0.3).powf(2.0 / 3.0);
    assert!((deeper - 1.0).abs() < 0.05, "{deeper}");
}
