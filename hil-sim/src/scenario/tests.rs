use std::path::Path;

use interstage::sense::raw::SensorId;

use super::injection::{Injection, Kind, Target};
use super::*;

fn error(text: &str) -> String {
    Scenario::parse("bench.toml", text, &[]).expect_err(text).to_string()
}

fn set_error(text: &str) -> String {
    Scenario::resolve(None, None, &[text.to_owned()]).expect_err(text).to_string()
}

#[test]
fn presets_are_complete_scenarios() {
    for preset in PRESETS {
        let scenario = Scenario::named(preset).unwrap();
        scenario.validate().unwrap();
        assert_eq!(scenario.rig, Rig::named(preset).unwrap());
    }
}

#[test]
fn toml_is_read_back_as_written() {
    let mut scenario = Scenario::named("fe").unwrap();
    scenario.run.seed = 7;
    scenario.run.anomalies = vec![
        StepAnomaly::Late { step: 2, offset_mm: 1.5 },
        StepAnomaly::Missing { step: 3 },
        StepAnomaly::Extra { position_mm: 60.0 },
    ];
    let text = scenario.to_toml();
    assert_eq!(Scenario::parse("again", &text, &[]).unwrap(), scenario);
    assert!(text.starts_with("preset = \"fe\"\n\n[rig]\n"), "{text}");
}

#[test]
fn file_overrides_preset_and_command_line_overrides_file() {
    let text = "preset = \"fe\"\n[tread]\ntau_s = 0.2\nstiffening = 4\n[run]\nseed = 3\n";
    let sets = ["tread.tau_s=0.3", "run.direction=retract"].map(str::to_owned);
    let scenario = Scenario::parse("bench.toml", text, &sets).unwrap();
    assert_eq!(scenario.preset, "fe");
    assert_eq!(scenario.rig.preload.cruise_n, 100.0);
    assert_eq!(scenario.rig.tread.tau_s, 0.3);
    assert_eq!(scenario.rig.tread.stiffening, 4.0, "an integer is a number too");
    assert_eq!(scenario.run.seed, 3);
    assert_eq!(scenario.run.direction, Direction::Retract);
}

#[test]
fn the_preset_of_the_command_line_overrides_that_of_the_file() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("bench.toml");
    std::fs::write(&path, "preset = \"fe\"\n").unwrap();
    let of = |preset| Scenario::resolve(preset, Some(&path), &[]).unwrap().preset;
    assert_eq!(of(None), "fe");
    assert_eq!(of(Some("prototype")), "prototype");
    let sets = ["preset=prototype".to_owned()];
    assert_eq!(Scenario::resolve(None, Some(&path), &sets).unwrap().preset, "prototype");
}

#[test]
fn lists_and_anomalies_can_be_set_on_the_command_line() {
    let sets = [
        "rig.step_positions_mm=20,42",
        "run.anomalies=[{ kind = \"early\", step = 2, offset_mm = 2 }]",
    ]
    .map(str::to_owned);
    let scenario = Scenario::resolve(None, None, &sets).unwrap();
    assert_eq!(scenario.rig.rig.step_positions_mm.as_slice(), [20.0, 42.0]);
    assert_eq!(scenario.true_steps(), [(20.0, 0.0), (40.0, 0.0)]);
}

/// Each override is refused with this message after the origin.
fn refused_sets(cases: &[(&str, &str)]) {
    for (text, message) in cases {
        assert_eq!(set_error(text), format!("command line: {message}"));
    }
}

/// Each file is refused with this message after its name.
fn refused_files(cases: &[(&str, &str)]) {
    for (text, message) in cases {
        assert_eq!(error(text), format!("bench.toml: {message}"));
    }
}

