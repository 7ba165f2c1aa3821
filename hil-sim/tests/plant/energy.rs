//! The first law over complete climbs and descents.

use hil_sim::plant::draw::PlantParameters;
use hil_sim::plant::rig::{Energy, Resolution, VirtualRig};
use hil_sim::scenario::Scenario;

use super::bench::{TICK_S, nominal, roll};

/// Half the stride and twice the elements of the usual setting.
fn finer(mut plant: PlantParameters) -> PlantParameters {
    plant.ring.elements *= 2;
    plant
}

/// What is missing from the first law over the travel, as part of the energy that flows.
/// The travel, mm, goes over this many steps.
fn missing(plant: PlantParameters, speed: f64, preload: f64, travel: f64, steps: usize) -> f64 {
    let from = if speed > 0.0 { 0.0 } else { 80.0 };
    let to = from + travel * speed.signum();
    let resolution = Resolution { stride_mm: 0.02, ..Resolution::default() };
    let mut rig = VirtualRig::new(plant, from, preload, TICK_S).with_resolution(resolution);
    // Under way, the wheel off the latch.
    roll(&mut rig, speed, from + speed.signum(), 10.0, |_| ()).unwrap();
    let start = *rig.energy();
    assert!(roll(&mut rig, speed, to, 60.0, |_| ()).unwrap(), "stuck: {:?}", rig.truth());
    let energy = rig.energy();
    assert_eq!(rig.ledger().crossings().len(), steps);
    assert_eq!(rig.truth().slip_mm, 0.0);
    // On a descent the load drives, and most goes into the worm.
    let released = -(energy.load_mj + energy.preload_mj + energy.arm_mj).min(0.0);
    // What the motor's work exceeds the sum of the others by.
    let total = |e: &Energy| {
        let lost = e.gear_mj + e.worm_mj + e.creep_mj + e.tread_mj;
        e.motor_mj - lost - e.load_mj - e.preload_mj - e.arm_mj - e.wound_mj - e.kinetic_mj
    };
    (total(energy) - total(&start)) / (energy.motor_mj + released)
}

fn balances(plant: PlantParameters, speed: f64, preload: f64) {
    let part = missing(finer(plant), speed, preload, 80.0, 3);
    assert!(part.abs() < 3e-3, "{speed} mm/s, {preload} N: {part}");
}

#[test]
fn the_drives_work_is_found_again_at_any_load_and_speed_and_on_random_rigs() {
    for (preset, load_n, speed, preload) in [
        ("prototype", None, 8.0, 33.3),
        ("prototype", None, 25.0, 48.0),
        ("prototype", None, -8.0, 33.3),
        ("prototype", None, -25.0, 33.3),
        ("fe", None, 5.0, 100.0),
        ("fe", None, 12.0, 100.0),
        ("fe", None, -30.0, 100.0),
        ("prototype", Some(15.0), 8.0, 45.0),
        // Where friction suffices.
        ("prototype", Some(15.0), -8.0, 48.0),
    ] {
        for wind_up in [0.3, 1.0, 2.0] {
            let plant = PlantParameters { wind_up, ..nominal(preset) };
            let load_n = load_n.unwrap_or(plant.load_n);
            balances(PlantParameters { load_n, ..plant }, speed, preload);
        }
    }
    for (seed, speed) in [1, 2, 3].into_iter().flat_map(|seed| [(seed, 10.0), (seed, -10.0)]) {
        let mut scenario = Scenario::default();
        scenario.run.seed = seed;
        balances(scenario.plant(), speed, 40.0);
    }
}

#[test]
fn the_drives_work_is_found_again_with_a_wheel_off_its_axis() {
    for run_out_mm in [0.1, 0.3] {
        for speed in [10.0, -10.0] {
            let mut plant = nominal("prototype");
            plant.run_out_mm = run_out_mm;
            // Half a turn of the wheel, and over the first step alone.
            let first = if speed > 0.0 { 24.5 } else { 33.0 };
            for (travel, steps) in [(80.0, 3), (first, 1)] {
                let part = missing(finer(plant.clone()), speed, 45.0, travel, steps);
                assert!(part.abs() < 3e-3, "{run_out_mm} mm, {speed} mm/s, {travel} mm: {part}");
            }
        }
    }
}
