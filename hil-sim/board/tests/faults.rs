//! The campaign of faults on the emulated board, a few of them at one instant each, and a
//! scenario's faults in a run on the board. `cargo rig faults --target board` runs all.

use hil_sim::faults::campaign::{Case, MatrixRow};
use hil_sim::faults::sets;
use hil_sim::scenario::Scenario;
use hil_sim::scenario::injection::{Entry, HARDWARE, Injection, Kind, Target};
use rig_board::bench::Bench;
use rig_board::chip::map::PARAMETER_SETS;

use crate::common::{Board, elf, ran, strings, tried};

/// The rows of these faults with what is told of each, at an instant each; in short every second.
fn matrix<T: Copy>(faults: &[(&str, T)]) -> Vec<(MatrixRow, T)> {
    let step = if hil_sim::testing::long() { 1 } else { 2 };
    let told: std::collections::HashMap<&str, T> = faults.iter().copied().step_by(step).collect();
    let named = |case: &Case| told.contains_key(&*case.name());
    let lines = tried(Case::all_on_board().into_iter().filter(named).collect(), 1).matrix;
    assert_eq!(lines.len(), told.len());
    lines.into_iter().map(|line| (line.clone(), told[&*line.fault])).collect()
}

#[test]
fn faults_on_the_board_are_detected_or_tolerated_and_every_bound_is_kept() {
    let faults = [
        ("preload-sensor off", Some(102)),
        ("encoder-line-a off", Some(123)),
        ("angle-bus off", Some(104)),
        ("dma stalled", Some(102)),
        ("drive runaway", Some(128)),
        ("tick overrun", Some(160)),
        ("log gone", None),
        ("host-line flooding", None),
        ("supply off", None),
        ("journal-task hung", None),
        ("compression-sensor-task hung", None),
        ("angle-bus disturbed", None),
        ("magnet gone", Some(106)),
        ("drive regulating", None),
        ("pretightener regulating", None),
        ("stop-wire off", Some(151)),
        ("stop-wire shorted", Some(128)),
        // The motors lose their power for the halt, so the wheel lags.
        ("debugger halted", Some(123)),
        ("image one-wrong-bit", None),
    ];
    for (line, code) in matrix(&faults) {
        // A sensor that reads the low end is out of its range before it is missed, and of the two
        // that one stream delivers either may be missed first.
        let alike =
            line.code == code || code == Some(102) && [Some(112), Some(103)].contains(&line.code);
        assert!(alike, "{line:?}");
        let restarted = match &*line.fault {
            "supply off" => Some("reset by supply"),
            name if name.ends_with("task hung") => Some("reset by watchdog"),
            _ => None,
        };
        assert_eq!(line.restarted(), restarted, "{line:?}");
    }
}

/// The very bit of `memcpy` after which no start comes to its first word.
#[test]
fn damage_that_only_the_light_reports_is_found() {
    let copies = Board::off(&[]).function("compiler_builtins::mem::memcpy");
    let bit = f64::from(8 * (copies + 0x115 - 0x0800_0000) + 4);
    let image = HARDWARE.iter().find(|entry| entry.target == Target::Image).expect("an image");
    let entry = Box::leak(Box::new(Entry { range: (bit, bit), ..*image }));
    let outcome = tried(vec![Case(entry)], 1);
    let line = &outcome.matrix[0];
    assert_eq!(line.restarted(), Some("image damaged, by the light alone"), "{line:#?}");
    let latency_ms = line.latency_ms.expect("a latency");
    assert!((1.0..13_000.0).contains(&latency_ms), "{line:#?}");
    assert!(line.worst_motion_mm < 0.75, "{line:#?}");
}

#[test]
fn parameters_in_flash_are_the_old_ones_the_new_ones_or_named_as_damaged() {
    let faults = [
        ("stored-set bit-errors", Some("parameters damaged")),
        ("spare-set bit-errors", None),
        ("image-set bit-errors", Some("parameters damaged")),
        ("stored-set two-wrong-bits", Some("parameters damaged")),
        ("spare-set two-wrong-bits", None),
        ("option-bytes off", Some("flash: one bank")),
        ("parameter-save torn", Some("reset by supply")),
        ("parameter-save reset", Some("reset by pin")),
    ];
    for (line, restart) in matrix(&faults) {
        // A limit that comes now and then without a fault too, as 209, is none of it.
        let no_fault = line.codes.keys().all(|code| *code >= 200);
        assert!(line.restarted() == restart && no_fault, "{line:?}");
    }
}

#[test]
fn a_scenario_can_damage_a_stored_set_and_restart_the_board() {
    let text = "[[run.faults]]\ntarget = \"stored-set\"\nkind = \"bit-errors\"\nat_s = 0.5\n\
                magnitude = 4321\n[[run.faults]]\ntarget = \"supply\"\nkind = \"off\"\nat_s = 0.6\n";
    let scenario = Scenario::parse("bench.toml", text, &[]).expect("a scenario");
    let mut bench = Bench::new(elf(), strings(), &scenario).expect("a bench");
    let places = sets::places(&scenario).expect("sets");
    bench.machine.poke(PARAMETER_SETS, &places).expect("flash");
    let mut said = Vec::new();
    for _ in 0..1500 {
        let (passed, lines) = bench.step().expect("runs");
        assert!(!passed.drives.drive_on && !passed.drives.preload_on);
        said.extend(lines.into_iter().map(|line| line.text));
    }
    let at = |text: &str| said.iter().position(|line| line.starts_with(text));
    // A supply that was lost is a start like the first.
    let (runs, holds) = (at("rig kept, "), at("parameters: the set is damaged"));
    assert!(runs.is_some() && holds > runs, "{said:#?}");
    assert_eq!(said.iter().filter(|line| line.starts_with("interstage ")).count(), 2);
}

#[test]
fn a_scenario_s_faults_come_on_the_board_too() {
    let mut scenario = Scenario::default();
    let off = Injection::at(Target::EncoderLineB, Kind::Off, 0.0, 0.0);
    scenario.run.faults = vec![Injection { at_s: None, at_mm: Some(10.0), ..off }];
    let summary = ran(&scenario, false).recording.summary;
    assert_eq!(summary.faults.iter().map(|fault| fault.code).collect::<Vec<_>>(), [123]);
    // Without its drive the axle sinks back on its tread.
    assert!(!summary.completed && (9.5..14.0).contains(&summary.travel_mm), "{summary:?}");
    assert_eq!(summary.injected, ["encoder-line-b off from 10 mm"]);
}

#[test]
fn software_refuses_the_board_s_faults() {
    let mut scenario = Scenario::default();
    scenario.run.faults = vec![Injection::at(Target::Dma, Kind::Stalled, 1.0, 0.0)];
    let error = hil_sim::session::run(&scenario, hil_sim::session::Options::default());
    let Err(error) = error else { panic!("it was taken") };
    let error = error.to_string();
    assert!(error.contains("dma stalled") && error.contains("--target board"), "{error}");
}
