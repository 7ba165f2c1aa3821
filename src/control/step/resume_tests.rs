//! Tests of the start after a restart: where a wall is measured and where it is not.

use super::super::tests::{at, sensed};
use super::*;
use crate::estimate::crossing::{Contact, Sign};
use crate::restart::Place;
use crate::rig::Rig;
use crate::sense::SensedState;
use crate::units::Travel;
use proptest::prelude::*;

/// A run that is resumed there.
fn resumed(sensed: &SensedState, position: f64, direction: Direction) -> State {
    let mut state = State::default();
    state.direction = direction;
    at(sensed, position, |controller, pass| controller.resume(&mut state, pass, direction));
    state
}

#[test]
fn a_corner_may_be_felt_from_its_first_touch_until_the_patch_is_clear_of_it() {
    // The first step of the prototype stands at 18 mm, the second at 40 mm.
    let here = sensed(0, 0.0, 0.3);
    for (position, expected) in [
        (0.0, false),
        (3.0, false),
        (3.3, true),
        (4.7, true),
        (12.0, true),
        (18.0, true),
        (24.2, true),
        (24.6, false),
        (25.0, false),
        (25.3, true),
        (70.0, false),
        (80.0, false),
    ] {
        let got = at(&here, position, |controller, pass| controller.may_feel_corner(pass.position));
        assert_eq!(got, expected, "{position}");
    }
}

#[test]
fn back_from_the_first_touch_the_wall_is_measured_behind_it() {
    // The wall is 0.07 mm off its table, and the corner has made the tread 0.28 mm deeper.
    let mut state = resumed(&sensed(0, -0.14, 0.62), 4.73, Direction::Retract);
    assert_eq!(state.watch.contact, Contact::Leaving);
    assert!(state.crossing.is_none());
    assert_eq!((state.level, state.next_step), (0, 0));
    let wall = sensed(0, 0.07, 0.34);
    let mut signs = Vec::new();
    for tick in 0..250 {
        at(&wall, 4.73 - 0.02 * f64::from(tick), |controller, pass| {
            let seen = controller.seen(&state, pass);
            let sign = controller.watch.step(&mut state.watch, Direction::Retract, &seen);
            signs.extend(sign);
        });
    }
    assert!(matches!(signs[..], [Sign::Closed { .. }]), "{signs:?}");
    assert_eq!(state.watch.contact, Contact::Wall);
}

#[test]
fn on_from_the_first_touch_the_crossing_goes_on() {
    let state = resumed(&sensed(0, -0.14, 0.62), 4.73, Direction::Deploy);
    assert_eq!(state.watch.contact, Contact::Both);
    assert_eq!((state.level, state.next_step), (0, 1));
    let open = state.crossing.expect("a crossing");
    assert!(open.step == 1 && open.turned && open.resumed);
}

#[test]
fn clear_of_every_corner_the_wall_is_measured_at_once() {
    for (level, position, back) in [(0, 2.0, 0), (1, 24.8, 1), (3, 75.0, 3)] {
        let here = sensed(level, 0.0, 0.34);
        let state = resumed(&here, position, Direction::Retract);
        assert_eq!(state.watch.contact, Contact::Wall, "{position}");
        assert_eq!((state.level, state.next_step), (level, back), "{position}");
    }
}

proptest! {
    #[test]
    fn no_wall_is_measured_where_the_corner_above_may_be_felt(
        position in 0.0..80.0f64,
        off in -0.2..0.2f64,
        back in any::<bool>(),
    ) {
        let direction = if back { Direction::Retract } else { Direction::Deploy };
        let steps = Rig::prototype().rig.step_positions_mm;
        let level = steps.iter().filter(|face| **face <= position).count();
        let state = resumed(&sensed(level as u8, off, 0.35), position, direction);
        // Centre within 0.3 mm of the edge: on top of it, as far as the record can tell.
        let felt = steps.iter().any(|face| (0.31..14.8).contains(&(face - position)));
        prop_assert!(!felt || state.watch.contact != Contact::Wall, "{:?}", state.watch);
    }
}