#[test]
fn an_unknown_key_is_named_with_its_file_and_the_nearest_known_one() {
    refused_files(&[
        ("[tread]\ntau = 0.1\n", "tread.tau: no such key, did you mean tread.tau_s?"),
        ("[treads]\ntau_s = 1\n", "treads: no such key, did you mean tread?"),
    ]);
    refused_sets(&[
        ("plant.my=1", "plant.my: no such key, did you mean plant.mu?"),
        ("zzz.zzzzzz=1", "zzz.zzzzzz: no such key; `rig keys` lists them"),
    ]);
}

#[test]
fn a_value_of_another_kind_is_refused_with_what_was_expected() {
    let section = "tread = 3: expected a section with keys such as tread.k_inf_pa_per_m";
    refused_files(&[
        ("[tread]\nstiffening = true\n", "tread.stiffening = true: expected a number"),
        ("[tread]\ntau_s = nan\n", "tread.tau_s = nan: expected a number in s"),
        ("tread = 3\n", section),
    ]);
    let words = "\"scheduled\" or \"constant\" or \"limit\" or \"reactive\"";
    let modes = "[1, 2, 3, 4, 5]: expected a list of at most 4 numbers in Hz";
    refused_sets(&[
        ("tread=3", section),
        ("tread.tau_s=abc", "tread.tau_s = \"abc\": expected a number in s"),
        ("run.controller=clever", &format!("run.controller = \"clever\": expected {words}")),
        ("run.seed=-1", "run.seed = -1: expected a whole number, 0 or more"),
        ("drive.modes_hz=1,2,3,4,5", &format!("drive.modes_hz = {modes}")),
    ]);
    let example = "as in --set tread.tau_s=0.12";
    assert_eq!(
        set_error("tread.tau_s"),
        format!("--set tread.tau_s: expected key=value, {example}")
    );
}

#[test]
fn a_unit_behind_a_number_is_explained() {
    let bare = "expected a bare number in s, without the unit: that is part of the key's name";
    let spaced = format!("tread.tau_s = 0.1 s: {bare}");
    refused_sets(&[
        ("tread.tau_s=0.1s", &format!("tread.tau_s = 0.1s: {bare}")),
        ("tread.stiffening=4x", "tread.stiffening = 4x: expected a bare number, without the unit"),
    ]);
    refused_files(&[
        ("[tread]\ntau_s = \"0.1 s\"\n", &spaced),
        ("[tread]\nstiffening = 4\ntau_s = 0.1 s # long\n", &spaced),
    ]);
    assert!(set_error("drive.cruise_speed_mm_s=5mm/s").contains("a bare number in mm/s"));
}

#[test]
fn a_value_out_of_range_is_named_with_its_range() {
    refused_sets(&[
        ("plant.mu=12", "plant.mu = 12: expected a value from 0 to 3"),
        ("preload.limit_n=2", "preload.limit_n = 2: expected a value from 5 to 180"),
    ]);
    let room = "preload.limit_n = 30: expected at least 34.9, as preload.cruise_n = 33.3";
    let below = "preload.cruise_n = 60: expected at most 47.8, as preload.limit_n = 50";
    refused_files(&[
        ("[spread]\nk_inf_rel = 4.0\n", "spread.k_inf_rel = 4: expected a value from 0 to 0.3"),
        ("[preload]\nlimit_n = 30\n", room),
        ("[preload]\ncruise_n = 60\n", below),
    ]);
}

