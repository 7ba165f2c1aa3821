//! Resets anywhere in runs of random rigs: no false alarm follows, and with its record it arrives.

use std::sync::atomic::{AtomicU64, Ordering};

use crate::common::{DIRECTIONS, end_mm, opposite, scenario, starter};
use hil_sim::scenario::{Direction, Scenario};
use hil_sim::session::{self, Options, RunningRig, Session, once};
use hil_sim::testing::long;
use interstage::fault::{Fault, Limit};
use interstage::restart::{Reset, Restart};
use interstage::supervise::{Command, Mode};
use interstage::tick::Event;
use interstage::units::Millimetres;
use rayon::prelude::*;

/// Ticks within which every run ends.
const LONGEST: u32 = 40_000;

/// Rigs in each direction: 300, or a sample of them.
fn rigs() -> u64 {
    if long() { 300 } else { 50 }
}

fn session(seed: u64, direction: Direction) -> Session {
    let scenario = scenario("prototype", direction, seed);
    Session::new(&scenario, Options::default()).expect("a session")
}

/// Whether the place is called unconfirmed at the end, which is counted: twice in a hundred runs.
fn unsure(mode: Mode, count: &AtomicU64, runs: u64) -> bool {
    let is = mode == Mode::FaultHold(Fault::PlaceUnconfirmed);
    100 * (count.fetch_add(is.into(), Ordering::Relaxed) + u64::from(is)) <= 2 * runs && is
}

/// Checks the runs of these seeds and of 126, once a false 125, the interrupted one and the one
/// after it in each direction: `check` describes a run that failed.
fn each_direction(seeds: u64, check: impl Fn(u64, Direction, Direction) -> Option<String> + Sync) {
    for direction in DIRECTIONS {
        for then in DIRECTIONS {
            let one = |seed| check(seed, direction, then);
            let failed: Vec<_> = (1..=seeds).into_par_iter().chain([126]).filter_map(one).collect();
            assert!(failed.is_empty(), "{direction:?}, then {then:?}: {failed:#?}");
        }
    }
}

