//! The tread wound up along the wall, over climbs and descents.

use hil_sim::plant::draw::PlantParameters;
use hil_sim::plant::rig::{Drives, Resolution, VirtualRig};
use hil_sim::plant::wall::Wall;

use super::bench::{TICK_S, close, drive, ideal, nominal, pairs, roll, steps};

/// A factor of compliance that makes a tread all but rigid.
const RIGID: f64 = 1e-3;

/// The plant with a tread that gives way along the wall, this many times as much as its layer.
fn wound(mut plant: PlantParameters, compliance: f64) -> PlantParameters {
    plant.wind_up = compliance;
    plant
}

/// Axle behind the tread, mm.
fn lag(rig: &VirtualRig) -> f64 {
    let truth = rig.truth();
    truth.rotation_rad * rig.parameters().ring.radius_mm - truth.position_mm
}

#[test]
fn a_wheel_at_rest_is_wound_up_by_load_over_stiffness() {
    for (load, thickness) in [(6.7, 0.0), (-6.7, 0.0), (20.0, 0.0), (6.7, 5.0)] {
        let mut plant = wound(ideal("prototype"), 1.0);
        plant.drive = nominal("prototype").drive;
        plant.wall = Wall::new(Vec::new());
        plant.ring.tread_thickness_mm = thickness;
        plant.load_n = load;
        let n_per_mm = plant.shear().n_per_mm;
        let mut rig = VirtualRig::new(plant, 30.0, 33.3, TICK_S);
        roll(&mut rig, 5.0, 31.0, 10.0, |_| {}).unwrap();
        steps(&mut rig, &Drives::default(), 4000);
        let before = *rig.truth();
        rig.set_load(load + 3.0);
        steps(&mut rig, &Drives::default(), 4000);
        let truth = rig.truth();
        assert_eq!((truth.tread_mm_s, truth.rotation_rad), (0.0, before.rotation_rad));
        assert_eq!(truth.slip_mm, 0.0);
        // On the rolling radius, which is a little shorter.
        close(before.position_mm - truth.position_mm, 3.0 / n_per_mm, 0.02);
    }
}

/// Axle behind the tread as it comes to the first corner, at lift-off, and after 2 mm more of
/// the tread, mm, and the travel of the tread from the first.
fn at_the_corner(plant: PlantParameters) -> [(f64, f64); 3] {
    let mut rig = VirtualRig::new(plant, 0.0, 48.0, TICK_S);
    let mut at: Vec<(f64, f64)> = Vec::new();
    roll(&mut rig, 8.0, 24.0, 20.0, |rig| {
        let truth = rig.truth();
        let rolled = truth.rotation_rad * rig.parameters().ring.radius_mm;
        let due = match at.len() {
            0 => truth.position_mm > 2.0,
            1 => truth.floor_n == 0.0,
            _ => at.len() == 2 && rolled > at[1].0 + 2.0,
        };
        if due {
            at.push((rolled, lag(rig)));
        }
    })
    .unwrap();
    at.try_into().unwrap()
}

#[test]
fn at_lift_off_the_axle_lags_and_then_creeps() {
    // Axle's lag beyond that of a rigid tread, and creep after it beyond that, mm/mm.
    let beyond = |compliance: f64, thickness: f64| {
        let [soft, rigid] = [compliance, RIGID].map(|compliance| {
            let mut plant = wound(nominal("prototype"), compliance);
            plant.ring.tread_thickness_mm = thickness;
            at_the_corner(plant)
        });
        let more = |n: usize, at: &[(f64, f64); 3]| at[n].1 - at[0].1;
        let lags = more(1, &soft) - more(1, &rigid);
        let crept = (more(2, &soft) - more(2, &rigid) - lags) / 2.0;
        (lags, crept)
    };
    let nominal = beyond(1.0, 0.0);
    assert!((0.6..0.8).contains(&nominal.0), "{nominal:?}");
    assert!((0.06..0.12).contains(&nominal.1), "{nominal:?}");
    // It follows the thickness, as the page says.
    for (thickness, lags, crept) in [(5.0, 1.13, 0.21), (8.0, 0.72, 0.19), (12.0, 0.55, 0.19)] {
        let got = beyond(1.0, thickness);
        assert!((got.0 - lags).abs() < 0.02, "{thickness}: {got:?}");
        assert!((got.1 - crept).abs() < 0.01, "{thickness}: {got:?}");
    }
    // A stiff one is rigid.
    assert!(beyond(0.01, 0.0).0.abs() < 0.01);
}

/// Back over the steps the load pushes the same way: the axle is ahead of the tread.
#[test]
fn back_over_a_step_the_axle_is_ahead_of_the_tread() {
    let ahead = |compliance: f64| {
        let plant = wound(nominal("prototype"), compliance);
        let mut rig = VirtualRig::new(plant, 80.0, 45.0, TICK_S);
        roll(&mut rig, -8.0, 0.5, 30.0, |_| {}).unwrap();
        (lag(&rig) + 80.0, rig.truth().slip_mm)
    };
    let (soft, rigid) = (ahead(1.0), ahead(RIGID));
    // By half a millimetre at each of three steps, and by creep on the wall between.
    assert!(soft.0 > rigid.0 + 3.0 * 0.5, "{soft:?} {rigid:?}");
    assert_eq!((soft.1, rigid.1), (0.0, 0.0));
}

#[test]
fn the_step_of_time_does_not_matter() {
    for speed in [8.0, -8.0, 25.0] {
        let run = |dt_s: f64, stride_mm: f64| {
            let (from, to) = if speed > 0.0 { (0.0, 80.0) } else { (80.0, 0.0) };
            let resolution = Resolution { stride_mm, ..Resolution::default() };
            let plant = wound(ideal("prototype"), 1.0);
            let mut rig = VirtualRig::new(plant, from, 45.0, dt_s)
                .with_resolution(resolution)
                .with_speed(speed);
            while (rig.truth().position_mm - to) * speed < 0.0 {
                rig.follow(speed, 45.0, dt_s).unwrap();
            }
            rig
        };
        let (coarse, fine) = (run(1e-3, 0.04), run(1.25e-4, 0.005));
        let off_mm = lag(&coarse) - lag(&fine);
        assert!(off_mm.abs() < 0.03, "{speed}: {off_mm}");
        for (a, b) in pairs(&coarse, &fine) {
            close(a.gap_mm, b.gap_mm, 1e-3);
        }
    }
}

/// Where the drive turns, the latch lets go of a load that the tread already carries.
#[test]
fn no_carriage_drops_as_the_latch_lets_go() {
    let mut plant = wound(ideal("prototype"), 1.0);
    plant.drive = nominal("prototype").drive;
    let mut rig = VirtualRig::new(plant, 2.0, 33.3, TICK_S);
    let drives = drive(rig.parameters(), 3.0);
    for _ in 0..200 {
        rig.step(&drives, TICK_S).unwrap();
        assert!(rig.truth().position_mm > 2.0 - 0.02, "{:?}", rig.truth());
    }
}
