//! The campaign of faults at a few instants each: nothing undetected, nothing unsafe, and urgent
//! faults are found at once. `cargo rig faults` is the complete campaign.

use crate::common::overridden;
use hil_sim::faults::campaign::{Case, FaultCampaign, MatrixRow, Outcome, twin, watched};
use hil_sim::scenario::Scenario;
use hil_sim::scenario::injection::{Injection, Kind, Target};
use hil_sim::session::{Options, run};
use hil_sim::testing::long;
use interstage::sense::raw::SensorId;

fn campaign_on(scenario: Scenario, instants: usize, wanted: impl Fn(&str) -> bool) -> Outcome {
    let cases = Case::all().into_iter().filter(|case| wanted(&case.name())).collect();
    let campaign = FaultCampaign { scenario, instants, cases };
    campaign.on("sil", twin, watched).complete(&|| {}).expect("a campaign")
}

fn campaign(instants: usize, wanted: impl Fn(&str) -> bool) -> Outcome {
    campaign_on(Scenario::default(), instants, wanted)
}

fn line<'a>(outcome: &'a Outcome, fault: &str) -> &'a MatrixRow {
    outcome.matrix.iter().find(|line| line.fault == fault).expect(fault)
}

#[test]
fn every_fault_is_found_or_tolerated_and_the_mechanism_held() {
    let outcome = campaign(4, |_| true);
    assert!(outcome.matrix.len() > 50);
    let failures: Vec<_> = outcome.matrix.iter().flat_map(|line| &line.failures).collect();
    assert_eq!((outcome.undetected, outcome.unheld), (0, 0), "{failures:#?}");
}

#[test]
fn urgent_faults_are_found_at_once_and_a_silent_sensor_within_its_age() {
    let faults = [
        ("drive runaway", 128, 10.0),
        ("pretightener runaway", 129, 10.0),
        ("tick overrun", 160, 10.0),
        ("encoder off", 101, 25.0),
        ("preload-sensor off", 102, 25.0),
        ("compression-sensor off", 103, 25.0),
        ("angle off", 104, 25.0),
    ];
    let n = if long() { 100 } else { 20 };
    let outcome = campaign(n, |name| faults.iter().any(|(fault, ..)| name == *fault));
    for (fault, code, within_ms) in faults {
        let line = line(&outcome, fault);
        assert!(line.found + line.tolerated == n && 10 * line.found >= 9 * n, "{line:?}");
        assert_eq!(line.code, Some(code), "{line:?}");
        assert!(line.latency_ms.is_some_and(|ms| ms <= within_ms), "{line:?}");
    }
}

#[test]
fn an_encoder_that_reads_too_little_is_found_on_a_corner_as_well() {
    let outcome = campaign(if long() { 200 } else { 40 }, |name| name == "encoder gain");
    assert_eq!((outcome.undetected, outcome.unheld), (0, 0), "{outcome:#?}");
}

#[test]
fn a_bridge_that_regulates_its_current_is_no_fault_of_the_bridge() {
    let outcome = campaign(if long() { 200 } else { 40 }, |name| name.ends_with("regulating"));
    assert_eq!((outcome.undetected, outcome.unheld), (0, 0), "{outcome:#?}");
    assert_eq!(outcome.matrix.len(), 2);
    for line in &outcome.matrix {
        assert!(line.codes.keys().all(|code| !matches!(code, 128 | 129)), "{line:?}");
    }
}

#[test]
fn a_campaign_is_the_same_on_any_number_of_processors() {
    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
    let some = |name: &str| name == "angle stuck" || name == "commands random";
    let text = |outcome: &Outcome| serde_json::to_string(outcome).expect("JSON");
    assert_eq!(text(&alone.install(|| campaign(3, some))), text(&campaign(3, some)));
}

