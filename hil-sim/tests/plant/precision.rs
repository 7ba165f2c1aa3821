//! Error of the usual setting against one twenty times as fine, and how it falls.

use hil_sim::plant::precision::{FINER, Setting, crossings, work_precision};
use interstage::rig::Rig;

use super::bench::{TICK_S, nominal, off};

#[test]
fn an_isolated_crossing_is_within_its_error() {
    let points = work_precision(&Rig::prototype(), &[Setting::usual()], 1, || ()).unwrap();
    assert!(points[0].gap_error < 2e-3, "{points:?}");
    assert!(points[0].force_error < 3e-3, "{points:?}");
}

#[test]
fn a_crossing_inside_a_deployment_is_within_its_error() {
    for way in [(25.0, 48.0), (8.0, 33.3), (-8.0, 33.3)] {
        let plant = nominal("prototype");
        let usual = crossings(&plant, Setting::usual(), TICK_S, way).unwrap();
        let tick = TICK_S / FINER as f64;
        let fine = crossings(&plant, Setting::usual().finer(FINER), tick, way).unwrap();
        assert_eq!((usual.len(), fine.len()), (3, 3));
        for (usual, fine) in usual.iter().zip(&fine) {
            assert!(off(usual.gap_mm, fine.gap_mm).abs() < 2.5e-3, "{usual:?} {fine:?}");
            assert!(off(usual.corner_n, fine.corner_n).abs() < 3e-3, "{usual:?} {fine:?}");
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
