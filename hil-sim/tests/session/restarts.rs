//! Resets anywhere in runs of random rigs: what follows is no false alarm, and with the
//! record of the run before it arrives.

use hil_sim::scenario::{Direction, Scenario};
use hil_sim::session::{Options, Session};
use hil_sim::testing::long;
use interstage::fault::{Fault, Limit};
use interstage::restart::{Reset, Restart};
use interstage::supervise::{Command, Mode};
use interstage::tick::Event;
use interstage::units::Millimetres;
use rayon::prelude::*;

/// Rigs each way: 300, or a sample of them.
fn rigs() -> u64 {
    if long() { 300 } else { 16 }
}

/// Ways of the run broken off and of the one that follows.
const WAYS: [(Direction, Direction); 4] = [
    (Direction::Deploy, Direction::Deploy),
    (Direction::Deploy, Direction::Retract),
    (Direction::Retract, Direction::Deploy),
    (Direction::Retract, Direction::Retract),
];

fn command(direction: Direction) -> Command {
    match direction {
        Direction::Deploy => Command::Start,
        Direction::Retract => Command::Retract,
    }
}

fn session(seed: u64, direction: Direction) -> Session {
    let mut scenario = Scenario::default();
    scenario.run.seed = seed;
    scenario.run.direction = direction;
    Session::new(&scenario, Options::default()).expect("a session")
}

/// Gives the command as soon as the drive rests, and goes on until this holds, or the run has
/// ended, for so many ticks at most. Returns the reports of limits.
fn drive(
    session: &mut Session,
    direction: Direction,
    most: u32,
    until: impl Fn(&Session) -> bool,
) -> Vec<Limit> {
    let mut left = Some(command(direction));
    let mut limits = Vec::new();
    for _ in 0..most {
        let over = matches!(session.mode(), Mode::Complete(_) | Mode::FaultHold(_));
        if until(session) || over && left.is_none() {
            break;
        }
        let rests = matches!(session.mode(), Mode::Idle | Mode::Complete(_));
        let given = if rests { left.take() } else { None };
        let output = session.step(given).expect("runs");
        limits.extend(output.events.iter().filter_map(|entry| match entry.event {
            Event::Limit(limit) => Some(limit),
            _ => None,
        }));
    }
    limits
}

/// Ends a run after so many ticks, sets off again `then`, and returns where the wheel stood
/// and how it ended. Memory is kept or not.
fn resumed(
    seed: u64,
    direction: Direction,
    after: u32,
    kept: bool,
    then: Direction,
) -> (f64, Mode) {
    let mut session = session(seed, direction);
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
    drive(&mut session, then, 40_000, |_| false);
    (stood, session.mode())
}

/// Breaks a run off with the wheel's centre so far before the face of the step, its record
/// kept.
fn broken_off_at_a_corner(seed: u64, direction: Direction, step: usize, before: f64) -> Session {
    let mut session = stopped_at_a_corner(seed, direction, step, before);
    session.restart();
    session
}

/// The same by the supply, so that the record is in doubt, and off by so much.
fn lost_at_a_corner(
    seed: u64,
    direction: Direction,
    step: usize,
    before: f64,
    off: f64,
) -> Session {
    let mut session = stopped_at_a_corner(seed, direction, step, before);
    let mut snapshot = session.record();
    snapshot.position += Millimetres::from_num(off);
    session.restart_from(Restart { reset: Reset::Power, snapshot: Some(snapshot), crash: None });
    session
}

/// Goes on until the wheel's centre is so far before the face of the step.
fn stopped_at_a_corner(seed: u64, direction: Direction, step: usize, before: f64) -> Session {
    let face = Scenario::default().rig.rig.step_positions_mm[step];
    let mut session = session(seed, direction);
    drive(&mut session, direction, 40_000, |session| {
        let past = session.plant().truth().position_mm - (face - before);
        match direction {
            Direction::Deploy => past > 0.0,
            Direction::Retract => past < 0.0,
        }
    });
    session
}

/// Draws where to break off: rig, step, and way before its face, mm. From the first step met
/// on, the odometry knows where it is.
fn draws(direction: Direction, count: u64) -> impl ParallelIterator<Item = (u64, usize, f64)> {
    (1..=count).into_par_iter().map(move |seed| {
        let step = match direction {
            Direction::Deploy => seed % 3,
            Direction::Retract => seed % 2,
        };
        (seed, step as usize, -6.0 + 21.5 * (seed as f64 * 0.618_034).fract())
    })
}

/// Whether a rig without a fault never reports it.
fn untrue(limit: &Limit) -> bool {
    matches!(limit, Limit::StepExtra | Limit::StepMissing | Limit::CompressionStrange)
}

#[test]
fn a_reset_anywhere_is_followed_by_no_false_alarm() {
    for direction in [Direction::Deploy, Direction::Retract] {
        let ends: Vec<_> = (1..=rigs())
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
        assert!(4 * arrived > rigs(), "{direction:?}: {arrived}");
        assert!(alarms.is_empty(), "{direction:?}: {}: {alarms:?}", alarms.len());
    }
}

