//! `rig crossing`: figures of the isolated crossing.

use serde_json::Value;

use super::{good, number, object, rig};

/// A crossing on the study's rig.
fn crossing(speed: f64, preload: f64, more: &[&str]) -> Value {
    let (speed, preload) = (speed.to_string(), preload.to_string());
    let asked = ["crossing", "--json", "--rig", "fe", "--speed-mm-s", &speed];
    good(&[&asked, &["--preload-n", &preload][..], more].concat())
}

fn gap(speed: f64, preload: f64, more: &[&str]) -> f64 {
    number(&crossing(speed, preload, more), "gap_mm")
}

fn assert_close(found: f64, expected: f64, within: f64) {
    assert!((found / expected - 1.0).abs() < within, "{found}, expected {expected}");
}

#[test]
fn the_ring_gives_the_gaps_that_it_was_fitted_to() {
    for (speed, preload, expected) in
        [(5.0, 100.0, 1.743), (5.0, 120.0, 1.562), (8.0, 100.0, 1.902)]
    {
        assert_close(gap(speed, preload, &[]), expected, 5e-3);
    }
}

#[test]
fn the_reduced_model_follows_the_ring() {
    for method in ["reduced", "fixed"] {
        for (speed, preload) in [(3.0, 80.0), (5.0, 100.0), (12.0, 120.0)] {
            for more in [&[][..], &["--driven"][..], &["--driven", "--retract"][..]] {
                let ring = gap(speed, preload, more);
                let found = gap(speed, preload, &[more, &["--method", method]].concat());
                assert_close(found, ring, 0.025);
            }
        }
    }
}

#[test]
fn climbing_on_elastic_rubber_costs_the_lift_of_the_preload() {
    for (speed, preload) in [(5.0, 100.0), (20.0, 40.0)] {
        let elastic = crossing(speed, preload, &["--set", "tread.stiffening=1"]);
        assert_close(number(&elastic, "climb_work_mj"), preload * 4.0, 5e-3);
        let low = ["--set", "tread.stiffening=1", "--set", "rig.step_height_mm=2.5"];
        let low = crossing(speed, preload, &low);
        assert_close(number(&low, "climb_work_mj"), preload * 2.5, 5e-3);
        // Memory takes work of its own.
        let real = crossing(speed, preload, &[]);
        assert!(number(&real, "climb_work_mj") > 1.02 * preload * 4.0, "{real}");
    }
}

#[test]
fn the_gap_falls_with_preload_and_grows_with_speed() {
    let speeds = [2.0, 5.0, 12.0, 30.0];
    let preloads = [40.0, 70.0, 110.0, 150.0];
    for method in ["ring", "reduced", "fixed"] {
        let gaps = speeds.map(|v| preloads.map(|p| gap(v, p, &["--method", method])));
        for row in &gaps {
            assert!(row.windows(2).all(|pair| pair[1] < pair[0]), "{method}: {gaps:?}");
        }
        for pair in gaps.windows(2) {
            let grows = pair[0].iter().zip(&pair[1]).all(|(slow, fast)| fast > slow);
            assert!(grows, "{method}: {gaps:?}");
        }
    }
}

#[test]
fn every_method_prints_the_same_keys() {
    let required = ["gap_mm", "corner_force_n", "climb_work_mj", "embedding_mm"];
    for method in ["ring", "reduced", "fixed"] {
        for (more, driven) in [(&[][..], false), (&["--driven"][..], true)] {
            let value = crossing(5.0, 100.0, &[more, &["--method", method]].concat());
            assert_eq!(value["method"], method);
            assert_eq!((number(&value, "speed_mm_s"), number(&value, "preload_n")), (5.0, 100.0));
            for key in required {
                assert!(number(&value, key) > 0.0, "{key}");
            }
            assert_eq!(value.get("mu_needed").is_some(), driven);
        }
    }
}

#[test]
fn driving_takes_the_published_friction_and_widens_the_gap() {
    // Ring figures at rig loads: utilisation at most, and gap, with 0 and 7 N to lift.
    for (load, mu, expected) in [("0", 0.60, 2.69), ("7", 0.94, 2.75)] {
        let load = format!("plant.top_load_n={load}");
        let more = ["--driven", "--set", &load, "--set", "plant.top_load_share=1"];
        let driven = crossing(5.0, 33.3, &more);
        assert_close(number(&driven, "mu_needed"), mu, 0.02);
        assert_close(number(&driven, "gap_mm"), expected, 5e-3);
        assert!(number(&driven, "gap_mm") > gap(5.0, 33.3, &[]));
    }
}

#[test]
fn a_wheel_that_sinks_in_ends_with_one_and_says_why() {
    let output = rig(&["crossing", "--speed-mm-s", "5", "--preload-n", "1000", "--json"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(output.stdout.is_empty());
    let text = String::from_utf8(output.stderr).unwrap();
    assert!(text.starts_with("error: ") && text.contains("no gap"), "{text}");
}

#[test]
fn a_table_is_printed_for_people() {
    let output = rig(&["crossing", "--speed-mm-s", "5", "--preload-n", "33.3", "--driven"]);
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(text.starts_with("Climb at 5 mm/s under 33.3 N, driven against 6.67 N"), "{text}");
    assert!(text.contains("friction needed"), "{text}");
    let json = rig(&["crossing", "--speed-mm-s", "5", "--preload-n", "33.3", "--json"]);
    assert_eq!(json.stdout.iter().filter(|&&byte| byte == b'\n').count(), 1);
    assert_eq!(object(&json)["rig"], "prototype");
}
