//! `rig crossing`: figures of the isolated crossing.

use serde_json::Value;

use super::{folder, good, number, object, refused_in, rig, rig_in, stderr, stdout};

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
fn every_method_prints_the_same_keys_and_the_gap_that_the_ring_was_fitted_to() {
    assert_close(gap(5.0, 100.0, &[]), 1.743, 5e-3);
    for more in [&[][..], &["--driven"], &["--driven", "--retract"]] {
        let ring = gap(5.0, 100.0, more);
        for method in ["ring", "fixed"] {
            let value = crossing(5.0, 100.0, &[more, &["--method", method]].concat());
            assert_eq!(value["method"], method);
            assert_eq!((number(&value, "speed_mm_s"), number(&value, "preload_n")), (5.0, 100.0));
            assert_close(number(&value, "gap_mm"), ring, 0.025);
            for key in ["corner_force_n", "climb_work_mj", "embedding_mm"] {
                assert!(number(&value, key) > 0.0 || more.contains(&"--retract"), "{key}");
            }
            assert_eq!(value.get("mu_needed").is_some(), more.contains(&"--driven"));
        }
    }
}

#[test]
fn along_a_course_that_is_constant_it_is_the_same_and_braking_late_the_gap_is_wider() {
    let at = &folder();
    let course = |rows: &str| {
        let text = format!("x_mm,speed_mm_s,preload_n\n{rows}");
        std::fs::write(at.join("course.csv"), text).expect("written");
    };
    let along = |method: &str| {
        let asked = ["crossing", "--json", "--driven", "--course", "course.csv"];
        let output = rig_in(at, &[&asked[..], &["--method", method]].concat());
        number(&object(&output), "gap_mm")
    };
    for method in ["ring", "fixed"] {
        let asked = "crossing --json --driven --speed-mm-s 8 --preload-n 45 --method";
        let steady = good(&asked.split(' ').chain([method]).collect::<Vec<_>>());
        course("-14,8,45\n");
        let same = along(method);
        assert_eq!(same, number(&steady, "gap_mm"), "{method}");
        // At 8 mm/s only over the last 0.4 mm.
        course("-13.5,30,45\n-12.4,8,45\n");
        let late = along(method);
        assert!(late > same * 1.005 && late < same * 1.06, "{method}: {late} {same}");
    }
    course("-14,8,45\n-14,8,45\n");
    let names = &["course.csv: row 2: x_mm -14"];
    refused_in(at, &["crossing", "--course", "course.csv"], names);
}

#[test]
fn climbing_on_elastic_rubber_costs_the_lift_of_the_preload() {
    let low = ["--set", "tread.stiffening=1", "--set", "rig.step_height_mm=2.5"];
    let low = crossing(20.0, 40.0, &low);
    assert_close(number(&low, "climb_work_mj"), 40.0 * 2.5, 5e-3);
    // Memory takes work of its own.
    let real = crossing(20.0, 40.0, &[]);
    assert!(number(&real, "climb_work_mj") > 1.02 * 40.0 * 4.0, "{real}");
}

#[test]
fn a_wheel_that_sinks_in_has_no_gap_and_exits_with_one() {
    let asked = ["crossing", "--speed-mm-s", "5", "--preload-n", "1000", "--json"];
    for method in ["ring", "fixed"] {
        let output = rig(&[&asked[..], &["--method", method]].concat());
        assert_eq!(output.status.code(), Some(1), "{method}");
        assert!(output.stdout.is_empty());
        let text = stderr(&output);
        assert!(text.starts_with("error: ") && text.contains("no gap"), "{text}");
    }
}

#[test]
fn a_table_is_printed_for_people() {
    let output = rig(&["crossing", "--speed-mm-s", "5", "--preload-n", "33.3", "--driven"]);
    let text = stdout(&output);
    assert!(text.starts_with("Climb at 5 mm/s under 33.3 N, driven against 6.67 N"), "{text}");
    assert!(text.contains("friction needed"), "{text}");
    let json = rig(&["crossing", "--speed-mm-s", "5", "--preload-n", "33.3", "--json"]);
    assert_eq!(json.stdout.iter().filter(|&&byte| byte == b'\n').count(), 1);
    assert_eq!(object(&json)["rig"], "prototype");
}
