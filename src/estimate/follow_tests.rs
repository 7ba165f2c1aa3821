//! Following a crossing: steps found, missed and displaced.

use super::super::landing::Landing;
use super::super::restore::tests::{estimator, sensed};
use super::super::{close::report_displaced, crossing::Measured};
use super::*;
use crate::units::{Travel, q16};

#[test]
fn the_second_step_missed_in_a_row_is_one_too_many() {
    for (direction, from) in [(Direction::Deploy, 1), (Direction::Retract, 3)] {
        let mut state = EstimateState { direction, next_step: from, ..EstimateState::default() };
        // Past every step of the prototype, which are at 18, 40 and 62 mm.
        state.position = Q16::from_num(if direction == Direction::Deploy { 79 } else { 1 });
        for (missed, fault) in [(1, None), (2, Some(Fault::StepsLost))] {
            let found = estimator().watch_expectation(&mut state);
            assert_eq!(found.limits[..], [Limit::StepMissing]);
            assert_eq!((state.missed_in_a_row, found.fault), (missed, fault));
            assert!(found.advanced && found.replan);
        }
        assert_eq!(state.next_step, 3 - u8::from(direction == Direction::Retract) * 2);
    }
}

#[test]
fn a_corner_is_left_behind_by_its_place_or_in_doubt_by_the_ground() {
    let face = q16(18_000_000);
    for direction in Direction::ALL {
        for known in [Position::Located, Position::Unconfirmed { searching: false }] {
            let lift = Some(LiftPoint { face, ..LiftPoint::default() });
            let resumed = known.is_unsure();
            let crossing = Some(OpenCrossing { step: 1, lift, resumed, ..OpenCrossing::default() });
            let mut state =
                EstimateState { direction, known, crossing, ..EstimateState::default() };
            let estimator = estimator();
            let bound = estimator.corner().first_contact(direction.opposite());
            let watch = &estimator.watch;
            watch.begin_on_corner(&mut state.watch, direction, 0);
            let level = sensed(0, 0.05, 0.3);
            let mut clear = |past: Millimetres| {
                state.position = face + past * Q16::from_num(direction.sign());
                estimator.clear_of(&state, &level)
            };
            let seen = [clear(bound), clear(bound + Q16::DELTA)];
            let by_place = [Some(false), Some(true)];
            assert_eq!(seen, if resumed { [None; 2] } else { by_place }, "{direction:?}");
        }
    }
}

#[test]
fn a_step_that_sets_the_position_has_its_crossing_there() {
    let (sensed, estimator) = (sensed(0, 0.0, 0.3), estimator());
    let tick = Follow {
        load: Q16::ZERO,
        now: 0,
        sensed: &sensed,
        pressed: Q16::ZERO,
        duty: Q16::ZERO,
        most_pressed: false,
        standing_since: None,
        limited_by: None,
    };
    let place = estimator.steps.face(1).expect("a first step");
    // A search from 13 mm before it.
    let mut state =
        EstimateState { known: Position::Searching, next_step: 1, ..EstimateState::default() };
    state.set_position(sensed.travel, place - q16(13_000_000));
    state.crossing = Some(OpenCrossing { step: 1, ..OpenCrossing::default() });
    let lift = Lift { depth: Q16::ZERO, height: Q16::ZERO, gap: Q16::ZERO, distance: Q16::ZERO };
    estimator.lifted(&mut state, &tick, lift, &mut Findings::default());
    let point = state.crossing.and_then(|open| open.lift).expect("lifted");
    assert_eq!((point.face, point.position, point.residual), (place, place, Q16::ZERO));
    assert_eq!(estimator.clear_of(&state, &sensed), Some(false));
}

