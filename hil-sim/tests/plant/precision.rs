//! Error of the usual setting against one twenty times as fine, and how it falls.

use std::f64::consts::PI;

use hil_sim::plant::ledger::Crossing;
use hil_sim::plant::precision::{FINER, Setting, work_precision};
use hil_sim::plant::rig::{Drives, Resolution, VirtualRig};
use interstage::rig::Rig;

use super::bench::{TICK_S, nominal, off};

/// The crossings of the full travel at constant duty with the screw held and the drive a
/// hundred times as strong: nothing but setting and tick differs.
fn crossings(
    preset: &str,
    setting: Setting,
    tick_s: f64,
    (speed_mm_s, preload_n): (f64, f64),
) -> Vec<Crossing> {
    let mut plant = nominal(preset);
    plant.ring.elements = setting.elements;
    plant.drive.stall_n *= 100.0;
    plant.drive.limit_n *= 100.0;
    let duty = speed_mm_s / plant.drive.no_load_mm_s;
    let (low, high) = plant.stops_mm;
    let (from, to) = if speed_mm_s > 0.0 { (0.0, high - 1.0) } else { (high - 2.0, low + 1.0) };
    let longest_s = 5.0 * (high - low) / speed_mm_s.abs();
    let resolution = Resolution { stride_mm: setting.stride_mm, ..Resolution::default() };
    let mut rig = VirtualRig::new(plant, from, preload_n, tick_s).with_resolution(resolution);
    let drives = Drives { drive: duty, drive_on: true, ..Drives::default() };
    while (rig.truth().position_mm - to) * speed_mm_s < 0.0 && rig.truth().time_s < longest_s {
        rig.step(&drives, tick_s).unwrap();
    }
    rig.ledger().crossings().to_vec()
}

#[test]
fn a_crossing_inside_a_deployment_is_within_its_error() {
    let drives = [
        ("prototype", (25.0, 48.0)),
        ("prototype", (8.0, 33.3)),
        ("prototype", (-8.0, 33.3)),
        ("fe", (-30.0, 100.0)),
    ];
    for (preset, drive) in drives {
        let usual = crossings(preset, Setting::usual(), TICK_S, drive);
        let tick_s = TICK_S / FINER as f64;
        let fine = crossings(preset, Setting::usual().finer(FINER), tick_s, drive);
        assert_eq!((usual.len(), fine.len()), (3, 3));
        // An axle that the step stops at once swings on its tread with this part of its preload. A step
        // of time damps that by half of its angle: so much it takes off the first overshoot.
        let (plant, shear, (speed, preload_n)) = (nominal(preset), nominal(preset).shear(), drive);
        let angle = TICK_S * (1e3 * shear.n_per_mm * shear.stiffening / plant.mass_kg).sqrt();
        let swing = 1e-3 * plant.mass_kg * angle / TICK_S * speed.abs() / preload_n;
        let damped = swing * (1.0 - (-0.5 * PI * angle).exp());
        for (usual, fine) in usual.iter().zip(&fine) {
            assert!(off(usual.gap_mm, fine.gap_mm).abs() < 2.5e-3, "{usual:?} {fine:?}");
            assert!(off(usual.corner_n, fine.corner_n).abs() < 3e-3, "{usual:?} {fine:?}");
            let used = [usual, fine].map(|crossing| crossing.peak_utilisation);
            assert!((used[0] - used[1]).abs() < 5e-3 + damped, "{usual:?} {fine:?} {damped}");
        }
    }
}

#[test]
fn the_error_falls_with_element_and_stride() {
    // First order, where elements and stride are refined together.
    let settings =
        [8, 4, 2, 1].map(|part| Setting { elements: 2880 / part, stride_mm: 0.01 * part as f64 });
    let points = work_precision(&Rig::prototype(), &settings, 1, || ()).unwrap();
    for point in &points {
        let most = 0.006 * point.stride_mm / 0.08;
        assert!(point.gap_error < most, "{points:?}");
        assert!(point.force_error < 1.2 * most, "{points:?}");
    }
}
