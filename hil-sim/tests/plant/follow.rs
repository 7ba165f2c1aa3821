//! A rig led through the spin and the preload of a run goes the way of that run.

use hil_sim::plant::draw::PlantParameters;
use hil_sim::plant::rig::VirtualRig;
use hil_sim::scenario::Scenario;
use hil_sim::session::{Options, Session};

/// Bound on the way, mm: a twentieth of what a wheel does in a millisecond.
const WAY_MM: f64 = 0.002;
/// Bound on the height at any time, mm: the arm's modes, which a led rig does not have.
const SHAKEN_MM: f64 = 0.03;

#[test]
fn a_run_led_by_its_own_spin_and_preload_is_the_run() {
    let mut scenario = Scenario::default();
    scenario.run.seed = 3;
    let mut session = Session::new(&scenario, Options::default()).unwrap();
    let mut parameters = PlantParameters::draw(&scenario);
    let mut truths = vec![*session.plant().truth()];
    for tick in 0..5000 {
        let command = (tick == 600).then_some(interstage::supervise::Command::Start);
        session.step(command).unwrap();
        truths.push(*session.plant().truth());
    }
    parameters.spring_n_per_mm = 0.0;
    for step in [1usize, 2, 4] {
        let dt = 1e-3 * step as f64;
        let mut led = VirtualRig::new(parameters.clone(), 0.0, truths[0].preload_n, dt);
        let radius = parameters.ring.radius_mm;
        let (mut height, mut count) = (0.0, 0.0);
        for k in (step..5000).step_by(step) {
            let (a, b) = (truths[k - step], truths[k]);
            let tread = radius * (b.rotation_rad - a.rotation_rad) / dt;
            led.follow(tread, b.preload_n, dt).unwrap();
            let t = led.truth();
            assert!((t.position_mm - b.position_mm).abs() < WAY_MM, "{step} {k}: {t:?} {b:?}");
            assert!((t.height_mm - b.height_mm).abs() < SHAKEN_MM, "{step} {k}: {t:?} {b:?}");
            height += t.height_mm - b.height_mm;
            count += 1.0;
        }
        // Of the arm's modes nothing is left in the mean.
        let mean: f64 = height / count;
        assert!(mean.abs() < 2e-4, "{step}: {mean}");
    }
}