#[test]
fn of_two_steps_in_a_row_that_are_off_alike_the_second_sets_the_position() {
    let (sensed, estimator) = (sensed(0, 0.0, 0.3), estimator());
    let place = estimator.steps.face(2).expect("a second step");
    let off = q16(3_000_000);
    let mut state = EstimateState { known: Position::Located, ..EstimateState::default() };
    state.displaced = Some((1, off));
    state.set_position(sensed.travel, place + off);
    let lift = Some(LiftPoint { face: place + off, residual: off, ..LiftPoint::default() });
    state.crossing = Some(OpenCrossing { step: 2, lift, ..OpenCrossing::default() });
    let mut found = Findings::default();
    estimator.close(&mut state, &sensed, &estimator.as_table(Q16::ZERO), &mut found);
    assert_eq!((state.position, state.displaced), (place, None));
    assert!(estimator.sigma(&state) < q16(300_000));
    let (closed, _) = found.closed.expect("closed");
    assert_eq!(closed.lift.map(|point| point.face), Some(place));
}

/// A tenth less than the arm shows right over the edge puts it further out by that of the leverage.
#[test]
fn a_compression_that_is_read_low_is_taken_off_the_place() {
    let (sensed, estimator) = (sensed(0, 0.0, 0.3), estimator());
    let place = estimator.steps.face(1).expect("a first step");
    let mut state = EstimateState { known: Position::Located, ..EstimateState::default() };
    state.set_position(sensed.travel, place);
    state.over = (1, [Q16::ONE, q16(900_000)]);
    let leverage = q16(4_000_000);
    let lift = Some(LiftPoint { face: place, leverage, ..LiftPoint::default() });
    state.odometry.set_by_step(sensed.travel, place);
    state.crossing =
        Some(OpenCrossing { step: 1, lift, corrected: true, ..OpenCrossing::default() });
    let table = estimator.as_table(Q16::ZERO);
    estimator.close(&mut state, &sensed, &table, &mut Findings::default());
    let (moved, sigma) = (state.position - place, estimator.sigma(&state));
    assert!((moved - q16(400_000)).abs() < q16(1_000), "{moved}");
    // Its place, rounded edges, and 0.58 of what it was off by.
    assert!((sigma - q16(320_000)).abs() < q16(5_000), "{sigma}");
}

#[test]
fn a_step_off_its_height_is_reported_and_its_gap_learned_from_as_the_table_has_it() {
    let (sensed, estimator) = (sensed(0, 0.0, 0.3), estimator());
    for (height, reported) in [(4_100_000, false), (4_200_000, true), (3_500_000, true)] {
        let mut state = EstimateState { known: Position::Located, ..EstimateState::default() };
        let face = estimator.steps.face(1).expect("a first step");
        let lift = Some(LiftPoint { face, ..LiftPoint::default() });
        state.crossing = Some(OpenCrossing { step: 1, lift, ..OpenCrossing::default() });
        let (gap, gap_as_table) = (q16(2_700_000), q16(2_600_000));
        let measured =
            Measured { height: q16(height), gap, gap_as_table, shift: Q16::ZERO, plausible: true };
        let mut found = Findings::default();
        estimator.close(&mut state, &sensed, &measured, &mut found);
        assert_eq!(found.limits.contains(&Limit::StepHeight), reported, "{height}");
        let (closed, trusted) = found.closed.expect("closed");
        let learned = closed.lift.expect("lifted").gap_as_table;
        assert_eq!((closed.gap, learned, trusted), (gap, gap_as_table, true));
        assert_eq!(state.raised, q16(height) - q16(4_000_000));
    }
}

#[test]
fn a_displaced_step_is_early_where_it_comes_before_its_place() {
    for (direction, residual, limit) in [
        (Direction::Deploy, -2, Limit::StepEarly),
        (Direction::Deploy, 2, Limit::StepLate),
        (Direction::Retract, 2, Limit::StepEarly),
        (Direction::Retract, -2, Limit::StepLate),
    ] {
        let state = EstimateState { direction, ..EstimateState::default() };
        let mut found = Findings::default();
        report_displaced(&state, Q16::from_num(residual), &mut found);
        assert_eq!(found.limits[..], [limit]);
    }
}

