//! Tests of the start after a restart: where a wall is measured and where it is not.

use super::*;
use crate::estimate::crossing::{Contact, CrossingEvent};
use crate::rig::Rig;
use crate::sense::raw::SensorFrame;
use crate::sense::{Senses, SensesState};
use crate::units::Travel;
use proptest::prelude::*;

pub(in crate::estimate) fn estimator() -> Estimator {
    Estimator::try_build(&Rig::prototype()).expect("a sound rig")
}

/// What the senses report of a wheel on this level, so much off its wall by the table and so
/// deep in its tread, mm.
pub(crate) fn sensed(level: u8, off: f64, compression: f64) -> SensedState {
    let rig = Rig::prototype();
    let senses = Senses::try_build(&rig).expect("sound");
    let nothing = SensorFrame::default();
    let mut sensed = senses.step(&mut SensesState::default(), 0, &nothing, Q16::ZERO);
    sensed.level = level;
    let wall = rig.centre_radius_mm(usize::from(level));
    sensed.radius.value = Q16::from_num(wall + off + compression);
    sensed.compression_filtered = Q16::from_num(compression);
    sensed
}

/// A state with this knowledge at this position.
fn state(known: Position, position: f64, direction: Direction) -> EstimateState {
    let position = Q16::from_num(position);
    EstimateState { known, position, direction, ..EstimateState::default() }
}

/// A run that is resumed there, and the limits that it reports.
fn resumed(sensed: &SensedState, mut state: EstimateState) -> (EstimateState, usize) {
    let mut found = Findings::default();
    estimator().resume(&mut state, sensed, 0, &mut found);
    assert!(found.limits.iter().all(|limit| *limit == Limit::PositionUnconfirmed));
    (state, found.limits.len())
}

const DOUBTFUL: Position = Position::Unconfirmed { searching: true };

#[test]
fn back_from_the_first_touch_the_wall_is_measured_behind_it() {
    // The wall is 0.07 mm off its table, and the corner has made the tread 0.28 mm deeper.
    let start = state(Position::Located, 4.73, Direction::Retract);
    let (mut state, _) = resumed(&sensed(0, -0.14, 0.62), start);
    assert_eq!(state.watch.contact, Contact::Leaving);
    assert!(state.crossing.is_none());
    assert_eq!((state.level, state.next_step), (0, 0));
    let wall = sensed(0, 0.07, 0.34);
    let mut events = Vec::new();
    for tick in 0..250 {
        state.position = Q16::from_num(4.73 - 0.02 * f64::from(tick));
        let seen = estimator().watch_input(&state, &wall);
        events.extend(estimator().watch.step(&mut state.watch, Direction::Retract, &seen));
    }
    assert!(matches!(events[..], [CrossingEvent::GapClosed(_)]), "{events:?}");
    assert_eq!(state.watch.contact, Contact::Wall);
}

#[test]
fn on_from_the_first_touch_the_crossing_goes_on() {
    let start = state(Position::Located, 4.73, Direction::Deploy);
    let (state, _) = resumed(&sensed(0, -0.14, 0.62), start);
    assert_eq!(state.watch.contact, Contact::Both);
    assert_eq!((state.level, state.next_step), (0, 1));
    let open = state.crossing.expect("a crossing");
    assert!(open.step == 1 && open.turned && open.resumed);
}

proptest! {
    #[test]
    fn no_wall_is_measured_where_the_corner_above_may_touch(
        position in 0.0..80.0f64,
        off in -0.2..0.2f64,
        back in any::<bool>(),
    ) {
        let direction = if back { Direction::Retract } else { Direction::Deploy };
        let steps = Rig::prototype().rig.step_positions_mm;
        let level = steps.iter().filter(|face| **face <= position).count();
        let start = state(Position::Located, position, direction);
        let (state, _) = resumed(&sensed(level as u8, off, 0.35), start);
        // Centre within 0.3 mm of the edge: on top of it, as far as the record can tell.
        let touches = steps.iter().any(|face| (0.31..14.8).contains(&(face - position)));
        prop_assert!(!touches || state.watch.contact != Contact::Wall, "{:?}", state.watch);
    }
}

/// Position after a start with this record, if there is one, and whether the next step is
/// searched.
fn started(sensed: &SensedState, record: Option<(f64, bool)>) -> Option<(f64, bool)> {
    let place = |(position, sure)| Place {
        position: Q16::from_num(position),
        sure,
        zeros: Default::default(),
    };
    let mut state = EstimateState::restored(record.map(place));
    let restored = estimator().restore(&mut state, sensed);
    assert_eq!(matches!(state.known, Position::Restored { .. }), restored);
    restored.then_some((state.position.to_num::<f64>(), state.known.is_searching()))
}

