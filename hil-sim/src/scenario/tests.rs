use std::path::Path;

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

#[test]
fn an_unknown_key_is_named_with_its_file_and_the_nearest_known_one() {
    assert_eq!(
        error("[tread]\ntau = 0.1\n"),
        "bench.toml: tread.tau: no such key, did you mean tread.tau_s?"
    );
    assert_eq!(
        error("[treads]\ntau_s = 1\n"),
        "bench.toml: treads: no such key, did you mean tread?"
    );
    assert_eq!(
        set_error("plant.my=1"),
        "command line: plant.my: no such key, did you mean plant.mu?"
    );
    assert_eq!(
        set_error("zzz.zzzzzz=1"),
        "command line: zzz.zzzzzz: no such key; `rig keys` lists them"
    );
}

#[test]
fn a_value_of_another_kind_is_refused_with_what_was_expected() {
    assert_eq!(
        set_error("tread.tau_s=abc"),
        "command line: tread.tau_s = \"abc\": expected a number in s"
    );
    assert_eq!(
        error("[tread]\nstiffening = true\n"),
        "bench.toml: tread.stiffening = true: expected a number"
    );
    assert_eq!(
        error("[tread]\ntau_s = nan\n"),
        "bench.toml: tread.tau_s = nan: expected a number in s"
    );
    assert_eq!(
        error("tread = 3\n"),
        "bench.toml: tread = 3: expected a section with keys such as tread.k_inf_pa_per_m"
    );
    assert_eq!(
        set_error("run.controller=clever"),
        "command line: run.controller = \"clever\": expected \"scheduled\" or \"constant\" or \"limit\" or \"reactive\""
    );
    assert_eq!(
        set_error("run.seed=-1"),
        "command line: run.seed = -1: expected a whole number, 0 or more"
    );
    assert_eq!(
        set_error("drive.modes_hz=1,2,3,4,5"),
        "command line: drive.modes_hz = [1, 2, 3, 4, 5]: expected a list of at most 4 numbers in Hz"
    );
    assert_eq!(
        set_error("tread.tau_s"),
        "--set tread.tau_s: expected key=value, as in --set tread.tau_s=0.12"
    );
}

#[test]
fn a_unit_behind_a_number_is_explained() {
    let said = "expected a bare number in s, without the unit: that is part of the key's name";
    assert_eq!(set_error("tread.tau_s=0.1s"), format!("command line: tread.tau_s = 0.1s: {said}"));
    assert_eq!(
        error("[tread]\ntau_s = \"0.1 s\"\n"),
        format!("bench.toml: tread.tau_s = 0.1 s: {said}")
    );
    assert_eq!(
        error("[tread]\nstiffening = 4\ntau_s = 0.1 s # long\n"),
        format!("bench.toml: tread.tau_s = 0.1 s: {said}")
    );
    assert!(set_error("drive.cruise_speed_mm_s=5mm/s").contains("a bare number in mm/s"));
    assert_eq!(
        set_error("tread.stiffening=4x"),
        "command line: tread.stiffening = 4x: expected a bare number, without the unit"
    );
}

#[test]
fn a_value_out_of_range_is_named_with_its_range() {
    assert_eq!(
        set_error("plant.mu=12"),
        "command line: plant.mu = 12: expected a value from 0 to 3"
    );
    assert_eq!(
        error("[spread]\nk_inf_rel = 4.0\n"),
        "bench.toml: spread.k_inf_rel = 4: expected a value from 0 to 0.3"
    );
}

#[test]
fn a_step_table_out_of_order_is_refused() {
    let said = error("[rig]\nstep_positions_mm = [18, 62, 40]\n");
    assert!(
        said.starts_with("bench.toml: rig.step_positions_mm: step 3 stands at 40 mm"),
        "{said}"
    );
}