/// A start with this record; where it says that it stands, if it does, and whether it looks
/// for the next step.
fn started(sensed: &SensedState, kept: Option<(f64, bool)>) -> Option<(f64, bool)> {
    let place = |(position, sure)| Place { position: Q16::from_num(position), sure };
    let mut state = State::standing(kept.map(place));
    let (placed, position) = at(sensed, 0.0, |controller, pass| {
        (controller.go_on_from(&mut state, pass), pass.position.to_num::<f64>())
    });
    assert_eq!((state.located, state.resumed), (placed, placed));
    placed.then_some((position, state.searching))
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
    // Whoever may have gone on looks for the next step.
    assert!(same(started(&on(1), Some((30.0, false))), 30.0, true));
    // The arm stands too low or too high for the place.
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
fn without_a_record_a_corner_under_the_wheel_tells_the_place() {
    let on_corner = SensedState { steps_up: Q16::from_num(0.5), ..sensed(0, -2.0, 0.3) };
    let (position, searching) = started(&on_corner, None).expect("a corner");
    // Half-way up the first step, before its face and within its run.
    assert!((5.0..18.0).contains(&position) && !searching, "{position}");
    let from_above = SensedState { steps_up: Q16::from_num(0.5), ..sensed(1, 2.0, 0.3) };
    let (other, _) = started(&from_above, None).expect("a corner");
    assert!((other - position).abs() < 0.01, "{other} {position}");
}

#[test]
fn a_corner_is_felt_exactly_between_its_edges() {
    at(&sensed(0, 0.0, 0.3), 0.0, |controller, _| {
        let face = q16(18_000_000);
        let tolerance = controller.schedule.tolerance();
        let ahead = face - controller.rise.first_contact(Direction::Deploy) - tolerance;
        let behind = face + controller.rise.first_contact(Direction::Retract) + tolerance;
        assert!(!controller.may_feel_corner(ahead));
        assert!(controller.may_feel_corner(ahead + Q16::DELTA));
        assert!(controller.may_feel_corner(behind - Q16::DELTA));
        assert!(!controller.may_feel_corner(behind));
        // Within 0.3 mm of its edge the wheel stands on top.
        for direction in Direction::ALL {
            let corner = |position| controller.corner_at(position, direction);
            assert_eq!(corner(face - AT_EDGE - Q16::DELTA), Some(Ground::Corner(1)));
            assert_eq!(corner(face - AT_EDGE), None);
            assert_eq!(corner(face), None);
        }
    });
}

#[test]
fn at_the_first_touch_itself_the_wall_is_still_measured() {
    let contact = |nearer: Millimetres| {
        let mut state = State::default();
        at(&sensed(0, 0.0, 0.3), 0.0, |controller, pass| {
            pass.position = q16(18_000_000) - controller.felt_within() + nearer;
            controller.begin_on_wall(&mut state, pass, Direction::Retract);
        });
        (state.watch.contact, state.leaving.is_some())
    };
    assert_eq!(contact(Q16::ZERO), (Contact::Wall, false));
    assert_eq!(contact(Q16::DELTA), (Contact::Leaving, true));
}

/// A run that is resumed from a record that may be off; how often it says that nothing ahead
/// can confirm it.
fn unsure(sensed: &SensedState, direction: Direction) -> (State, usize) {
    let mut state = State::default();
    (state.direction, state.searching) = (direction, true);
    let told = at(sensed, 0.0, |controller, pass| {
        controller.resume(&mut state, pass, direction);
        let unconfirmed = Event::Limit(Limit::PositionUnconfirmed);
        pass.output.events.iter().filter(|entry| entry.event == unconfirmed).count()
    });
    (state, told)
}

#[test]
fn a_record_that_no_step_ahead_can_confirm_is_told() {
    let searches = |level: u8, direction: Direction| {
        let (state, told) = unsure(&sensed(level, 0.0, 0.3), direction);
        assert!(state.crossing.is_none());
        assert_eq!(told, usize::from(!state.searching));
        state.searching
    };
    let out = [0, 1, 2, 3].map(|level| searches(level, Direction::Deploy));
    assert_eq!(out, [true, true, true, false]);
    let back = [0, 1, 2, 3].map(|level| searches(level, Direction::Retract));
    assert_eq!(back, [false, true, true, true]);
    // Sure of its place, it has nothing to say.
    let mut sure = State::default();
    let said = at(&sensed(3, 0.0, 0.3), 70.0, |controller, pass| {
        controller.resume(&mut sure, pass, Direction::Deploy);
        pass.output.events.len()
    });
    assert_eq!((said, sure.searching), (0, false));
}

#[test]
fn the_search_ends_on_the_last_corner_of_each_way() {
    // Half-way up the corner above the wall of this level: 2 mm inwards of it.
    let searches = |level: u8, direction: Direction| {
        let (state, told) = unsure(&sensed(level, -2.0, 0.3), direction);
        let open = state.crossing.expect("on a corner");
        assert_eq!((open.step, state.next_step), (level + 1, level + 1));
        assert_eq!(told, usize::from(!state.searching));
        state.searching
    };
    let out = [0, 1, 2].map(|level| searches(level, Direction::Deploy));
    assert_eq!(out, [true, true, false]);
    let back = [0, 1, 2].map(|level| searches(level, Direction::Retract));
    assert_eq!(back, [false, true, true]);
}

#[test]
fn outside_the_outermost_wall_there_is_no_corner() {
    for direction in Direction::ALL {
        let mut state = State::default();
        (state.direction, state.searching) = (direction, true);
        at(&sensed(0, 1.5, 0.3), 0.0, |controller, pass| {
            controller.resume(&mut state, pass, direction);
        });
        assert!(state.crossing.is_none() && state.level == 0);
    }
    // And inwards of the innermost there is none either.
    let inmost = sensed(3, -1.5, 0.3);
    let ground = at(&inmost, 75.0, |controller, pass| controller.ground(pass, ON_WALL));
    assert_eq!(ground, Ground::Wall(3));
}

#[test]
fn a_place_is_contradicted_by_a_height_a_fifth_of_a_step_off() {
    let stands = |position: Millimetres, up: f64, sure: bool| {
        let here = SensedState { steps_up: Q16::from_num(up), ..sensed(0, 0.0, 0.3) };
        at(&here, 0.0, |controller, pass| controller.may_stand_at(pass, position, within(sure)))
    };
    // Walls at 2 and 22.7 mm; at 10 mm the wheel may stand on the first corner, or before it.
    for (position, least, most) in [(2.0, 0.0, 0.0), (10.0, 0.0, 1.0), (22.7, 1.0, 1.0)] {
        let stands = |up: f64| stands(Q16::from_num(position), up, true);
        assert!(stands(least - 0.19) && stands(most + 0.19), "{position}");
        assert!(!stands(least - 0.21) && !stands(most + 0.21), "{position}");
    }
    // Behind the face at 18 mm by its tolerance and by what the record may be off.
    let tolerance = at(&sensed(0, 0.0, 0.3), 0.0, |controller, _| controller.schedule.tolerance());
    let behind = |way: Millimetres| q16(18_000_000) + tolerance + way;
    assert!(stands(behind(q16(400_000)), 0.0, true));
    assert!(!stands(behind(q16(600_000)), 0.0, true));
    assert!(stands(behind(q16(1_900_000)), 0.0, false));
    assert!(!stands(behind(q16(2_100_000)), 0.0, false));
    // Up already from the corner's first touch on, by the same.
    let touch = at(&sensed(0, 0.0, 0.3), 0.0, |controller, _| {
        controller.rise.first_contact(Direction::Deploy)
    });
    let before = |way: Millimetres| q16(18_000_000) - touch - tolerance - way;
    assert!(stands(before(q16(400_000)), 1.0, true));
    assert!(!stands(before(q16(600_000)), 1.0, true));
    assert!(stands(before(q16(1_900_000)), 1.0, false));
    assert!(!stands(before(q16(2_100_000)), 1.0, false));
}

#[test]
fn on_a_wall_the_step_ahead_is_the_next_one_and_without_one_nothing_is_searched() {
    for (level, position, out, back) in [(0, 2.0, 1, 0), (1, 24.8, 2, 1), (3, 75.0, 0, 3)] {
        for (direction, next) in [(Direction::Deploy, out), (Direction::Retract, back)] {
            for searching in [false, true] {
                let mut state = State::default();
                (state.direction, state.searching) = (direction, searching);
                at(&sensed(level, 0.0, 0.34), position, |controller, pass| {
                    controller.resume(&mut state, pass, direction);
                });
                assert_eq!((state.level, state.next_step), (level, next), "{position}");
                assert_eq!(state.searching, searching && next > 0, "{position} {direction:?}");
                assert!(state.crossing.is_none());
            }
        }
    }
}

#[test]
fn in_doubt_no_wall_is_measured_before_a_corner_is_surely_behind() {
    for direction in Direction::ALL {
        for unsure in [false, true] {
            let mut state = State::default();
            (state.direction, state.unsure, state.next_step) = (direction, unsure, 1);
            at(&sensed(1, 0.0, 0.3), 22.0, |controller, pass| {
                controller.begin_on_wall(&mut state, pass, direction);
            });
            let leaves = state.watch.contact == Contact::Leaving && state.leaving.is_some();
            assert_eq!(leaves, unsure, "{direction:?}");
        }
    }
}