#[test]
fn an_error_names_the_key_that_was_set_and_the_bound_that_it_broke() {
    for (set, parts) in [
        ("preload.cruise_n=60", &[" = 60", "at most 47.", "preload.limit_n = 50"][..]),
        ("preload.limit_n=20", &[" = 20", "at least 34.", "preload.cruise_n = 33.3"]),
        ("drive.cruise_speed_mm_s=90", &[" = 90", "at most"]),
        ("drive.cruise_speed_mm_s=4", &[" = 4", "at least 5"]),
        ("control.safe_speed_mm_s=60", &[" = 60", "at most"]),
        ("rig.step_positions_mm=18,40,95", &["step 3 is at 95 mm", "at most 80"]),
        ("rig.step_positions_mm=18,62,40", &["step 3 ", " at 40 mm"]),
        ("rig.step_positions_mm=18,20,62", &["step 2 is at 20 mm", "at least"]),
        ("rig.travel_mm=50", &[" = 50", "at least 62"]),
        ("rig.wheel_radius_mm=120", &[" = 120"]),
        ("rig.wall_radius_mm=400", &[" = 400"]),
    ] {
        let said = set_error(set);
        let key = set.split('=').next().unwrap();
        assert!(said.starts_with(&format!("command line: {key}")), "{said}");
        assert!(
            said.lines().count() == 1 && parts.iter().all(|part| said.contains(part)),
            "{said}"
        );
    }
}

#[test]
fn a_file_that_cannot_be_read_or_is_not_toml_is_named() {
    let said = Scenario::resolve(None, Some(Path::new("no/such.toml")), &[]).unwrap_err();
    assert!(said.to_string().starts_with("no/such.toml: cannot be read: "), "{said}");
    let said = error("[tread]\ntau_s 0.1\n");
    assert!(said.starts_with("bench.toml, line 2: not valid TOML: "), "{said}");
    let said = error("[run]\nseed = 1\nseed = 2\n");
    assert!(said.starts_with("bench.toml, line 3: not valid TOML: duplicate key"), "{said}");
    assert_eq!(
        error("preset = \"big\"\n"),
        "bench.toml: preset = \"big\": expected \"prototype\" or \"fe\""
    );
}

#[test]
fn anomalies_are_checked_key_by_key() {
    let kinds = "\"early\" or \"late\" or \"missing\" or \"higher\" or \"extra\"";
    for (inside, message) in [
        ("step = 1", &*format!("[1].kind = nothing: expected {kinds}")),
        (
            "kind = \"late\"\nstep = 1\noffset = 2",
            "[1].offset: no such key; kind = \"late\" takes step and offset_mm",
        ),
        ("kind = \"extra\"", "[1].position_mm = nothing: expected a number in mm"),
        ("kind = \"missing\"\nstep = 4", "[1].step = 4: expected a value from 1 to 3"),
        ("kind = \"missing\"\nstep = 400", "[1].step = 400: expected a value from 1 to 8"),
        (
            "kind = \"extra\"\nposition_mm = 45",
            ": steps at 40.0 and 45.0 mm, expected at least 13.6 mm between them",
        ),
    ] {
        let text = format!("[[run.anomalies]]\n{inside}\n");
        refused_files(&[(&text, &format!("run.anomalies{message}"))]);
    }
}

#[test]
fn every_message_is_one_line() {
    for text in ["a = \"\"\"\nx", "rig = [\n1,\n2]\n", "[rig]\nx = { y = [\n] }"] {
        assert!(!error(text).contains('\n'), "{text}");
    }
}

#[test]
fn keys_have_unit_value_and_description() {
    let keys = Scenario::default().keys();
    let of = |name: &str| keys.iter().find(|k| k.key == name).unwrap();
    let tau = of("tread.tau_s");
    assert_eq!((tau.unit, tau.value.as_float()), ("s", Some(0.1059)));
    assert_eq!((of("drive.jerk_mm_s3").unit, of("tread.stiffening").unit), ("mm/s^3", ""));
    assert_eq!(tau.description, "Relaxation time tau, s.");
    assert!(keys.iter().any(|k| k.key == "run.anomalies"));
    assert_eq!(keys[0].key, "preset");
}

#[test]
fn values_that_make_no_plant_are_refused_with_the_one_to_change() {
    let text = set_error("tread.k_inf_pa_per_m=1e7");
    let said = "command line: tread.k_inf_pa_per_m = 10000000.0 does not fit \
                sense.tread_full_scale_mm = 5, of which it expects at least 9.82: ";
    assert!(text.starts_with(said), "{text}");
    assert_eq!(text.lines().count(), 1);
}

