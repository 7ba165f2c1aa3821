//! Friction and its limits: slip, stall, stops, the worm gear, the inclined arm.

use hil_sim::plant::rig::{Drives, PlantError, Resolution, VirtualRig};
use hil_sim::plant::wall::Wall;
use hil_sim::scenario::Scenario;
use hil_sim::session::{Options, run};
use interstage::fault::Fault;

use crate::common::overridden;

use super::bench::{TICK_S, close, deploy, drive, ideal, nominal, roll, steps};

#[test]
fn with_too_little_friction_a_run_does_not_complete() {
    for (preset, friction) in
        [("prototype", 0.0), ("prototype", 0.3), ("prototype", 0.6), ("fe", 0.3), ("fe", 0.5)]
    {
        let set = format!("plant.mu={friction}");
        let recording = run(&overridden(preset, &[&set]), Options::ROWS).unwrap();
        let summary = &recording.summary;
        assert!(!summary.completed, "{preset} at {friction}");
        let faults: Vec<u16> = summary.faults.iter().map(|fault| fault.code).collect();
        assert!(summary.slip_mm > 0.5 && !faults.is_empty(), "{faults:?} {}", summary.slip_mm);
        for tick in &recording.rows {
            let row = tick.truth.expect("the plant's truth");
            let numbers = [row.position_true_mm, row.corner_force_n, row.floor_force_n];
            assert!(numbers.iter().all(|x| x.is_finite()), "{row:?}");
            assert!(row.utilisation.abs() <= friction + 1e-12, "{row:?}");
            assert!((-2.5..18.0).contains(&row.position_true_mm), "{row:?}");
        }
        let gap = summary.max_gap_mm;
        assert!(if summary.crossings.is_empty() { gap.is_nan() } else { gap < 3.2 }, "{gap}");
    }
}

#[test]
fn friction_decides_at_what_the_climb_needs() {
    // The isolated crossing needs 0.924.
    for (friction, climbs) in [(0.90, false), (0.94, true)] {
        let mut plant = ideal("prototype");
        plant.mu = friction;
        let mut rig = VirtualRig::new(plant, 0.0, 33.3, TICK_S);
        let over = roll(&mut rig, 5.0, 24.0, 20.0, |rig| {
            assert!(rig.truth().utilisation <= friction);
        });
        assert_eq!(over, Ok(climbs), "{:?}", rig.truth());
        assert_eq!(rig.truth().slip_mm > 1.0, !climbs);
        assert_eq!(rig.truth().position_mm < 18.0, !climbs);
        assert!(rig.ledger().crossings().len() <= 1);
    }
}

#[test]
fn slip_is_the_travel_of_the_tread_beyond_its_creep() {
    let mut plant = ideal("prototype");
    plant.mu = 0.8;
    let mut rig = VirtualRig::new(plant, 0.0, 33.3, TICK_S);
    assert_eq!(roll(&mut rig, 5.0, 30.0, 20.0, |_| {}), Ok(false));
    let truth = rig.truth();
    let longer = truth.rotation_rad * rig.parameters().ring.radius_mm - truth.position_mm;
    assert!(truth.slip_mm > 80.0);
    // Without slip the wheel, held at the corner, would carry its axle along by the cosine of
    // the direction to the corner of its tread's travel, or more.
    let (ahead, above) = (18.0 - truth.position_mm, truth.height_mm - 4.0);
    let pivots = above / ahead.hypot(above);
    let part = truth.slip_mm / longer;
    assert!((pivots..1.0).contains(&part), "{part} {pivots}");
}

#[test]
fn one_wheel_does_not_lift_the_whole_load_by_friction_alone() {
    let over = |coupling, friction, preload| {
        let mut plant = ideal("prototype");
        plant.load_n = 20.0;
        plant.arm.coupling = coupling;
        plant.mu = friction;
        let mut rig = VirtualRig::new(plant, 0.0, preload, TICK_S);
        roll(&mut rig, 5.0, 30.0, 20.0, |_| {}).unwrap()
    };
    assert!(!over(0.0, 1.1, 33.3));
    assert!(!over(0.0, 1.1, 50.0));
    assert!(over(0.0, 2.0, 33.3));
    // A leading arm lifts the wheel off; a trailing one presses it by the load itself.
    assert!(!over(-1.0, 2.0, 33.3));
    assert!(!over(1.0, 1.0, 33.3));
    assert!(over(1.0, 1.3, 33.3));
    assert!(over(1.0, 1.1, 50.0));
}

