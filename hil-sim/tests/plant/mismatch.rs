//! What the plant has and the controller is not told: every effect shows, and by its size.

use hil_sim::plant::draw::PlantParameters;
use hil_sim::plant::mismatch::Mismatch;
use hil_sim::plant::rig::{Drives, Resolution, VirtualRig};
use hil_sim::plant::wall::Wall;
use hil_sim::scenario::Scenario;

use super::bench::{TICK_S, close, deploy, drive, ideal, nominal, roll, steps};

/// The ideal prototype with this mismatch.
fn with(mismatch: Mismatch) -> PlantParameters {
    ideal("prototype").with_mismatch(&mismatch)
}

/// The same on a wall without steps.
fn smooth(mismatch: Mismatch) -> PlantParameters {
    let mut plant = ideal("prototype");
    plant.wall = Wall::new(Vec::new());
    plant.with_mismatch(&mismatch)
}

fn neutral() -> Mismatch {
    Mismatch::default()
}

#[test]
fn the_controller_is_not_told_of_the_plants_friction() {
    let scenario = Scenario::resolve(None, None, &["mismatch.friction=0.5".to_owned()]).unwrap();
    assert_eq!(scenario.rig, Scenario::default().rig);
    assert_eq!(scenario.plant().mu, 0.5 * scenario.rig.plant.mu);
}

#[test]
fn run_out_waves_arm_and_speed_with_the_wheels_turn() {
    let mut plant = smooth(Mismatch { run_out_mm: 0.1, ..neutral() });
    plant.stops_mm = (-1.0, 400.0);
    let mut rig = VirtualRig::new(plant, 0.0, 33.3, TICK_S);
    let (mut radius, mut ratio) = ((f64::MAX, 0.0f64), (f64::MAX, 0.0f64));
    let (mut seen, mut sums) = (0.0, [0.0; 3]);
    roll(&mut rig, 20.0, 170.0, 20.0, |rig| {
        let truth = rig.truth();
        if truth.position_mm > 10.0 {
            radius = (radius.0.min(truth.radius_mm), radius.1.max(truth.radius_mm));
            let per_tread = truth.speed_mm_s / truth.tread_mm_s;
            ratio = (ratio.0.min(per_tread), ratio.1.max(per_tread));
            seen += 1.0;
            let terms = [truth.radius_mm, per_tread, truth.radius_mm * per_tread];
            sums = [0, 1, 2].map(|index| sums[index] + terms[index]);
        }
    })
    .unwrap();
    // The axle nearer to the wall is on the shorter lever: it is slow there.
    let [radii, ratios, products] = sums.map(|sum| sum / seen);
    close(products - radii * ratios, -0.5 * 0.1 * (0.1 / 25.0), 0.1);
    close(radius.1 - radius.0, 0.2, 0.02);
    close(ratio.1 - ratio.0, 0.2 / 25.0, 0.05);
    // After whole turns it is where a true wheel is.
    let far = |run_out_mm| {
        let mut plant = smooth(Mismatch { run_out_mm, ..neutral() });
        plant.stops_mm = (-1.0, 400.0);
        let mut rig = VirtualRig::new(plant, 0.0, 33.3, TICK_S);
        let mut at = 0.0;
        roll(&mut rig, 20.0, 170.0, 20.0, |rig| {
            if rig.truth().rotation_rad < std::f64::consts::TAU {
                at = rig.truth().position_mm - 25.0 * rig.truth().rotation_rad;
            }
        })
        .unwrap();
        at
    };
    assert!((far(0.1) - far(0.0)).abs() < 0.01, "{} {}", far(0.1), far(0.0));
}

#[test]
fn play_delays_the_tread_at_a_reversal() {
    // How far the tread has come back a second after the duty was reversed.
    let returns = |backlash_mm| {
        let mut plant = smooth(Mismatch { backlash_mm, ..neutral() });
        plant.drive = nominal("prototype").drive;
        plant.load_n = 0.0;
        let mut rig = VirtualRig::new(plant, 40.0, 33.3, TICK_S);
        let forwards = drive(rig.parameters(), 6.0);
        steps(&mut rig, &forwards, 1000);
        let turned = rig.truth().rotation_rad;
        let back = drive(rig.parameters(), -6.0);
        steps(&mut rig, &back, 1000);
        assert!(rig.truth().tread_mm_s < -4.0);
        25.0 * (turned - rig.truth().rotation_rad)
    };
    let none = returns(0.0);
    for play in [0.1, 0.5] {
        close(none - returns(play), play, 0.1);
    }
}

