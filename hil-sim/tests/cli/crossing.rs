//! `rig crossing`: figures of the isolated crossing.

use serde_json::Value;

use super::{good, number, object, rig, stderr, stdout};

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
        for method in ["ring", "reduced", "fixed"] {
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
fn climbing_on_elastic_rubber_costs_the_lift_of_the_preload() {
    let low = ["--set", "tread.stiffening=1", "--set", "rig.step_height_mm=2.5"];
    let low = crossing(20.0, 40.0, &low);
    assert_close(number(&low, "climb_work_mj"), 40.0 * 2.5, 5e-3);
    // Memory takes work of its own.
    let real = crossing(20.0, 40.0, &[]);
    assert!(number(&real, "climb_work_mj") > 1.02 * 40.0 * 4.0, "{real}");
}

#[test]
fn driving_takes_the_published_friction_and_widens_the_gap() {
    let more = ["--driven", "--set", "plant.top_load_n=7", "--set", "plant.top_load_share=1"];
    let driven = crossing(5.0, 33.3, &more);
    assert_close(number(&driven, "mu_needed"), 0.94, 0.02);
    assert_close(number(&driven, "gap_mm"), 2.75, 5e-3);
    assert!(number(&driven, "gap_mm") > gap(5.0, 33.3, &[]));
}

#[test]
fn a_wheel_that_sinks_in_has_no_gap_and_exits_with_one() {
    for method in ["ring", "fixed"] {
        let asked = ["crossing", "--speed-mm-s", "5", "--preload-n", "1000", "--json"];
        let output = rig(&[&asked[..], &["--method", method]].concat());
        assert_eq!(output.status.code(), Some(1));
        assert!(output.stdout.is_empty());
        let text = stderr(&output);
        assert!(text.starts_with("error: ") && text.contains("no gap"), "{text}");
    }
}

#[test]
fn a_course_is_read_from_a_file_and_rolled_by_ring_and_fixed_point() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("course.csv");
    std::fs::write(&path, "x_mm,speed_mm_s,preload_n\n-18,30,40\n-13,10,48\n").unwrap();
    let file = path.to_str().unwrap();
    let gap = |more: &[&str]| {
        let value = good(&[&["crossing", "--json", "--course", file], more].concat());
        assert!(value["course"] == file && value.get("speed_mm_s").is_none(), "{value}");
        number(&value, "gap_mm")
    };
    for more in [&[][..], &["--driven"], &["--retract"]] {
        let fixed = gap(&[more, &["--method", "fixed"]].concat());
        assert_close(fixed, gap(more), 7e-3);
    }
    // What is not slowed down yet has a wider gap.
    let fast = ["crossing", "--json", "--speed-mm-s", "30", "--preload-n", "40"];
    assert!(number(&good(&fast), "gap_mm") > 1.02 * gap(&[]));
    let text = stdout(&rig(&["crossing", "--course", file])).to_owned();
    assert!(text.starts_with("Climb by ") && text.contains("course.csv"), "{text}");
}

#[test]
fn a_course_that_cannot_be_rolled_is_refused_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("course.csv");
    let file = path.to_str().unwrap();
    let refused = |more: &[&str]| {
        let output = rig(&[&["crossing", "--course", file], more].concat());
        assert_eq!(output.status.code(), Some(2));
        stderr(&output)
    };
    assert!(refused(&[]).contains("course.csv"));
    std::fs::write(&path, "x_mm,speed_mm_s,preload_n\n-18,30,40\n-13,0,48\n").unwrap();
    let text = refused(&[]);
    let expected = "row 2, column speed_mm_s: 0: expected a value above 0, at most 2000 mm/s";
    assert!(text.contains(expected) && text.trim_end().lines().count() == 1, "{text}");
    std::fs::write(&path, "x_mm,speed_mm_s,preload_n\n-18,30,40\n-13,9,48\n").unwrap();
    assert!(refused(&["--method", "reduced"]).contains("expected --method ring or fixed"));
    assert!(refused(&["--speed-mm-s", "5"]).contains("--course"));
}

#[test]
fn an_answer_outside_the_fit_says_so() {
    for (speed, preload, fits) in
        [(5.0, 100.0, true), (5.0, 300.0, false), (5.0, 1000.0, false), (150.0, 100.0, false)]
    {
        for method in ["reduced", "fixed"] {
            if (method, preload) == ("fixed", 1000.0) {
                // It sinks in, as the ring does.
                continue;
            }
            let value = crossing(speed, preload, &["--method", method]);
            assert_eq!(value["in_range"], fits, "{speed} {preload} {method}");
            assert!(number(&value, "gap_mm") > 0.0);
        }
    }
    // The ring has no range.
    assert_eq!(crossing(150.0, 100.0, &[])["in_range"], true);
    let asked = ["crossing", "--speed-mm-s", "5", "--preload-n", "300", "--method", "reduced"];
    let text = stdout(&rig(&asked)).to_owned();
    assert!(text.contains("Out of the range") && text.contains("preload 300"), "{text}");
    let text = stdout(&rig(&["crossing", "--speed-mm-s", "5", "--preload-n", "100"])).to_owned();
    assert!(!text.contains("range"), "{text}");
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
