//! Tests of the start after a restart: where a wall is measured and where it is not.

use super::super::Output;
use super::*;
use crate::blackbox::Place;
use crate::estimate::crossing::{Contact, Sign};
use crate::rig::Rig;
use crate::sense::raw::SensorFrame;
use crate::sense::{SensedState, Senses, SensesState};
use proptest::prelude::*;

/// What the senses say of a wheel on this level, so much off its wall by the table and so
/// deep in its tread, mm.
fn sensed(level: u8, off: f64, compression: f64) -> SensedState {
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

/// Does something at this position.
fn at<T>(
    sensed: &SensedState,
    position: f64,
    act: impl FnOnce(&Controller, &mut Pass<'_>) -> T,
) -> T {
    let controller = Controller::try_build(&Rig::prototype()).expect("sound");
    let mut output = Output::default();
    let position = Q16::from_num(position);
    act(&controller, &mut Pass { now: 0, sensed, position, wedge: Q16::ZERO, output: &mut output })
}

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
