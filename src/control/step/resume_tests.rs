//! Tests of the start after a restart: where a wall is measured and where it is not.

use super::super::Output;
use super::*;
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
