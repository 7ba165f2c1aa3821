//! The first power-up on the emulated board: a sound one, and each mistake in the wiring.

use std::path::Path;

use clap::ValueEnum;
use hil_sim::bringup::{self, Line, Progress, Stdin};
use hil_sim::params::{Client, StoreError};
use hil_sim::probe::Port;
use hil_sim::record::Run;
use hil_sim::replay::replay;
use hil_sim::scenario::Scenario;
use hil_sim::testing::long;
use interstage::params::Refusal;
use interstage::params::link::{ToBoard, frame};
use interstage::params::service::Request;
use interstage::supervise::ServiceDuties;
use interstage::units::Duty;
use rig_board::bench::Bench;
use rig_board::bringup::Attended;
use rig_board::wiring::Mistake;
use serde_json::Value;

use crate::common::cli::{Said, good, rig};
use crate::common::{Board, OnUsb, elf, strings};

/// The power-up of a board with these mistakes, every motion allowed.
fn power_up(mistakes: &[Mistake]) -> Progress {
    power_up_over(mistakes, &Scenario::default(), |board| board)
}

/// The same over this port to the board.
fn power_up_over<P: Port>(
    mistakes: &[Mistake],
    scenario: &Scenario,
    port: impl FnOnce(Attended<'static>) -> P,
) -> Progress {
    let bench = Bench::wired(elf(), strings(), scenario, mistakes).expect("a bench");
    let board = Attended::new(bench);
    let mut person = board.person(Stdin::new(std::io::empty(), std::io::sink(), true));
    let mut progress = Progress::new(Scenario::default());
    let mut port = port(board);
    let mut line = Line::new(&mut port);
    let (mut said, mut kept) = (Vec::new(), 0);
    let mut say = |text: &str| said.push(text.to_owned());
    let ended = bringup::run(&mut line, &mut person, &mut progress, &mut say, &mut |_| kept += 1);
    ended.unwrap_or_else(|error| panic!("{mistakes:?}: {error}: {said:#?}"));
    assert!(kept > 0);
    progress
}

fn assert_passed(progress: &Progress) {
    let failed: Vec<_> = progress.checks().filter(|check| !check.ok).collect();
    assert!(failed.is_empty() && progress.is_complete(), "{failed:#?}");
}

#[test]
fn a_sound_board_passes_every_check_over_a_slow_probe() {
    assert_passed(&power_up_over(&[], &Scenario::default(), OnUsb::new));
}

#[test]
fn a_sound_board_passes_every_check_and_its_parameters_are_found() {
    let progress = power_up(&[]);
    assert_passed(&progress);
    let done: Vec<&str> = progress.checks().map(|check| check.name.as_str()).collect();
    let all: Vec<&str> = guided().collect();
    assert_eq!(done, all);
    let (found, rig) = (&progress.proposed.rig, Scenario::default().rig);
    let near = |found: f64, known: f64, within: f64| {
        assert!((found - known).abs() <= within, "{found} for {known}");
    };
    near(found.sense.angle_zero_code, rig.sense.angle_zero_code, 2.0);
    near(found.drive.no_load_speed_mm_s, rig.drive.no_load_speed_mm_s, 3.0);
    near(found.preload.slew_n_per_s, rig.preload.slew_n_per_s, 1.5);
    near(found.plant.mu, rig.plant.mu, 0.1);
}

/// The names of the checks that a power-up makes itself.
fn guided() -> impl Iterator<Item = &'static str> {
    let gates = bringup::GATES.iter().filter(|gate| !gate.is_by_logs());
    gates.flat_map(|gate| gate.checks.iter().map(|check| check.name))
}

#[test]
fn what_the_gates_find_of_hidden_rigs_is_within_their_intervals() {
    // The wheel of the first wedges where it is not held off.
    for seed in [7_500_016].into_iter().chain(1..=if long() { 20 } else { 1 }) {
        let wide = include_str!("../../tests/identify/hidden.toml");
        let hidden = Scenario::parse("hidden", wide, &[format!("run.seed={seed}")]).expect("a rig");
        let found = power_up_over(&[], &hidden, |board| board);
        assert_passed(&found);
        let (plant, nominal) = (hidden.plant(), &Scenario::default().rig.sense);
        for (key, truth) in [
            ("plant.mu", plant.mu),
            (
                "sense.preload_full_scale_n",
                nominal.preload_full_scale_n / plant.sensors.preload_sensor_gain,
            ),
            (
                "sense.tread_full_scale_mm",
                nominal.tread_full_scale_mm / plant.sensors.compression_gain,
            ),
        ] {
            let source = &found.proposed.sources[key];
            let ends: Vec<f64> =
                source.split([' ', ',']).filter_map(|word| word.parse().ok()).collect();
            println!("seed {seed}: {key} {truth:.3} of {source}");
            assert!((ends[0]..=ends[1]).contains(&truth), "{seed} {key}: {truth}, {source}");
            assert!((ends[1] - ends[0]) < 0.6 * truth, "{key}: {source}");
        }
    }
}