#[test]
fn a_run_with_a_fault_of_its_scenario_ends_in_it_and_reports_it() {
    let mut scenario = Scenario::default();
    let stuck = Injection::at(Target::Sensor(SensorId::PreloadSensor), Kind::Stuck, 0.0, 0.0);
    scenario.run.faults = vec![Injection { at_s: None, at_mm: Some(10.0), ..stuck }];
    let recording = run(&scenario, Options::ROWS).expect("a run");
    let summary = recording.summary;
    assert_eq!(summary.faults.iter().map(|fault| fault.code).collect::<Vec<_>>(), [116]);
    assert!(!summary.completed && (10.0..14.0).contains(&summary.travel_mm), "{summary:?}");
    assert_eq!(summary.injected, ["preload-sensor stuck from 10 mm"]);
    let off = Injection::at(Target::Sensor(SensorId::WheelEncoder), Kind::Off, 2.5, 0.0);
    assert_eq!(off.words(Some(0.357)), "encoder off from 2.143 s (2.5 s from boot)");
    assert_eq!(off.words(None), "encoder off from 2.5 s");
}

#[test]
fn an_encoder_that_counts_too_few_is_not_taken_for_a_load() {
    // From before the tread and the drive are judged, at which the duty shows the load.
    for (seed, at_s) in [(32, 1.211), (35, 1.147)] {
        let mut scenario = Scenario::default();
        scenario.run.seed = seed;
        let encoder = Target::Sensor(SensorId::WheelEncoder);
        scenario.run.faults = vec![Injection::at(encoder, Kind::Gain, at_s, 2.0 / 3.0)];
        let summary = run(&scenario, Options::default()).expect("a run").summary;
        let fault = summary.faults.first().expect("a fault");
        assert!(fault.code == 125 && fault.t_s < at_s + 1.0, "{fault:?}");
    }
}

#[test]
fn the_whole_top_load_on_one_wheel_is_a_load() {
    let scenario = Scenario::default().with(&["mismatch.weight_n=13.3".to_owned()]);
    let summary = run(&scenario.expect("in range"), Options::default()).expect("a run").summary;
    assert!(summary.faults.iter().all(|fault| fault.code != 125), "{:?}", summary.faults);
}

#[test]
fn a_compression_sensor_that_is_far_off_from_before_boot_is_reported() {
    let reported = |preset: &str, gain: f64| {
        let mut scenario = Scenario::named(preset).expect("a preset");
        scenario.run.faults =
            vec![Injection::at(Target::Sensor(SensorId::CompressionSensor), Kind::Gain, 0.0, gain)];
        let summary = run(&scenario, Options::default()).expect("a run").summary;
        // At rest, by the gap of the first crossing, or by steps that are not in their places.
        let limited = summary.limits.iter().any(|limit| matches!(limit.code, 211 | 212));
        limited || summary.faults.iter().any(|fault| fault.code == 124)
    };
    for preset in ["prototype", "fe"] {
        assert!(reported(preset, 1.4), "{preset}: too much");
        assert!(reported(preset, 0.75), "{preset}: too little");
        assert!(!reported(preset, 1.03) && !reported(preset, 0.97), "{preset}");
    }
}

#[test]
fn a_log_without_a_reader_does_not_change_the_run() {
    let clean = Scenario::default();
    let mut gone = clean.clone();
    gone.run.faults = vec![Injection::at(Target::Log, Kind::Gone, 1.0, 0.0)];
    let run = |scenario: &Scenario| run(scenario, Options::ROWS).expect("a run");
    let (clean, gone) = (run(&clean), run(&gone));
    assert_eq!(clean.summary.trace_digest, gone.summary.trace_digest);
    assert!(gone.stream.len() < clean.stream.len() / 2);
}

#[test]
fn a_long_travel_at_a_low_speed_is_given_its_time() {
    let slow =
        |travel, steps| overridden("prototype", &["drive.cruise_speed_mm_s=5", travel, steps]);
    // 200 s, and 60 s each way.
    let out = slow("rig.travel_mm=1000", "rig.step_positions_mm=[200, 500, 800]");
    let summary = run(&out, Options::default()).expect("a run").summary;
    assert!(summary.completed && summary.duration_s > Some(190.0), "{summary:?}");
    let both = slow("rig.travel_mm=300", "rig.step_positions_mm=[18, 40, 62]");
    let outcome = campaign_on(both, 1, |name| name == "log gone");
    assert_eq!((outcome.undetected, outcome.unheld), (0, 0), "{outcome:#?}");
}