#[test]
fn the_whole_load_stops_a_run_unless_the_arm_helps() {
    let summary = |coupling: &str, friction: &str| {
        let sets = ["plant.top_load_share=1", coupling, friction];
        run(&overridden("prototype", &sets), Options::default()).unwrap().summary
    };
    for coupling in ["plant.arm_coupling=0", "plant.arm_coupling=-1"] {
        let stuck = summary(coupling, "plant.mu=1.1");
        // It stops while it slips, and names how far.
        let named = |text: &str| stuck.faults.iter().any(|fault| fault.text == text);
        assert!(!stuck.completed && stuck.slip_mm > 0.5, "{coupling}: {stuck:?}");
        let reasons = [Fault::WheelSlips, Fault::FrictionShort].map(Fault::sentence);
        assert!(reasons.into_iter().any(named), "{coupling}: {stuck:?}");
    }
    // It needs a little more than 1.1, as the axle swings on its tread: there it slides, and climbs.
    for friction in ["plant.mu=1.1", "plant.mu=1.2"] {
        let helped = summary("plant.arm_coupling=1", friction);
        let most = helped.crossings.iter().map(|c| c.peak_utilisation).fold(0.0, f64::max);
        assert!(helped.completed && (helped.slip_mm > 0.0) == (most == 1.1), "{helped:?}");
        assert!((1.1..1.2).contains(&most), "{most}");
    }
}

#[test]
fn thrust_turns_into_radial_force_by_the_arm() {
    let mut gaps = Vec::new();
    for coupling in [-1.0, 0.0, 1.0] {
        let mut plant = ideal("prototype");
        plant.arm.coupling = coupling;
        let load = plant.load_n;
        let rig = deploy(plant, Resolution::default(), 10.0, 33.3, |rig| {
            let truth = rig.truth();
            if truth.corner_n == 0.0 && (2.0..4.0).contains(&truth.position_mm) {
                let expected = 33.3 + coupling * load * truth.arm_rad.tan();
                close(truth.floor_n, expected, 0.025);
            }
        });
        gaps.push(rig.ledger().crossings()[0].gap_mm);
        for direction in ["deploy", "retract"] {
            let sets =
                [format!("plant.arm_coupling={coupling}"), format!("run.direction={direction}")];
            let sets: Vec<&str> = sets.iter().map(String::as_str).collect();
            let summary = run(&overridden("prototype", &sets), Options::default()).unwrap().summary;
            assert!(summary.completed && summary.slip_mm == 0.0, "{sets:?}: {summary:?}");
        }
    }
    assert!(gaps[0] > gaps[1] && gaps[1] > gaps[2], "{gaps:?}");
}

#[test]
fn a_trailing_arm_jams_before_its_wheel_slides() {
    // mu tan(arm) is above 1: on the smooth wall the load holds itself.
    let mut plant = nominal("prototype");
    plant.wall = Wall::new(Vec::new());
    // The arm rings when the latch lets go, more than half a newton.
    plant.modes.clear();
    let jams = |friction: f64| {
        let mut plant = plant.clone();
        plant.mu = friction;
        let mut rig = VirtualRig::new(plant, 40.0, 0.5, TICK_S);
        roll(&mut rig, 2.0, 45.0, 10.0, |_| {}).unwrap() && rig.truth().slip_mm < 1e-6
    };
    assert!(jams(1.1) && !jams(0.5));
}

#[test]
fn the_load_does_not_turn_the_worm() {
    for drive_on in [true, false] {
        for load in [6.7, -6.7, 60.0] {
            let mut plant = ideal("prototype");
            plant.drive = nominal("prototype").drive;
            plant.load_n = load;
            plant.mu = 3.0;
            let mut rig = VirtualRig::new(plant, 40.0, 33.3, TICK_S);
            // Off the latch first.
            roll(&mut rig, 5.0, 41.0, 10.0, |_| {}).unwrap();
            let idle = Drives { drive_on, ..Drives::default() };
            steps(&mut rig, &idle, 200);
            let held = *rig.truth();
            steps(&mut rig, &idle, 1000);
            let truth = rig.truth();
            assert_eq!((truth.tread_mm_s, truth.rotation_rad), (0.0, held.rotation_rad));
            // The axle goes on as its tread relaxes under the load, by no more than all of that.
            let relaxes = (held.position_mm - truth.position_mm) / load;
            assert!((0.0..1.0 / rig.parameters().shear().n_per_mm).contains(&relaxes), "{relaxes}");
        }
    }
}

#[test]
fn the_latch_holds_until_the_drive_turns() {
    let mut plant = ideal("prototype");
    plant.drive = nominal("prototype").drive;
    let mut rig = VirtualRig::new(plant, 0.0, 0.0, TICK_S);
    steps(&mut rig, &Drives::default(), 500);
    assert_eq!(rig.truth().position_mm, 0.0);
    // Unpressed, it then falls to the stop.
    let drives = drive(rig.parameters(), 20.0);
    steps(&mut rig, &drives, 500);
    assert_eq!(rig.truth().position_mm, rig.parameters().stops_mm.0);
    assert!(rig.truth().slip_mm > 2.5);
}