/// Each mistake, the check that finds it, and what its advice says.
const FOUND: &[(Mistake, &str, &str)] = &[
    (Mistake::OneBank, "option bytes", "DBANK=1"),
    (Mistake::StopOpen, "stop contact", "contact is open"),
    (Mistake::ReadbackReference, "readback at rest", "drive's readback (PB0): 0 V at rest"),
    (Mistake::PreloadOpen, "preload sensor", "preload sensor is open"),
    (Mistake::PreloadNoise, "preload noise", "preload sensor's noise"),
    (Mistake::CompressionOpen, "compression sensor", "compression sensor is open"),
    (Mistake::CompressionNoise, "compression noise", "compression sensor's noise"),
    (Mistake::AngleOpen, "angle sensor", "does not answer"),
    (Mistake::MagnetMissing, "angle sensor", "magnet is missing"),
    (Mistake::AngleZero, "angle zero", "zero code is far off"),
    (Mistake::PreloadPullDown, "preload lead", "100 kOhm at PC2"),
    (Mistake::StopShorted, "stop pressed", "shorted to ground"),
    (Mistake::StopSupply, "stop cuts supply", "second contact does not cut"),
    (Mistake::BridgePullDowns, "held in reset", "pull-down of 3.3 kOhm"),
    (Mistake::ReadbackSwapped, "drive bridge", "inputs of the drive's readback are swapped"),
    (Mistake::ReadbacksExchanged, "drive bridge", "readbacks are exchanged"),
    (Mistake::SupplyOff, "drive bridge", "motor supply is off"),
    (Mistake::EncoderA, "drive turns", "line A (PA0) is missing"),
    (Mistake::EncoderB, "drive turns", "line B (PA1) is missing"),
    (Mistake::EncoderOpen, "drive turns", "encoder is not connected"),
    (Mistake::EncoderSwapped, "drive turns", "encoder's lines A and B are swapped"),
    (Mistake::DriveLeads, "drive turns", "drive motor's leads are swapped"),
    (Mistake::BothSwapped, "drive direction", "both the encoder's lines and the drive motor's"),
    (Mistake::WheelBlocked, "drive turns", "wheel is blocked, or the drive motor's leads"),
    (Mistake::MotorsExchanged, "drive turns", "motors are exchanged"),
    (Mistake::PretightenerLeads, "preload rises", "pre-tightener's leads are swapped"),
    (Mistake::PreloadReversed, "preload rises", "preload sensor's bridge is reversed"),
    (Mistake::CompressionReversed, "preload rises", "compression sensor is reversed"),
    (Mistake::SensorsExchanged, "preload lead", "compression sensor are exchanged"),
    (Mistake::ArmInwards, "arm direction", "codes grow inwards"),
    (Mistake::PreloadGain, "weight scale", "preload sensor's scale is wrong by 1.50"),
    (Mistake::PreloadStop, "weights agree", "not linear"),
    (Mistake::PreloadScale, "weight scale", "sense.preload_full_scale_n = 18"),
    (Mistake::NoStop, "pull slips", "not on its stop"),
    (Mistake::CompressionScale, "gauge scale", "sense.tread_full_scale_mm = 5.5"),
];