#[test]
fn a_tread_is_compared_on_a_wall_alone() {
    // Pressed with 40 N, and the compression sensor reads nothing.
    let strange = SensedState { preload_filtered: q16(40_000_000), ..sensed(0, 0.0, 0.0) };
    let reported = |contact: Contact, known: Position, position: f64| {
        let mut state = EstimateState { known, ..EstimateState::default() };
        state.position = Q16::from_num(position);
        state.watch.contact = contact;
        let estimator = estimator();
        let report = |tick: &i32| {
            estimator.rest(&mut state, &strange, Q16::ZERO, (*tick <= 1).then_some(None))
        };
        (1..500).filter(report).count()
    };
    assert_eq!(reported(Contact::Wall, Position::Located, 0.0), 1);
    assert_eq!(reported(Contact::Both, Position::Located, 0.0), 0);
    assert_eq!(reported(Contact::Leaving, Position::Located, 0.0), 0);
    // On an edge the tread is pressed deeper, not less.
    assert_eq!(reported(Contact::Wall, Position::Searching, 0.0), 1);
    // The corner at 18 mm may carry a part.
    assert_eq!(reported(Contact::Wall, Position::Located, 12.0), 0);
}

/// Three landings each hide half a millimetre; what is more, or the other way, is the sleeve's.
#[test]
fn a_step_that_slides_put_out_of_place_leaves_the_place_unsure() {
    let (sensed, estimator) = (sensed(0, 0.0, 0.3), estimator());
    let (out, back) = (Direction::Deploy, Direction::Retract);
    // It is as likely the wheel that is off.
    for (direction, step, residual, sure) in [
        (back, 1, 1_300_000, false),
        (back, 3, -1_300_000, false),
        (out, 1, 1_300_000, false),
        (out, 1, 900_000, true),
    ] {
        let mut state = EstimateState { direction, ..EstimateState::default() };
        let mut found = Findings::default();
        let left = estimator.correct(&mut state, &sensed, (step, q16(residual)), &mut found);
        assert_eq!((left, found.limits.len()), (q16(residual), 1));
        assert_eq!(estimator.sigma(&state) < q16(500_000), sure, "{direction:?} {step} {residual}");
    }
}

/// A slide of over 0.9 mm, part of which was seen before, onto a wall so much lower than its table, while
/// the model of the tread unwinds it by so much, millionths of a millimetre; and what is named of it.
fn slid(lower: i64, unwound: i64) -> (Millimetres, Option<Millimetres>) {
    let (sensed, estimator) = (sensed(0, 0.0, 0.3), estimator());
    let face = estimator.steps.face(1).expect("a first step");
    let seen = Landing { face, slid: q16(330_000), lost: q16(300_000) };
    let lift = Some(LiftPoint { face, ..LiftPoint::default() });
    let mut open = OpenCrossing { step: 1, landing: Some(seen), lift, ..OpenCrossing::default() };
    open.slip.lost = seen.slid;
    // The face moves outwards by 0.9 mm while the tread stands.
    for (fall, gave) in [(2_000_000, unwound), (2_300_000, 0)] {
        let (travel, depth, gave) = (Travel::ZERO, q16(900_000), q16(gave).widen());
        let at = OnEdge { travel, position: face, fall: q16(fall), depth, gave };
        let _ = open.slide.step(estimator.watch.radius, &at);
    }
    let all = open.slide.landing().expect("a landing").slid;
    assert!(all > q16(900_000), "{all:?}");
    let (direction, crossing) = (Direction::Retract, Some(open));
    let mut state = EstimateState { direction, crossing, ..EstimateState::default() };
    let mut found = Findings::default();
    let mut measured = estimator.as_table(Q16::ZERO);
    measured.height += q16(lower);
    estimator.close(&mut state, &sensed, &measured, &mut found);
    (all, found.slip.map(|slip| slip.amount))
}

#[test]
fn a_slide_behind_what_looked_like_the_end_of_one_is_counted_once() {
    let (all, named) = slid(0, 0);
    assert_eq!(named, Some(all));
}

#[test]
fn a_slide_that_the_model_unwinds_is_none_on_a_lower_wall_alone() {
    assert_eq!(slid(300_000, 1_000_000).1, None);
    for (lower, unwound) in [(0, 1_000_000), (100_000, 1_000_000), (300_000, 0)] {
        let (all, named) = slid(lower, unwound);
        assert_eq!(named, Some(all), "{lower} {unwound}");
    }
}