#[test]
fn a_wheel_let_go_slides_down_to_the_stop() {
    let mut plant = nominal("prototype");
    plant.arm.coupling = 0.0;
    let mut rig = VirtualRig::new(plant, 2.0, 33.3, TICK_S);
    roll(&mut rig, 2.0, 3.0, 10.0, |_| {}).unwrap();
    let release = Drives { preload: -1.0, preload_on: true, ..Drives::default() };
    let mut gripped = f64::INFINITY;
    for _ in 0..2500 {
        rig.step(&release, TICK_S).unwrap();
        let truth = rig.truth();
        if truth.slip_mm == 0.0 {
            gripped = truth.preload_n;
        }
    }
    // Friction holds the load down to T/mu, within what the screw runs in 20 ms.
    let least = rig.parameters().load_n / rig.parameters().mu;
    assert!((least - 0.1..least + 0.5).contains(&gripped), "{gripped} {least}");
    assert_eq!(rig.truth().position_mm, -2.5);
    assert_eq!(rig.truth().speed_mm_s, 0.0);
}

#[test]
fn the_stops_hold() {
    for speed in [30.0, -30.0] {
        for coupling in [0.0, 1.0] {
            let mut plant = nominal("prototype");
            plant.arm.coupling = coupling;
            plant.wall = Wall::new(Vec::new());
            let stops = plant.stops_mm;
            let stop = if speed > 0.0 { stops.1 } else { stops.0 };
            let mut rig = VirtualRig::new(plant, 40.0, 33.3, TICK_S);
            let gone = roll(&mut rig, speed, 1e3 * speed, 4.0, |rig| {
                let position = rig.truth().position_mm;
                assert!((stops.0..=stops.1).contains(&position), "{position}");
            });
            assert_eq!(gone, Ok(false));
            let truth = rig.truth();
            assert_eq!((truth.position_mm, truth.speed_mm_s), (stop, 0.0));
            // Jammed, the motor stalls; else the tread slides.
            let slides = (truth.tread_mm_s * speed) > 0.0;
            let jams = coupling == 1.0 && speed > 0.0;
            assert_eq!(slides, !jams, "{truth:?}");
            assert_eq!(truth.slip_mm > 1.0, slides, "{truth:?}");
            // The reverse direction is free.
            assert_eq!(roll(&mut rig, -speed, 40.0, 10.0, |_| {}), Ok(true));
        }
    }
}

#[test]
fn the_guarded_speed_shakes_the_arm() {
    let rig = Scenario::default().rig;
    let amplitude = |speed: f64| {
        let mut plant = ideal("prototype");
        plant.ripple = nominal("prototype").ripple;
        plant.wall = Wall::new(Vec::new());
        let (mut deflection, mut least, mut most) = (0.0f64, f64::INFINITY, 0.0f64);
        let mut rig = VirtualRig::new(plant, 0.0, 33.3, TICK_S);
        roll(&mut rig, speed, 60.0, 60.0, |rig| {
            let truth = rig.truth();
            if truth.position_mm > 30.0 {
                deflection = deflection.max(truth.vibration_mm.abs());
                least = least.min(truth.floor_n);
                most = most.max(truth.floor_n);
            }
        })
        .unwrap();
        (deflection, 0.5 * (most - least))
    };
    for &mode in &rig.drive.modes_hz {
        let resonant = mode * rig.drive.ripple_pitch_mm;
        let at = amplitude(resonant);
        let (low, high) = (1.0 - rig.drive.guard_band, 1.0 + rig.drive.guard_band);
        for part in [low, high] {
            let off = amplitude(resonant * part);
            // At the edge of the band a third; the mode's quality is 25.
            assert!(at.0 > 2.5 * off.0 && at.1 > 2.5 * off.1, "{mode} Hz: {at:?} {off:?}");
        }
        // A fifth of the preload, by which the wall's force then swings.
        assert!((4.0..9.0).contains(&at.1), "{at:?}");
    }
}

#[test]
fn a_value_that_is_not_finite_ends_the_run_by_its_name() {
    let end = |drives: Drives| {
        let mut rig = VirtualRig::new(nominal("prototype"), 0.0, 33.3, TICK_S);
        (0..500).find_map(|_| rig.step(&drives, TICK_S).err()).unwrap()
    };
    let on = Drives { drive_on: true, preload_on: true, ..Drives::default() };
    let name = |error| match error {
        PlantError::NotFinite { name, .. } => name,
        PlantError::Balance { .. } => "balance",
    };
    assert_eq!(name(end(Drives { drive: f64::NAN, ..on })), "tread speed");
    assert_eq!(name(end(Drives { preload: f64::NAN, ..on })), "screw");
    let text = end(Drives { drive: f64::NAN, ..on }).to_string();
    assert_eq!(text, "plant at 0.000 s: tread speed is not finite");
}
