//! The first power-up on the emulated board: a sound one, and each mistake in the wiring.

use hil_sim::bringup::{self, Line, Progress, Stdin};
use hil_sim::scenario::Scenario;
use rig_board::bench::Bench;
use rig_board::bringup::Attended;
use rig_board::wiring::Mistake;

use crate::common::{elf, strings};

/// The power-up of a board with these mistakes, every motion allowed.
fn power_up(mistakes: &[Mistake]) -> Progress {
    let scenario = Scenario::default();
    let bench = Bench::wired(elf(), strings(), &scenario, mistakes).expect("a bench");
    let mut board = Attended::new(bench);
    let mut person = board.person(Stdin::new(std::io::empty(), std::io::sink(), true));
    let mut progress = Progress::new(scenario);
    let mut line = Line::new(&mut board);
    let (mut said, mut kept) = (Vec::new(), 0);
    let mut say = |text: &str| said.push(text.to_owned());
    let ended = bringup::run(&mut line, &mut person, &mut progress, &mut say, &mut |_| kept += 1);
    ended.unwrap_or_else(|error| panic!("{mistakes:?}: {error}: {said:#?}"));
    assert!(kept > 0);
    progress
}

#[test]
fn a_sound_board_passes_every_check_and_its_parameters_are_found() {
    let progress = power_up(&[]);
    let failed: Vec<_> = progress.checks().filter(|check| !check.ok).collect();
    assert!(failed.is_empty() && progress.is_complete(), "{failed:#?}");
    let done: Vec<&str> = progress.checks().map(|check| check.name.as_str()).collect();
    let all: Vec<&str> = bringup::CHECKS.iter().map(|info| info.name).collect();
    assert_eq!(done, all);
    let (found, rig) = (&progress.proposed.rig, Scenario::default().rig);
    let near = |found: f64, known: f64, within: f64| {
        assert!((found - known).abs() <= within, "{found} for {known}");
    };
    near(found.sense.angle_zero_code, rig.sense.angle_zero_code, 2.0);
    near(found.drive.no_load_speed_mm_s, rig.drive.no_load_speed_mm_s, 3.0);
    near(found.preload.slew_n_per_s, rig.preload.slew_n_per_s, 1.5);
    near(found.preload.delay_s, rig.preload.delay_s, 0.02);
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
    (Mistake::BridgePullDowns, "held in reset", "pull-down of 10 kOhm"),
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
    (Mistake::SensorsExchanged, "preload against tread", "compression sensor are exchanged"),
    (Mistake::ArmInwards, "arm direction", "codes grow inwards"),
    (Mistake::PreloadGain, "preload scale", "preload sensor's scale is wrong by 1.5"),
];

#[test]
fn each_mistake_in_the_wiring_is_named_and_nothing_else_is_blamed() {
    assert!(Mistake::ALL.iter().all(|known| FOUND.iter().any(|(mistake, ..)| mistake == known)));
    let only = std::env::var("RIG_MISTAKE").ok();
    let mut wrong = Vec::new();
    for (mistake, name, phrase) in FOUND {
        if only.as_ref().is_some_and(|only| only != mistake.name()) {
            continue;
        }
        let progress = power_up(&[*mistake]);
        let failed: Vec<_> = progress.checks().filter(|check| !check.ok).collect();
        let named =
            matches!(&failed[..], [one] if one.name == *name && one.advice.contains(phrase));
        if !named {
            wrong.push(format!("{}: {failed:#?}", mistake.name()));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