#[test]
fn each_mistake_in_the_wiring_is_named_and_nothing_else_is_blamed() {
    let all = Mistake::value_variants();
    assert!(all.iter().all(|known| FOUND.iter().any(|(mistake, ..)| mistake == known)));
    let mut wrong = Vec::new();
    for (mistake, name, phrase) in FOUND.iter().step_by(2 - usize::from(long())) {
        let progress = power_up(&[*mistake]);
        let failed: Vec<_> = progress.checks().filter(|check| !check.ok).collect();
        let named =
            matches!(&failed[..], [one] if one.name == *name && one.advice.contains(phrase));
        if !named {
            wrong.push(format!("{mistake:?}: {failed:#?}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Sends a request down the board's line.
fn send(board: &mut Board, request: Request) {
    let bytes = frame(&ToBoard::Parameters(1, request)).expect("it fits");
    assert_eq!(board.bench.line_send(&bytes).expect("runs"), bytes.len());
}

const PRESS: ServiceDuties =
    ServiceDuties { drive: Duty::ZERO, pretightener: Duty::from_bits(6000) };
const DRIVE: ServiceDuties =
    ServiceDuties { drive: Duty::from_bits(6000), pretightener: Duty::ZERO };

/// A board in the service mode.
fn serving() -> Board {
    let mut board = Board::idle();
    send(&mut board, Request::Service(ServiceDuties::REST));
    board.until("mode: service", 50);
    board
}

#[test]
fn a_host_that_falls_silent_loses_the_motor_within_a_fifth_of_a_second() {
    let mut board = serving();
    for _ in 0..6 {
        send(&mut board, Request::Service(PRESS));
        board.run(50);
        assert!(board.step().drives.preload_on);
    }
    let silent = (0..1000).find(|_| !board.step().drives.preload_on).expect("it ends");
    // The last word was 51 ms ago, and is read every 10 ms.
    assert!((140..=162).contains(&silent), "{silent} ms");
    assert!(board.said("the host fell silent"), "{:#?}", board.log);
    board.assert_off(1000);
    // The controller can be run again from its log, to the bit.
    let run = Run::of_stream(&board.frames);
    let replayed = replay(&run, &Scenario::default().rig).expect("a sound rig");
    assert!(replayed.difference.is_none() && replayed.ticks > 1000, "{replayed:?}");
}

#[test]
fn the_service_mode_is_refused_in_motion_and_ends_with_the_emergency_stop() {
    let mut board = Board::moving();
    for duties in [ServiceDuties::REST, DRIVE] {
        let refused = Client::new(&mut board).ask(Request::Service(duties)).expect_err("in motion");
        assert!(
            matches!(refused, StoreError::Refused(why) if why == Refusal::NotService.sentence())
        );
    }
    assert!(!board.said("mode: service"));
    board.until("mode: deployed", 20_000);
    let mut board = serving();
    for _ in 0..3 {
        send(&mut board, Request::Service(DRIVE));
        board.run(50);
    }
    assert!(board.step().drives.drive > 0.1);
    board.open_stop(true);
    board.step();
    assert!(board.step().drives.drive == 0.0);
    board.run(5);
    assert!(board.said("fault hold, 151"), "{:#?}", board.log);
    board.assert_off(200);
}

/// `rig bringup` on the emulated board, as a user has it.
fn verb(place: &Path, arguments: &[&str]) -> (Option<i32>, Value, String) {
    let verb = ["bringup", "--target", "board", "--out", "up", "--json"];
    let Said { code, printed, text } = rig(place, &[&verb, arguments].concat());
    (code, printed, text)
}

#[test]
fn the_verb_moves_nothing_unconfirmed_and_goes_on_where_it_was_broken_off() {
    let folder = tempfile::tempdir().expect("a directory");
    let place = folder.path();
    let (code, _, said) = verb(place, &[]);
    assert_eq!(code, Some(1), "{said}");
    let last = said.lines().last().expect("it says why");
    assert!(last.starts_with("error: not confirmed: ") && last.contains("DRIVE"), "{said}");
    let (code, printed, said) = verb(place, &["--yes"]);
    assert_eq!((code, &printed["complete"]), (Some(0), &true.into()), "{said}");
    assert_eq!(said.matches("passed before").count(), 3, "{said}");
    let checks = printed["checks"].as_array().expect("checks");
    assert_eq!(checks.len(), guided().count());
    for check in checks {
        for key in ["name", "ok", "measured", "expected", "advice"] {
            assert!(!check[key].is_null(), "{check}");
        }
    }
    let page = std::fs::read_to_string(place.join("up/report.html")).expect("a page");
    assert!(page.contains("wired as it should be"));
    // What it proposes is on the page, and what `params` takes.
    let restore = ["params", "restore", "up/mine.toml", "--target", "board", "--json"];
    let restored = good(place, &restore);
    for key in printed["proposed"].as_object().expect("keys").keys() {
        assert_eq!(restored["parameters"][key].to_string(), printed["proposed"][key], "{key}");
        assert!(page.contains(key.as_str()), "{key}");
    }
    // A deployment with them, at the least speed, is the next gate.
    let slow = ["deploy", "up/mine.toml", "--set", "drive.cruise_speed_mm_s=5", "--out", "slow"];
    good(place, &slow);
    let crossed = good(place, &["bringup", "--log", "slow", "--out", "up", "--json"]);
    assert_eq!(crossed["lacking"], "gates not passed: identification, acceptance (up)");
    let mine = Scenario::resolve(None, Some(&place.join("up/mine.toml")), &[]).expect("a scenario");
    assert_eq!(mine.sources.len(), 6, "{:?}", mine.sources);
    let (code, printed, _) = verb(place, &["--yes", "--again", "--mistake", "encoder-swapped"]);
    assert_eq!((code, &printed["complete"]), (Some(1), &false.into()));
    let (code, _, said) = verb(place, &["--mistake", "gremlins"]);
    assert!(code == Some(2) && said.contains("gremlins"), "{said}");
}