#[test]
fn a_round_edge_lowers_the_peak_of_the_corners_force() {
    let cross = |edge_radius_mm| {
        let plant = with(Mismatch { edge_radius_mm, ..neutral() });
        let rig = deploy(plant, Resolution::default(), 8.0, 33.3, |_| ());
        let crossing = rig.ledger().crossings()[0];
        (crossing.corner_n, crossing.gap_mm, crossing.peak_utilisation)
    };
    let (sharp, hair, round, rounder) = (cross(0.0), cross(1e-4), cross(0.2), cross(0.5));
    // A radius far below an element is none.
    close(hair.0, sharp.0, 2e-3);
    close(hair.1, sharp.1, 2e-3);
    assert!(round.0 < sharp.0 && rounder.0 < round.0, "{sharp:?} {round:?} {rounder:?}");
    assert!(rounder.2 < sharp.2, "{sharp:?} {rounder:?}");
}

#[test]
fn taper_and_bend_move_the_arm_and_the_taper_has_to_be_climbed() {
    let ends = |mismatch: Mismatch| {
        let mut rows = Vec::new();
        let plant = smooth(mismatch);
        let mut rig = VirtualRig::new(plant, 0.0, 33.3, TICK_S);
        roll(&mut rig, 10.0, 80.0, 20.0, |rig| {
            let truth = rig.truth();
            rows.push((truth.position_mm, truth.radius_mm, rig.tread_load_n()));
        })
        .unwrap();
        move |at: f64| *rows.iter().find(|row| row.0 > at).unwrap()
    };
    let plain = ends(neutral());
    let taper = ends(Mismatch { taper_mm: 0.4, ..neutral() });
    let bend = ends(Mismatch { bend_mm: 0.4, ..neutral() });
    close(plain(79.0).1 - taper(79.0).1, 0.4 * 79.0 / 80.0, 0.02);
    close(plain(40.0).1 - bend(40.0).1, 0.4, 0.02);
    assert!((plain(79.0).1 - bend(79.0).1).abs() < 0.05);
    close(taper(60.0).2 - plain(60.0).2, 33.3 * 0.4 / 80.0, 0.03);
}

#[test]
fn friction_in_the_pivot_hides_from_the_preload_sensor() {
    for (speed, sense) in [(8.0, 1.0), (-8.0, -1.0)] {
        let plant = with(Mismatch { pivot_friction_n: 2.0, ..neutral() });
        let mut looked = 0;
        deploy(plant, Resolution::default(), speed, 33.3, |rig| {
            let truth = rig.truth();
            // Behind the second step, on a level wall again.
            if truth.corner_n == 0.0
                && (if speed > 0.0 { 46.0..48.0 } else { 22.0..25.0 }).contains(&truth.position_mm)
            {
                looked += 1;
                assert_eq!(truth.preload_n, 33.3);
                let pressed = truth.floor_n + truth.utilisation * truth.resistance_n;
                assert!((pressed - 33.3 - sense * 2.0).abs() < 0.1, "{pressed}");
            }
        });
        assert!(looked > 100);
    }
}

#[test]
fn what_moves_has_a_weight() {
    let traction = |weight_n| {
        let mut rig =
            VirtualRig::new(smooth(Mismatch { weight_n, ..neutral() }), 0.0, 33.3, TICK_S);
        roll(&mut rig, 8.0, 60.0, 20.0, |_| ()).unwrap();
        rig.tread_load_n()
    };
    close(traction(5.0) - traction(0.0), 5.0, 0.01);
}

#[test]
fn a_sliding_wheel_has_the_friction_of_its_place() {
    let waves = Mismatch { friction_waviness: 0.1, friction_wave_mm: 20.0, ..neutral() };
    let mut plant = smooth(Mismatch { friction: 0.15, ..waves });
    // Beyond friction: it slides back from 40 mm on.
    plant.load_n = 8.0;
    let here = plant.clone();
    let mut rig = VirtualRig::new(plant, 40.0, 33.3, TICK_S);
    let drives = drive(rig.parameters(), 8.0);
    let (mut before, mut least, mut most) = (40.0, f64::MAX, 0.0f64);
    while before > 10.0 {
        steps(&mut rig, &drives, 1);
        let truth = rig.truth();
        assert_eq!(truth.friction, here.friction_at(truth.position_mm));
        if truth.slip_mm > 0.1 {
            let (from, to) = (here.friction_at(before), truth.friction);
            let used = truth.utilisation;
            assert!(used > 0.998 * from.min(to) && used < 1.001 * from.max(to), "{truth:?}");
            (least, most) = (least.min(used), most.max(used));
        }
        before = truth.position_mm;
    }
    close(least, 0.9 * here.mu, 0.01);
    close(most, 1.1 * here.mu, 0.01);
}