/// Gives the command as soon as the drive rests and continues until this holds or the run has
/// ended, for at most this many ticks. Returns the reported limits.
fn drive(
    session: &mut Session,
    direction: Direction,
    most: u32,
    until: impl Fn(&Session) -> bool,
) -> Vec<Limit> {
    let mut left = Some(starter(direction));
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

/// The same to the end of the run.
fn finish(session: &mut Session, direction: Direction) -> Vec<Limit> {
    drive(session, direction, LONGEST, |_| false)
}

/// The same for a time that depends on the seed and on `turn`, then stopped.
fn interrupted(session: &mut Session, direction: Direction, seed: u64, turn: u64) -> Vec<Limit> {
    let ticks = 150 + (seed * (31 + turn) * 127 % 1900) as u32;
    let limits = drive(session, direction, ticks, |_| false);
    if !matches!(session.mode(), Mode::Complete(_)) {
        session.step(Some(Command::Stop)).expect("runs");
    }
    limits
}

/// Ends a run after this many ticks, with its record kept or lost, and starts again in the
/// direction `then`. Returns the true position at the reset, mm, and the final mode.
fn resumed(
    seed: u64,
    direction: Direction,
    after: u32,
    kept: bool,
    then: Direction,
) -> (f64, Mode) {
    let mut session = session(seed, direction);
    let after_s = f64::from(after) * 1e-3;
    session::drive(&mut session, after_s, once(direction), |_, _, _| false).expect("runs");
    let restart = if kept { Session::restart } else { Session::reboot };
    restart(&mut session);
    let at_mm = session.plant().truth().position_mm;
    finish(&mut session, then);
    // A place that is called unconfirmed and is off is no false alarm.
    let end_mm = end_mm(&scenario("prototype", then, seed), then);
    let off_mm = session.plant().truth().position_mm - end_mm;
    match session.mode() {
        Mode::FaultHold(Fault::PlaceUnconfirmed) if off_mm.abs() > 0.5 => (at_mm, Mode::Idle),
        mode => (at_mm, mode),
    }
}

/// A run interrupted with the wheel's centre this distance before the face of a step. From the
/// first step met on, the odometry knows its position. Also the place, as text.
fn at_a_corner(seed: u64, direction: Direction, before: f64) -> (Session, String) {
    let step = match direction {
        Direction::Deploy => seed % 3,
        Direction::Retract => seed % 2,
    } as usize;
    let face = Scenario::default().rig.rig.step_positions_mm[step];
    let mut session = session(seed, direction);
    drive(&mut session, direction, LONGEST, |session| {
        let past = session.plant().truth().position_mm - (face - before);
        if direction == Direction::Deploy { past > 0.0 } else { past < 0.0 }
    });
    (session, format!("seed {seed}, {before:.3} mm before step {}", step + 1))
}

/// Distance before the face by seed, mm: every place at which a corner is felt, or nearly.
fn before_mm(seed: u64) -> f64 {
    -6.0 + 21.5 * (seed as f64 * 0.618_034).fract()
}

/// A restart from this record, lost by the supply: its position is unconfirmed, and off by
/// this much, mm.
fn lose_supply(session: &mut Session, off_mm: f64) {
    let mut snapshot = session.record();
    snapshot.position += Millimetres::from_num(off_mm);
    session.restart_from(Restart { reset: Reset::Power, snapshot: Some(snapshot), crash: None });
}

/// Whether a rig without a fault never reports it.
fn untrue(limit: &Limit) -> bool {
    matches!(limit, Limit::StepExtra | Limit::StepMissing | Limit::CompressionStrange)
}

#[test]
fn a_reset_anywhere_is_followed_by_no_false_alarm() {
    for direction in DIRECTIONS {
        // Of fewer than 300, twice in a hundred is chance.
        let ends: Vec<_> = (1..=300)
            .into_par_iter()
            .map(|seed| {
                let after = 1200 + (seed * 7919 % 3500) as u32;
                (seed, resumed(seed, direction, after, false, direction).1)
            })
            .collect();
        // Between the last step and the end nothing gives the position, which it reports.
        let count = AtomicU64::default();
        let honest = |mode: Mode| {
            matches!(mode, Mode::Complete(_) | Mode::FaultHold(Fault::PositionUnknown) | Mode::Idle)
                || unsure(mode, &count, 300)
        };
        let alarms: Vec<_> = ends.iter().filter(|(_, mode)| !honest(*mode)).collect();
        let arrived = ends.iter().filter(|(_, mode)| matches!(mode, Mode::Complete(_))).count();
        assert!(4 * arrived > 300, "{direction:?}: {arrived}");
        assert!(alarms.is_empty(), "{direction:?}: {}: {alarms:?}", alarms.len());
    }
}

/// A tread shows a preload late; a zero taken meanwhile would add to every one after it.
#[test]
fn a_reset_under_a_rising_preload_adds_nothing_to_it() {
    for (seed, kept) in [(3014, true), (3226, true), (3014, false), (3226, false)] {
        let mut session = session(seed, Direction::Deploy);
        let over = |session: &Session, most_n| session.plant().truth().preload_n > most_n;
        drive(&mut session, Direction::Deploy, LONGEST, |session| over(session, 5.0));
        let restart = if kept { Session::restart } else { Session::reboot };
        restart(&mut session);
        drive(&mut session, Direction::Deploy, LONGEST, |session| over(session, 52.0));
        let mode = session.mode();
        assert!(matches!(mode, Mode::Complete(_)), "{seed}, {kept}: {mode:?}");
    }
}

#[test]
fn with_its_record_it_arrives_in_either_direction_from_anywhere() {
    each_direction(rigs() / 2, |seed, direction, then| {
        // On retraction the first step gives the position of a start at the far end.
        let from = if direction == Direction::Deploy { 2000 } else { 2800 };
        let after = from + (seed * 7919 % 5000) as u32;
        let end = resumed(seed, direction, after, true, then);
        (!matches!(end.1, Mode::Complete(_)))
            .then(|| format!("seed {seed}, after {after}: {end:?}"))
    });
}

/// The tread felt the corner of the first step when the run was reversed: the wall, measured
/// there, was 0.2 mm too high, and the wall behind it seemed a corner that the table lacks.
#[test]
fn from_the_first_touch_of_a_corner_it_comes_back() {
    let mut touched = 0;
    for after in (1500..2700).step_by(30) {
        let (at_mm, mode) = resumed(9, Direction::Deploy, after, true, Direction::Retract);
        touched += u32::from((4.5..5.2).contains(&at_mm));
        assert!(matches!(mode, Mode::Complete(_)), "{after}: {at_mm} {mode:?}");
    }
    assert!(touched > 0);
}

#[test]
fn from_anywhere_at_a_corner_it_arrives_and_reports_nothing_untrue() {
    each_direction(rigs(), |seed, direction, then| {
        let (mut session, place) = at_a_corner(seed, direction, before_mm(seed));
        session.restart();
        let limits = finish(&mut session, then);
        let mode = session.mode();
        let good = matches!(mode, Mode::Complete(_)) && !limits.iter().any(untrue);
        (!good).then(|| format!("{place}: {mode:?}, {limits:?}"))
    });
}

/// The operator reverses the run twice before the wheel has gone far.
#[test]
fn sent_to_and_fro_at_a_corner_it_still_arrives() {
    let counts: [AtomicU64; 4] = Default::default();
    each_direction(rigs() / 2, |seed, direction, then| {
        let (mut session, place) = at_a_corner(seed, direction, before_mm(seed));
        session.restart();
        for (turn, turned) in (0..).zip([then, opposite(then)]) {
            interrupted(&mut session, turned, seed, turn);
        }
        finish(&mut session, then);
        let mode = session.mode();
        let off_mm = session.plant().truth().position_mm - end_mm(&Scenario::default(), then);
        let count = &counts[2 * direction as usize + then as usize];
        let unsure = off_mm.abs() <= 2.6 && unsure(mode, count, rigs() / 2);
        (mode != Mode::Complete(then.into()) && !unsure).then(|| format!("{place}: {mode:?}"))
    });
}

/// Near the top of a corner the arm cannot distinguish it from the wall behind.
#[test]
fn from_an_unconfirmed_record_it_takes_no_corner_for_a_wall_and_arrives_by_a_step_alone() {
    let unknown: [AtomicU64; 4] = Default::default();
    each_direction(rigs(), |seed, direction, then| {
        // Every other run at the top.
        let before = before_mm(seed);
        let before = if seed % 2 == 0 { before } else { 2.2 + before.abs() / 10.0 };
        let (mut session, place) = at_a_corner(seed, direction, before);
        // Within the error of an unconfirmed record.
        lose_supply(&mut session, [-1.5, 0.0, 1.5][(seed % 3) as usize]);
        // Interrupted once, twice, or not at all.
        let mut limits: Vec<Limit> =
            (0..seed % 3).flat_map(|turn| interrupted(&mut session, then, seed, turn)).collect();
        limits.extend(finish(&mut session, then));
        let (mode, at) = (session.mode(), session.plant().truth().position_mm);
        let end = if then == Direction::Deploy { 80.0 } else { 0.0 };
        let good = match mode {
            // By a step that is displaced by four sigma at most; or no step lay ahead.
            Mode::Complete(_) => (at - end).abs() <= 1.2,
            Mode::FaultHold(Fault::PlaceUnconfirmed) => {
                (at - end).abs() <= 2.6 && limits.contains(&Limit::PositionUnconfirmed)
            }
            // Stopped before the only step ahead was found, it may not know its position.
            Mode::FaultHold(Fault::PositionUnknown) => {
                unknown[2 * direction as usize + then as usize].fetch_add(1, Ordering::Relaxed);
                true
            }
            _ => false,
        };
        (!good || limits.iter().any(untrue)).then(|| format!("{place}: {mode:?}, {at}, {limits:?}"))
    });
    let unknown = unknown.map(AtomicU64::into_inner);
    assert!(unknown.iter().all(|runs| 3 * runs <= rigs()), "{unknown:?}");
}

/// Error of the record when the supply is back, mm: the wheel was moved by hand meanwhile
/// along the wall, which continues for 2.7 mm behind the end of travel.
const MOVED: [f64; 5] = [-6.5, -2.6, -0.4, 0.4, 1.9];

/// The supply fails with the wheel at about 71 mm, on the last wall, and returns with the
/// wheel moved by this distance. Then deployed for at most this many ticks.
fn moved_on_the_last_wall(seed: u64, moved: f64, out: u32) -> (Session, Vec<Limit>) {
    let mut session = session(seed, Direction::Deploy);
    drive(&mut session, Direction::Deploy, LONGEST, |session| {
        session.plant().truth().position_mm > 71.0
    });
    lose_supply(&mut session, -moved);
    let limits = drive(&mut session, Direction::Deploy, out, |_| false);
    (session, limits)
}

/// Limits of the retraction; it arrives at the stow end.
fn assert_returns(session: &mut Session, name: &str) -> Vec<Limit> {
    while matches!(session.mode(), Mode::FaultHold(_)) {
        session.step(Some(Command::Reset)).expect("runs");
    }
    session.step(Some(Command::Stop)).expect("runs");
    let limits = finish(session, Direction::Retract);
    let at = session.plant().truth().position_mm;
    assert_eq!(session.mode(), Mode::Complete(Direction::Retract.into()), "{name}: {limits:?}");
    assert!(at.abs() < 1.2, "{name}: {at}, {limits:?}");
    limits
}

#[test]
fn moved_on_the_last_wall_it_reports_that_and_finds_its_position_on_retraction() {
    let step = if long() { 1 } else { 8 };
    for (seed, moved) in (1..=20).step_by(step).flat_map(|seed| MOVED.map(|moved| (seed, moved))) {
        for out in [0, 1500, LONGEST] {
            let (mut session, limits) = moved_on_the_last_wall(seed, moved, out);
            let name = format!("{seed} {moved} {out}");
            let reported = limits.iter().filter(|limit| **limit == Limit::PositionUnconfirmed);
            assert_eq!(reported.count(), usize::from(out > 0), "{name}: {limits:?}");
            if out == LONGEST {
                assert_eq!(session.mode(), Mode::FaultHold(Fault::PlaceUnconfirmed), "{name}");
            }
            let limits = assert_returns(&mut session, &name);
            assert!(!limits.iter().any(untrue), "{name}: {limits:?}");
        }
    }
}

#[test]
fn no_reset_confirms_a_position_that_no_step_has_confirmed() {
    for moved in MOVED {
        let (mut session, _) = moved_on_the_last_wall(3, moved, 500);
        session.step(Some(Command::Stop)).expect("runs");
        for reset in [Reset::Pin, Reset::Software] {
            let snapshot = Some(session.record());
            let restart = Restart { reset, snapshot, crash: None };
            assert!(restart.place().is_some_and(|place| !place.sure), "{moved}: {restart}");
            session.restart_from(restart);
            // Idle for a second: nothing moves, and nothing is learned.
            for _ in 0..1000 {
                session.step(None).expect("runs");
            }
        }
        let limits = finish(&mut session, Direction::Deploy);
        assert_eq!(limits, [Limit::PositionUnconfirmed], "{moved}");
        assert_eq!(session.mode(), Mode::FaultHold(Fault::PlaceUnconfirmed), "{moved}");
        assert_returns(&mut session, &moved.to_string());
        // A step has been found: the position is confirmed again.
        let restart = Restart { reset: Reset::Pin, snapshot: Some(session.record()), crash: None };
        assert!(restart.place().is_some_and(|place| place.sure), "{moved}: {restart}");
    }
}

/// Nothing but the sleeve's end shows that the wheel is further out than its estimate.
#[test]
fn moved_outwards_it_holds_at_the_sleeve_s_end() {
    let (mut session, limits) = moved_on_the_last_wall(3, 6.5, LONGEST);
    assert!(limits.contains(&Limit::PositionUnconfirmed), "{limits:?}");
    assert!(matches!(session.mode(), Mode::FaultHold(_)), "{:?}", session.mode());
    let held = *session.plant().truth();
    for _ in 0..1000 {
        session.step(None).expect("runs");
    }
    let truth = session.plant().truth();
    // Off the stop, its load winds the tread up by as much as it carries: 6.7 N at 19.5 N/mm.
    assert!((truth.position_mm - held.position_mm).abs() < 0.35, "{truth:?} after {held:?}");
    assert!((truth.preload_n - held.preload_n).abs() < 3.0, "{truth:?} after {held:?}");
}