#[test]
fn a_record_is_believed_as_far_as_the_arm_agrees() {
    let on = |level: u8| SensedState { steps_up: Q16::from_num(level), ..sensed(level, 0.0, 0.3) };
    let same = |got: Option<(f64, bool)>, position: f64, searching| {
        got.is_some_and(|(at, searches)| (at - position).abs() < 1e-3 && searches == searching)
    };
    // On the first wall short of the step at 18 mm, and past it.
    assert!(same(started(&on(0), Some((2.0, true))), 2.0, false));
    assert!(same(started(&on(1), Some((30.0, true))), 30.0, false));
    // A drive that may have gone on searches the next step.
    assert!(same(started(&on(1), Some((30.0, false))), 30.0, true));
    // The arm is too low or too high for the place.
    assert_eq!(started(&on(0), Some((30.0, true))), None);
    assert_eq!(started(&on(2), Some((2.0, true))), None);
    assert_eq!(started(&on(0), None), None);
}

/// As by a hand, while the board held after its start.
#[test]
fn what_the_wheel_is_moved_since_the_start_counts() {
    let moved = |mm: f64| SensedState {
        travel: Travel::from_num(mm),
        steps_up: Q16::ONE,
        ..sensed(1, 0.0, 0.3)
    };
    for mm in [-4.0, 0.0, 4.0] {
        let (position, _) = started(&moved(mm), Some((30.0, true))).expect("a place");
        assert!((position - 30.0 - mm).abs() < 1e-3, "{position} with {mm}");
    }
    // Off its wall by then, by the arm as well.
    assert_eq!(started(&moved(-28.0), Some((30.0, true))), None);
}

#[test]
fn without_a_record_a_corner_under_the_wheel_gives_the_place() {
    let on_corner = SensedState { steps_up: Q16::from_num(0.5), ..sensed(0, -2.0, 0.3) };
    let (position, searching) = started(&on_corner, None).expect("a corner");
    // Half-way up the first step, before its face and within its run.
    assert!((5.0..18.0).contains(&position) && !searching, "{position}");
    let from_above = SensedState { steps_up: Q16::from_num(0.5), ..sensed(1, 2.0, 0.3) };
    let (other, _) = started(&from_above, None).expect("a corner");
    assert!((other - position).abs() < 0.01, "{other} {position}");
}

#[test]
fn within_three_tenths_of_its_edge_the_wheel_is_on_top() {
    let face = q16(18_000_000);
    for direction in Direction::ALL {
        let corner = |position| estimator().corner_at(position, direction);
        assert_eq!(corner(face - AT_EDGE - Q16::DELTA), Some(Ground::Corner(1)));
        assert_eq!(corner(face - AT_EDGE), None);
        assert_eq!(corner(face), None);
    }
}

#[test]
fn at_the_first_touch_itself_the_wall_is_still_measured() {
    let contact = |nearer: Millimetres| {
        let estimator = estimator();
        let mut state = state(Position::Located, 0.0, Direction::Retract);
        state.position = q16(18_000_000) - estimator.steps.touches_within() + nearer;
        estimator.begin_on_wall(&mut state, &sensed(0, 0.0, 0.3));
        (state.watch.contact, state.leaving.is_some())
    };
    assert_eq!(contact(Q16::ZERO), (Contact::Wall, false));
    assert_eq!(contact(Q16::DELTA), (Contact::Leaving, true));
}

#[test]
fn a_record_that_no_step_ahead_can_confirm_is_reported() {
    let searches = |level: u8, direction: Direction| {
        let (state, reported) = resumed(&sensed(level, 0.0, 0.3), state(DOUBTFUL, 0.0, direction));
        assert!(state.crossing.is_none());
        assert_eq!(reported, usize::from(!state.known.is_searching()));
        state.known.is_searching()
    };
    let out = [0, 1, 2, 3].map(|level| searches(level, Direction::Deploy));
    assert_eq!(out, [true, true, true, false]);
    let back = [0, 1, 2, 3].map(|level| searches(level, Direction::Retract));
    assert_eq!(back, [false, true, true, true]);
    // Sure of its place, it has nothing to report.
    let start = state(Position::Located, 70.0, Direction::Deploy);
    let (sure, reported) = resumed(&sensed(3, 0.0, 0.3), start);
    assert_eq!((reported, sure.known), (0, Position::Located));
}

