//! Resets anywhere in runs of random rigs: what follows is no false alarm.

use hil_sim::scenario::{Direction, Scenario};
use hil_sim::sil::{Options, Session};
use interstage::supervise::{Command, Fault, Mode};
use rayon::prelude::*;

/// Rigs each way.
const RIGS: u64 = 300;

/// Ends a run after so many ticks, sets off again the same way, and returns where the wheel
/// stood and how it ended.
fn resumed(seed: u64, direction: Direction, after: u32) -> (f64, Mode) {
    let mut scenario = Scenario::default();
    scenario.run.seed = seed;
    scenario.run.direction = direction;
    let command = match direction {
        Direction::Deploy => Command::Start,
        Direction::Retract => Command::Retract,
    };
    let mut session = Session::new(&scenario, Options::default()).expect("a session");
    let mut left = Some(command);
    for _ in 0..after {
        let given = if session.mode() == Mode::Idle { left.take() } else { None };
        session.step(given).expect("runs");
    }
    session.reboot();
    let stood = session.plant().truth().position_mm;
    let mut left = Some(command);
    for _ in 0..40_000 {
        let given = if session.mode() == Mode::Idle { left.take() } else { None };
        session.step(given).expect("runs");
        if matches!(session.mode(), Mode::Complete(_) | Mode::FaultHold(_)) {
            break;
        }
    }
    (stood, session.mode())
}

#[test]
fn a_reset_anywhere_is_followed_by_no_false_alarm() {
    for direction in [Direction::Deploy, Direction::Retract] {
        let ends: Vec<_> = (1..=RIGS)
            .into_par_iter()
            .map(|seed| (seed, resumed(seed, direction, 2500 + (seed * 7919 % 4300) as u32)))
            .collect();
        // Between the last step and the end nothing tells the place: it says so.
        let honest = |mode: Mode| {
            matches!(mode, Mode::Complete(_) | Mode::FaultHold(Fault::PositionUnknown) | Mode::Idle)
        };
        let alarms: Vec<_> = ends.iter().filter(|(_, (_, mode))| !honest(*mode)).collect();
        // The others had arrived before, or say that they do not know where they are.
        let arrived = ends.iter().filter(|(_, (_, mode))| matches!(mode, Mode::Complete(_)));
        let arrived = arrived.count() as u64;
        assert!(4 * arrived > RIGS, "{direction:?}: {arrived}");
        assert!(alarms.is_empty(), "{direction:?}: {} of {RIGS}: {alarms:?}", alarms.len());
    }
}