#[test]
fn the_pre_tightener_is_faster_below_its_limit() {
    let limit_n = nominal("prototype").preload_limit_n;
    let slew = nominal("prototype").slew_n_per_s;
    // Rate over two newtons about this preload, N/s, and what a small duty has done before, N.
    let raises = |preload_n: f64, screw_droop, screw_friction| {
        let plant = smooth(Mismatch { screw_droop, screw_friction, ..neutral() });
        let mut rig = VirtualRig::new(plant, 0.0, preload_n - 10.0, TICK_S);
        let small = Drives { preload: 0.04, preload_on: true, ..Drives::default() };
        steps(&mut rig, &small, 300);
        let crept = rig.truth().preload_n - (preload_n - 10.0);
        let drives = Drives { preload: 1.0, ..small };
        let mut ticks = 0;
        while rig.truth().preload_n < preload_n + 1.0 {
            ticks += u32::from(rig.truth().preload_n >= preload_n - 1.0);
            steps(&mut rig, &drives, 1);
        }
        (2e3 / f64::from(ticks), crept)
    };
    for preload_n in [0.5 * limit_n, limit_n] {
        let (rate, crept) = raises(preload_n, 0.2, 0.05);
        let faster = 0.2 * (1.0 - preload_n / limit_n) / 0.75;
        close(rate, slew * (1.0 + faster), 0.02);
        assert!(crept.abs() < 1e-9, "{crept}");
        let (rate, crept) = raises(preload_n, 0.0, 0.0);
        close(rate, slew, 0.02);
        assert!(crept > 0.1, "{crept}");
    }
}

#[test]
fn the_compression_sensor_may_look_at_the_patch() {
    let read = |mismatch: Mismatch| {
        let (mut smooth, mut corner) = (0.0, 0.0f64);
        let rig = deploy(with(mismatch), Resolution::default(), 8.0, 33.3, |rig| {
            let truth = rig.truth();
            if (1.0..2.0).contains(&truth.position_mm) {
                smooth = truth.compression_mm;
            }
            if (5.0..18.0).contains(&truth.position_mm) {
                corner = corner.max(truth.compression_mm);
            }
        });
        assert_eq!(rig.ledger().crossings().len(), 3);
        (smooth, corner)
    };
    let deepest = read(neutral());
    let patch = read(Mismatch { compression_patch: 1.0, ..neutral() });
    // The same on a level wall; less on the corner, which is deep in one place.
    close(patch.0, deepest.0, 0.06);
    assert!(patch.1 < 0.95 * deepest.1, "{patch:?} {deepest:?}");
    let compliant = read(Mismatch { compression_compliance_mm_per_n: 0.005, ..neutral() });
    close(compliant.0 - deepest.0, 0.005 * 33.3, 1e-9);
}

#[test]
fn the_contact_of_a_crossing_shakes_the_arm() {
    let shaken = |mode_shape| {
        let mut plant = nominal("prototype").with_mismatch(&Mismatch { mode_shape, ..neutral() });
        plant.ripple.0 = 0.0;
        let (mut smooth, mut crossing) = (0.0f64, 0.0f64);
        deploy(plant, Resolution::default(), 25.0, 48.0, |rig| {
            let truth = rig.truth();
            // Between two steps, where the first one's ringing has died away.
            if (24.0..26.0).contains(&truth.position_mm) {
                smooth = smooth.max(truth.vibration_mm.abs());
            } else if truth.corner_n > 0.0 {
                crossing = crossing.max(truth.vibration_mm.abs());
            }
        });
        (smooth, crossing)
    };
    assert_eq!(shaken(0.0), (0.0, 0.0));
    let (smooth, crossing) = shaken(1.0);
    assert!(crossing > 1.5 * smooth && (1e-4..0.02).contains(&crossing), "{smooth} {crossing}");
}