#[test]
fn the_search_ends_on_the_last_corner_of_each_direction() {
    // Half-way up the corner above the wall of this level: 2 mm inwards of it.
    let searches = |level: u8, direction: Direction| {
        let (state, reported) = resumed(&sensed(level, -2.0, 0.3), state(DOUBTFUL, 0.0, direction));
        let open = state.crossing.expect("on a corner");
        assert_eq!((open.step, state.next_step), (level + 1, level + 1));
        assert_eq!(reported, usize::from(!state.known.is_searching()));
        state.known.is_searching()
    };
    let out = [0, 1, 2].map(|level| searches(level, Direction::Deploy));
    assert_eq!(out, [true, true, false]);
    let back = [0, 1, 2].map(|level| searches(level, Direction::Retract));
    assert_eq!(back, [false, true, true]);
}

#[test]
fn outside_the_outermost_wall_there_is_no_corner() {
    for direction in Direction::ALL {
        let (state, _) = resumed(&sensed(0, 1.5, 0.3), state(DOUBTFUL, 0.0, direction));
        assert!(state.crossing.is_none() && state.level == 0);
    }
    // And inwards of the innermost there is none either.
    let ground = estimator().ground(&sensed(3, -1.5, 0.3), ON_WALL);
    assert_eq!(ground, Ground::Wall(3));
}

#[test]
fn a_place_is_contradicted_by_a_height_a_fifth_of_a_step_off() {
    let may_be = |position: Millimetres, up: f64, sure: bool| {
        let here = SensedState { steps_up: Q16::from_num(up), ..sensed(0, 0.0, 0.3) };
        estimator().may_be_at(&here, position, error_of(sure))
    };
    // Walls at 2 and 22.7 mm; at 10 mm the wheel may be on the first corner, or before it.
    for (position, least, most) in [(2.0, 0.0, 0.0), (10.0, 0.0, 1.0), (22.7, 1.0, 1.0)] {
        let may_be = |up: f64| may_be(Q16::from_num(position), up, true);
        assert!(may_be(least - 0.19) && may_be(most + 0.19), "{position}");
        assert!(!may_be(least - 0.21) && !may_be(most + 0.21), "{position}");
    }
    // Behind the face at 18 mm by its tolerance and by the error of the record; and up already
    // from the corner's first touch on, by the same.
    let tolerance = estimator().steps.tolerance;
    let touch = estimator().corner().first_contact(Direction::Deploy);
    let behind = |by: i64| q16(18_000_000) + tolerance + q16(by);
    let before = |by: i64| q16(18_000_000) - touch - tolerance - q16(by);
    for (sure, within, beyond) in [(true, 400_000, 600_000), (false, 1_900_000, 2_100_000)] {
        assert!(may_be(behind(within), 0.0, sure) && !may_be(behind(beyond), 0.0, sure));
        assert!(may_be(before(within), 1.0, sure) && !may_be(before(beyond), 1.0, sure));
    }
}

#[test]
fn on_a_wall_the_step_ahead_is_the_next_one_and_without_one_nothing_is_searched() {
    for (level, position, out, back) in [(0, 2.0, 1, 0), (1, 24.8, 2, 1), (3, 75.0, 0, 3)] {
        for (direction, next) in [(Direction::Deploy, out), (Direction::Retract, back)] {
            for known in [Position::Located, Position::Searching] {
                let start = state(known, position, direction);
                let (state, _) = resumed(&sensed(level, 0.0, 0.34), start);
                assert_eq!((state.level, state.next_step), (level, next), "{position}");
                let searching = known.is_searching() && next > 0;
                assert_eq!(state.known.is_searching(), searching, "{position} {direction:?}");
                assert!(state.crossing.is_none());
                let measured = state.watch.contact == Contact::Wall;
                assert!(measured || direction == Direction::Retract, "{position}");
            }
        }
    }
}

#[test]
fn up_but_before_the_face_the_wall_is_measured_behind_it() {
    let tolerance = estimator().steps.tolerance;
    for (next_step, face) in [(2, 18), (3, 40), (0, 62)] {
        for (ahead, leaves) in [(Q16::DELTA, true), (Q16::ZERO, false)] {
            let position = Q16::from_num(face) + tolerance - ahead;
            let start = state(Position::Located, 0.0, Direction::Deploy);
            let mut state = EstimateState { next_step, position, ..start };
            estimator().begin_on_wall(&mut state, &sensed(1, 0.0, 0.3));
            assert_eq!(state.watch.contact == Contact::Leaving, leaves, "{face} {ahead}");
        }
    }
}

#[test]
fn in_doubt_no_wall_is_measured_before_a_corner_is_surely_behind() {
    for direction in Direction::ALL {
        for known in [Position::Located, DOUBTFUL] {
            let mut state = EstimateState { next_step: 1, ..state(known, 22.0, direction) };
            estimator().begin_on_wall(&mut state, &sensed(1, 0.0, 0.3));
            let leaves = state.watch.contact == Contact::Leaving;
            assert_eq!(leaves, known.is_unsure(), "{direction:?}");
        }
    }
}
