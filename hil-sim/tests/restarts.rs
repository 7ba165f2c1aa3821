//! Resets anywhere in runs of random rigs: what follows is no false alarm, and with the
//! record of the run before it arrives.

use hil_sim::scenario::{Direction, Scenario};
use hil_sim::sil::{Options, Session};
use interstage::supervise::{Command, Fault, Mode};
use rayon::prelude::*;

/// Rigs each way.
const RIGS: u64 = 300;

/// Ends a run after so many ticks, sets off again `then`, and returns where the wheel stood
/// and how it ended. Memory is kept or not.
fn resumed(
    seed: u64,
    direction: Direction,
    after: u32,
    kept: bool,
    then: Direction,
) -> (f64, Mode) {
    let mut scenario = Scenario::default();
    scenario.run.seed = seed;
    scenario.run.direction = direction;
    let command = |direction| match direction {
        Direction::Deploy => Command::Start,
        Direction::Retract => Command::Retract,
    };
    let mut session = Session::new(&scenario, Options::default()).expect("a session");
    let mut left = Some(command(direction));
    for _ in 0..after {
        let given = if session.mode() == Mode::Idle { left.take() } else { None };
        session.step(given).expect("runs");
    }
    if kept {
        session.restart();
    } else {
        session.reboot();
    }
    let stood = session.plant().truth().position_mm;
    let mut left = Some(command(then));
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
            .map(|seed| {
                let after = 2500 + (seed * 7919 % 4300) as u32;
                (seed, resumed(seed, direction, after, false, direction))
            })
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

#[test]
fn with_its_record_it_arrives_either_way_from_anywhere() {
    for (direction, then) in [
        (Direction::Deploy, Direction::Deploy),
        (Direction::Deploy, Direction::Retract),
        (Direction::Retract, Direction::Deploy),
        (Direction::Retract, Direction::Retract),
    ] {
        let ends: Vec<_> = (1..=RIGS / 2)
            .into_par_iter()
            .map(|seed| {
                // On the way back the first step tells a start at the far end where it is.
                let from = if direction == Direction::Deploy { 2000 } else { 2800 };
                let after = from + (seed * 7919 % 5000) as u32;
                (seed, after, resumed(seed, direction, after, true, then))
            })
            .collect();
        let left: Vec<_> =
            ends.iter().filter(|(.., (_, mode))| !matches!(mode, Mode::Complete(_))).collect();
        // One in hundreds comes to its end with the arm not confirming it, and says so.
        let honest = |mode: Mode| mode == Mode::FaultHold(Fault::LevelMismatch);
        assert!(
            left.iter().all(|(.., (_, mode))| honest(*mode)),
            "{direction:?}, {then:?}: {left:?}"
        );
        assert!(100 * left.len() < ends.len(), "{direction:?}, then {then:?}: {left:?}");
    }
}