#[test]
fn a_preload_limit_below_the_cruise_preload_or_the_minimum_is_refused() {
    assert_eq!(
        error("[preload]\nlimit_n = 30\n"),
        "bench.toml: preload.limit_n = 30: expected at least 34.7, that is preload.cruise_n = 33.3 and room to regulate"
    );
    assert_eq!(
        error("[preload]\ncruise_n = 60\n"),
        "bench.toml: preload.limit_n = 50: expected at least 62.5, that is preload.cruise_n = 60 and room to regulate"
    );
    assert_eq!(
        set_error("preload.limit_n=2"),
        "command line: preload.limit_n = 2: expected a value from 5 to 180"
    );
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
    let of = |inside: &str| error(&format!("[[run.anomalies]]\n{inside}\n"));
    assert_eq!(
        of("step = 1"),
        "bench.toml: run.anomalies[1].kind = nothing: expected \"early\" or \"late\" or \"missing\" or \"higher\" or \"extra\""
    );
    assert_eq!(
        of("kind = \"late\"\nstep = 1\noffset = 2"),
        "bench.toml: run.anomalies[1].offset: no such key; kind = \"late\" takes step and offset_mm"
    );
    assert_eq!(
        of("kind = \"extra\""),
        "bench.toml: run.anomalies[1].position_mm = nothing: expected a number in mm"
    );
    assert_eq!(
        of("kind = \"missing\"\nstep = 4"),
        "bench.toml: run.anomalies[1].step = 4: expected a value from 1 to 3"
    );
    assert_eq!(
        of("kind = \"missing\"\nstep = 400"),
        "bench.toml: run.anomalies[1].step = 400: expected a value from 1 to 8"
    );
    assert_eq!(
        of("kind = \"extra\"\nposition_mm = 45"),
        "bench.toml: run.anomalies: steps at 40.0 and 45.0 mm, expected at least 13.6 mm between them"
    );
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
    let tau = keys.iter().find(|k| k.key == "tread.tau_s").unwrap();
    assert_eq!((tau.unit, tau.value.as_float()), ("s", Some(0.1059)));
    assert_eq!(tau.description, "Relaxation time tau, s.");
    assert!(keys.iter().any(|k| k.key == "run.anomalies"));
    assert_eq!(keys[0].key, "preset");
}

#[test]
fn values_that_make_no_plant_are_refused_with_the_one_to_change() {
    let text = set_error("tread.k_inf_pa_per_m=1e7");
    assert!(text.starts_with("command line: preload.limit_n, with the load"), "{text}");
    assert!(text.contains("tread.k_inf_pa_per_m = 1.000e7") && text.contains("at most"), "{text}");
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
    let gain = Injection::at(Target::PreloadSensor, Kind::Gain, 0.0, 1.1);
    assert_eq!(*first, Injection { at_s: None, at_mm: Some(20.0), ..gain });
    assert_eq!((second.at_crossing, second.duration_s), (Some(2), Some(0.5)));
    assert_eq!(second.magnitude(), 1.0, "as the catalogue has it");
    assert_eq!(parse(&scenario.to_toml()), scenario);
}

#[test]
fn every_mistake_of_a_fault_is_named() {
    let fault = |rest: &str| error(&format!("[[run.faults]]\n{rest}"));
    for (rest, said) in [
        ("kind = \"off\"\nat_s = 1", "run.faults[1].target = nothing: expected \"encoder\""),
        (
            "target = \"angel\"\nkind = \"off\"\nat_s = 1",
            "run.faults[1].target = \"angel\": expected \"encoder\"",
        ),
        (
            "target = \"model\"\nkind = \"off\"\nat_s = 1",
            "run.faults[1].kind = \"off\": expected \"hung\"",
        ),
        (
            "target = \"model\"\nkind = \"hung\"",
            "run.faults[1].at_s = nothing: expected one of at_s, at_mm and at_crossing",
        ),
        (
            "target = \"model\"\nkind = \"hung\"\nat_s = 1\nat_mm = 2",
            "run.faults[1].at_s = at_s and at_mm: expected one of",
        ),
        (
            "target = \"model\"\nkind = \"hung\"\nat = 1",
            "run.faults[1].at: no such key; a fault takes target, kind, at_s",
        ),
        (
            "target = \"model\"\nkind = \"hung\"\nat_s = \"1 s\"",
            "run.faults[1].at_s = 1 s: expected a bare number in s",
        ),
        (
            "target = \"model\"\nkind = \"hung\"\nat_s = 1\nmagnitude = 2",
            "run.faults[1].magnitude = 2: expected a value from 0 to 0",
        ),
        (
            "target = \"drive\"\nkind = \"weak\"\nat_s = -1",
            "run.faults[1].at_s = -1: expected a value from 0 to 3600",
        ),
        (
            "target = \"drive\"\nkind = \"weak\"\nat_crossing = 300",
            "run.faults[1].at_crossing = 300: expected a value from 1 to 250",
        ),
    ] {
        let found = fault(rest);
        assert!(found.starts_with("bench.toml: ") && found.contains(said), "{found}");
    }
}