#[test]
fn with_its_record_it_arrives_either_way_from_anywhere() {
    for (direction, then) in WAYS {
        let ends: Vec<_> = (1..=rigs() / 2)
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
        assert!(left.is_empty(), "{direction:?}, then {then:?}: {left:?}");
    }
}

/// The wheel had come so near to the first step that its tread felt the corner, and was sent
/// back: the wall, measured there, was 0.2 mm too high, and the wall behind a corner that the
/// table lacks.
#[test]
fn from_the_first_touch_of_a_corner_it_comes_back() {
    let (stood, mode) = resumed(9, Direction::Deploy, 3271, true, Direction::Retract);
    assert!((4.6..4.9).contains(&stood), "{stood}");
    assert!(matches!(mode, Mode::Complete(_)), "{mode:?}");
}

/// Every place at which a corner is felt, or nearly.
#[test]
fn from_anywhere_at_a_corner_it_arrives_and_reports_nothing_that_is_not_so() {
    for (direction, then) in WAYS {
        let ends: Vec<_> = draws(direction, rigs())
            .map(|(seed, step, before)| {
                let mut session = broken_off_at_a_corner(seed, direction, step, before);
                let limits = drive(&mut session, then, 40_000, |_| false);
                (seed, step, before, session.mode(), limits)
            })
            .collect();
        let left: Vec<_> = ends
            .iter()
            .filter(|(.., mode, limits)| {
                !matches!(mode, Mode::Complete(_)) || limits.iter().any(untrue)
            })
            .collect();
        assert!(left.is_empty(), "{direction:?}, then {then:?}: {left:?}");
    }
}

/// The operator changes his mind, twice, before the wheel has gone far.
#[test]
fn sent_to_and_fro_at_a_corner_it_still_arrives() {
    for (direction, then) in WAYS {
        let other = match then {
            Direction::Deploy => Direction::Retract,
            Direction::Retract => Direction::Deploy,
        };
        let ends: Vec<_> = draws(direction, rigs() / 2)
            .map(|(seed, step, before)| {
                let mut session = broken_off_at_a_corner(seed, direction, step, before);
                for (turn, way) in [then, other].into_iter().enumerate() {
                    let ticks = 150 + (seed * (31 + turn as u64) * 127 % 1900) as u32;
                    drive(&mut session, way, ticks, |_| false);
                    if !matches!(session.mode(), Mode::Complete(_)) {
                        session.step(Some(Command::Stop)).expect("runs");
                    }
                }
                drive(&mut session, then, 40_000, |_| false);
                (seed, step, before, session.mode())
            })
            .collect();
        let left: Vec<_> =
            ends.iter().filter(|(.., mode)| *mode != Mode::Complete(then.into())).collect();
        assert!(left.is_empty(), "{direction:?}, then {then:?}: {left:?}");
    }
}

/// Near the top of a corner the arm cannot tell it from the wall behind.
#[test]
fn from_a_record_in_doubt_it_takes_no_corner_for_a_wall() {
    for (direction, then) in WAYS {
        let ends: Vec<_> = draws(direction, rigs())
            .map(|(seed, step, before)| {
                // Every other one at the top; within what a record in doubt may be off.
                let before = if seed % 2 == 0 { before } else { 2.2 + before.abs() / 10.0 };
                let off = [-1.5, 0.0, 1.5][(seed % 3) as usize];
                let mut session = lost_at_a_corner(seed, direction, step, before, off);
                let mut limits = Vec::new();
                // Stopped on its way, and sent on: once, twice, or not at all.
                for turn in 0..seed % 3 {
                    let ticks = 150 + (seed * (31 + turn) * 127 % 1900) as u32;
                    limits.extend(drive(&mut session, then, ticks, |_| false));
                    if !matches!(session.mode(), Mode::Complete(_)) {
                        session.step(Some(Command::Stop)).expect("runs");
                    }
                }
                limits.extend(drive(&mut session, then, 40_000, |_| false));
                let at = session.plant().truth().position_mm;
                (seed, step, before, off, session.mode(), at, limits)
            })
            .collect();
        // Stopped before the only step ahead was found, it may not know where it is.
        let honest = |mode: &Mode| {
            matches!(mode, Mode::Complete(_) | Mode::FaultHold(Fault::PositionUnknown))
        };
        let wrong: Vec<_> = ends
            .iter()
            .filter(|(.., mode, at, limits)| {
                let end = if then == Direction::Deploy { 79.8 } else { 0.0 };
                let off = matches!(mode, Mode::Complete(_)) && (at - end).abs() > 2.6;
                !honest(mode) || off || limits.iter().any(untrue)
            })
            .collect();
        let unknown = ends.iter().filter(|(.., mode, _, _)| !matches!(mode, Mode::Complete(_)));
        assert!(wrong.is_empty(), "{direction:?}, then {then:?}: {} {wrong:?}", wrong.len());
        assert!(unknown.count() as u64 * 10 < rigs() + 10, "{direction:?}, then {then:?}");
    }
}