#[test]
fn faults_are_read_and_written_back() {
    let text = "[[run.faults]]\ntarget = \"preload-sensor\"\nkind = \"gain\"\nat_mm = 20\n\
                magnitude = 1.1\n[[run.faults]]\ntarget = \"drive\"\nkind = \"runaway\"\n\
                at_crossing = 2\nduration_s = 0.5\n";
    let parse = |text: &str| Scenario::parse("bench.toml", text, &[]).unwrap();
    let scenario = parse(text);
    let [first, second] = scenario.run.faults.as_slice() else { panic!("two") };
    let gain = Injection::at(Target::Sensor(SensorId::PreloadSensor), Kind::Gain, 0.0, 1.1);
    assert_eq!(*first, Injection { at_s: None, at_mm: Some(20.0), ..gain });
    assert_eq!((second.at_crossing, second.duration_s), (Some(2), Some(0.5)));
    assert_eq!(second.magnitude(), 1.0, "as the catalogue has it");
    assert_eq!(parse(&scenario.to_toml()), scenario);
}

#[test]
fn every_mistake_of_a_fault_is_named() {
    let near = "target = \"preload_sensor\": no such target, did you mean \"preload-sensor\"?";
    for (target, kind, rest, message) in [
        ("angel", "off", "at_s = 1", "target = \"angel\": no such target, did you mean \"angle\"?"),
        ("preload_sensor", "stuck", "at_s = 2", near),
        (
            "preload-sensor",
            "stock",
            "at_s = 2",
            "kind = \"stock\": no such kind, did you mean \"stuck\"?",
        ),
        ("model", "off", "at_s = 1", "kind = \"off\": expected \"hung\""),
        ("model", "hung", "", "at_s = nothing: expected one of at_s, at_mm and at_crossing"),
        ("model", "hung", "at_s = 1\nat_mm = 2", "at_s = at_s and at_mm: expected one of"),
        ("model", "hung", "at = 1", "at: no such key; a fault takes target, kind, at_s"),
        ("model", "hung", "at_s = \"1 s\"", "at_s = 1 s: expected a bare number in s"),
        ("model", "hung", "at_s = 1\nmagnitude = 2", "magnitude = 2: expected a value from 0 to 0"),
        ("drive", "weak", "at_s = -1", "at_s = -1: expected a value from 0 to 3600"),
        ("drive", "weak", "at_crossing = 300", "at_crossing = 300: expected a value from 1 to 250"),
    ] {
        let fault = format!("[[run.faults]]\ntarget = \"{target}\"\nkind = \"{kind}\"\n{rest}");
        let (found, message) = (error(&fault), format!("bench.toml: run.faults[1].{message}"));
        assert!(found.starts_with(&message), "{found}");
    }
    let found = error("[[run.faults]]\nkind = \"off\"\nat_s = 1");
    assert!(found.contains("].target = nothing: expected \"angle\" or \"angle-bus\""), "{found}");
}

#[test]
fn what_makes_no_wheel_is_drawn_again() {
    let draw = |word: &str, seed: u64| {
        // Thin enough that a soft one is crushed.
        let thin = "tread.thickness_mm=5.25".to_owned();
        let sets = [format!("run.mismatch={word}"), format!("run.seed={seed}"), thin];
        Scenario::named("fe").expect("a preset").with(&sets)
    };
    for word in ["wide", "adversarial"] {
        let mut again = 0;
        for seed in 1..=100 {
            let scenario = draw(word, seed).expect("a wheel");
            assert_eq!(scenario.drawn_mismatch(), scenario.drawn_mismatch());
            let beyond = if word == "wide" { &[] } else { ADVERSARIAL };
            again += usize::from(scenario.drawn_mismatch() != scenario.mismatch.draw(seed, beyond));
        }
        assert!((1..50).contains(&again), "{word}: {again}");
    }
}