/// How far off its record is when the supply is back, mm: moved by hand meanwhile, along the
/// wall, which goes on for 2.7 mm behind the end of travel.
const MOVED: [f64; 5] = [-6.5, -2.6, -0.4, 0.4, 1.9];

/// The supply goes with the wheel at about 71 mm, on the last wall, and comes back with it
/// moved by so much. Then sent out, to the end or not at all.
fn moved_on_the_last_wall(seed: u64, moved: f64, out: u32) -> (Session, Vec<Limit>) {
    let mut session = session(seed, Direction::Deploy);
    drive(&mut session, Direction::Deploy, 40_000, |session| {
        session.plant().truth().position_mm > 71.0
    });
    let mut snapshot = session.record();
    snapshot.position -= Millimetres::from_num(moved);
    session.restart_from(Restart { reset: Reset::Power, snapshot: Some(snapshot), crash: None });
    let limits = drive(&mut session, Direction::Deploy, out, |_| false);
    (session, limits)
}

/// What the way back says, where it ends, and how.
fn back(session: &mut Session) -> (Vec<Limit>, f64, Mode) {
    if !matches!(session.mode(), Mode::Idle | Mode::Complete(_)) {
        session.step(Some(Command::Stop)).expect("runs");
    }
    let limits = drive(session, Direction::Retract, 40_000, |_| false);
    (limits, session.plant().truth().position_mm, session.mode())
}

#[test]
fn moved_on_the_last_wall_it_says_so_and_finds_its_place_on_the_way_back() {
    for (seed, moved) in (1..=rigs().min(20))
        .step_by(if long() { 1 } else { 8 })
        .flat_map(|seed| MOVED.map(|moved| (seed, moved)))
    {
        for out in [0, 1500, 40_000] {
            let (mut session, limits) = moved_on_the_last_wall(seed, moved, out);
            let told = limits.iter().filter(|limit| **limit == Limit::PositionUnconfirmed);
            assert_eq!(told.count(), usize::from(out > 0), "{seed} {moved} {out}: {limits:?}");
            if out == 40_000 {
                assert_eq!(session.mode(), Mode::Complete(Direction::Deploy.into()));
            }
            let (limits, at, mode) = back(&mut session);
            let place = format!("{seed} {moved} {out}: {limits:?}, {at}, {mode:?}");
            assert_eq!(mode, Mode::Complete(Direction::Retract.into()), "{place}");
            assert!(at.abs() < 2.6, "{place}");
            assert!(!limits.iter().any(untrue), "{place}");
        }
    }
}

#[test]
fn no_reset_makes_a_place_sure_that_no_step_has_confirmed() {
    for moved in MOVED {
        let (mut session, _) = moved_on_the_last_wall(3, moved, 40_000);
        for reset in [Reset::Pin, Reset::Software] {
            let snapshot = Some(session.record());
            let restart = Restart { reset, snapshot, crash: None };
            assert!(restart.place().is_some_and(|place| !place.sure), "{moved}: {restart}");
            session.restart_from(restart);
            // Idle for a second: nothing moves, and nothing is found out.
            for _ in 0..1000 {
                session.step(None).expect("runs");
            }
        }
        let limits = drive(&mut session, Direction::Deploy, 40_000, |_| false);
        assert_eq!(limits, [Limit::PositionUnconfirmed], "{moved}");
        let (_, at, mode) = back(&mut session);
        assert_eq!(mode, Mode::Complete(Direction::Retract.into()), "{moved}");
        assert!(at.abs() < 2.6, "{moved}: {at}");
        // A step has been found: from here on it is sure again.
        let restart = Restart { reset: Reset::Pin, snapshot: Some(session.record()), crash: None };
        assert!(restart.place().is_some_and(|place| place.sure), "{moved}: {restart}");
    }
}

/// Nothing but the sleeve's end tells it that it is further out than it believes.
#[test]
fn moved_outwards_it_holds_at_the_sleeve_s_end() {
    let (mut session, limits) = moved_on_the_last_wall(3, 6.5, 40_000);
    assert!(limits.contains(&Limit::PositionUnconfirmed), "{limits:?}");
    assert!(matches!(session.mode(), Mode::FaultHold(_)), "{:?}", session.mode());
    let stood = *session.plant().truth();
    for _ in 0..1000 {
        session.step(None).expect("runs");
    }
    let truth = session.plant().truth();
    assert!((truth.position_mm - stood.position_mm).abs() < 0.1, "{truth:?} after {stood:?}");
    assert!((truth.preload_n - stood.preload_n).abs() < 3.0, "{truth:?} after {stood:?}");
}
