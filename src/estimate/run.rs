//! Before and at the end of a run: where the wheel is, what lies ahead, whether it has arrived.

use super::crossing::Contact;
use super::{EstimateState, Estimator, Findings, OpenCrossing, Position, PositionConfidence};
use crate::fault::Fault;
use crate::sense::SensedState;
use crate::units::{Direction, Millimetres, Newtons, Q16, Ratio, Tick, q16};

/// Off a whole number of steps by no more than this, the arm shows a level: half the
/// hysteresis of a corner, and the tolerances of sleeve and arm.
const LEVEL_WITHIN: Ratio = q16(120_000);

/// Largest sigma of the position with which a run has arrived, and distance beyond the end that is
/// not reported, mm.
const PLACE_WITHIN: Millimetres = q16(500_000);

impl Estimator {
    /// Before a run: step ahead and baseline. Whether the run begins on a corner after a
    /// restart.
    pub fn begin_run(
        &self,
        state: &mut EstimateState,
        sensed: &SensedState,
        now: Tick,
        direction: Direction,
        load: Newtons,
    ) -> (Findings, bool) {
        let mut found = Findings { advanced: true, replan: true, ..Findings::default() };
        let turned = state.direction != direction;
        state.direction = direction;
        state.leaving = None;
        state.odometry.begin_run(state.position, turned);
        state.over.0 = 0;
        let carries = self.tread.means(Millimetres::ONE);
        self.pulls.begin(&mut state.wind_up, sensed.travel, load, carries);
        if let Some(open) = state.crossing.as_mut() {
            open.slip.begin_run();
            open.hopeless_since = None;
        }
        // A crossing that began in its middle has no measured wall to turn back to.
        let between = state.crossing.as_ref().is_some_and(|open| open.resumed);
        // Away from the end that it went to in doubt, steps lie ahead that set the position.
        let doubtful = state.known == Position::Unconfirmed { searching: false };
        if turned && doubtful && state.confidence() == PositionConfidence::Unsure {
            state.known = Position::Unconfirmed { searching: true };
        }
        let mut on_corner = false;
        if state.known.begin_run() || turned && between {
            on_corner = self.resume(state, sensed, now, &mut found);
        } else if state.known.is_searching() {
            self.start_searching(state, sensed);
        } else if turned {
            self.turn(state, sensed, now);
        } else if state.crossing.is_none() {
            self.start_on_wall(state, sensed);
        }
        state.late = false;
        state.missed_in_a_row = 0;
        if state.known.is_searching() && state.next_step == 0 {
            found.fault = Some(Fault::PositionUnknown);
        }
        (found, on_corner)
    }

    fn start_on_wall(&self, state: &mut EstimateState, sensed: &SensedState) {
        state.next_step = self.step_ahead(state);
        self.begin_on_wall(state, sensed);
    }

    /// After a restart away from the stow end the wheel may be on a corner: off it first,
    /// towards the wall that the arm shows, then search.
    fn start_searching(&self, state: &mut EstimateState, sensed: &SensedState) {
        let up = sensed.steps_up.max(Q16::ZERO);
        let level = match state.direction {
            // Up to the next whole step, or down to the last.
            Direction::Deploy => up + (q16(1_000_000) - LEVEL_WITHIN),
            Direction::Retract => up + LEVEL_WITHIN,
        };
        let level = level.floor().clamp(0, 255) as u8;
        state.crossing = None;
        state.level = level;
        let level = level.min(self.steps.count());
        state.next_step = self.steps.ahead_of_level(level, state.direction);
        self.begin_off(state);
    }

    /// Turning back, perhaps on a corner.
    fn turn(&self, state: &mut EstimateState, sensed: &SensedState, now: Tick) {
        let direction = state.direction;
        let open = state.crossing.take();
        let before = state.watch.contact;
        self.watch.reverse(&mut state.watch, direction);
        let Some(open) = open else {
            if before == Contact::Wall {
                self.start_on_wall(state, sensed);
            } else {
                state.next_step = self.step_ahead(state);
            }
            return;
        };
        state.leaving = open.lift.map(|point| point.face).or(self.steps.face(open.step));
        let again = OpenCrossing {
            step: open.step,
            direction,
            turned: true,
            touched_at: now,
            ..OpenCrossing::default()
        };
        match (before, direction) {
            // Off the corner, onto the wall it came from.
            (Contact::Both, Direction::Retract) | (Contact::Corner, Direction::Deploy) => {
                state.next_step = self.steps.after(open.step, direction);
            }
            // The other way over the same corner.
            (Contact::Corner, Direction::Retract) => {
                state.level = state.level.saturating_add(1);
                state.next_step = open.step;
                state.crossing = Some(again);
            }
            (Contact::Both, Direction::Deploy) => {
                state.level = state.level.saturating_sub(1);
                state.next_step = open.step;
                state.crossing = Some(again);
            }
            (Contact::Leaving | Contact::Wall, _) => state.next_step = open.step,
        }
        if open.step == 0 {
            state.next_step = self.step_ahead(state);
        }
    }

    /// Number of the step ahead, 0 if there is none.
    fn step_ahead(&self, state: &EstimateState) -> u8 {
        let behind = self.steps.behind(state.position);
        // Close to a face the level decides: a step is behind once the wheel is up.
        let up = (state.level + state.missed).saturating_sub(state.extra);
        let behind = if up == behind + 1 { up.min(self.steps.count()) } else { behind };
        self.steps.ahead_of_level(behind, state.direction)
    }

    /// Whether the arm confirms the level at the end of travel, and the steps the place.
    pub fn confirms_end(&self, state: &EstimateState, sensed: &SensedState) -> Result<(), Fault> {
        let expected = match state.direction {
            Direction::Deploy => (self.steps.count() + state.extra).saturating_sub(state.missed),
            Direction::Retract => 0,
        };
        let on_wall = matches!(state.watch.contact, Contact::Wall | Contact::Leaving);
        // Steps that are not as high as the table has them add up.
        let off = (sensed.steps_up - Q16::from_num(expected)).abs() * self.steps.height;
        let level =
            sensed.level == expected || off <= self.steps.height.half() + state.raised.abs();
        if !on_wall || !level || state.known.is_searching() {
            Err(Fault::LevelMismatch)
        } else if state.known.is_unsure() || self.sigma(state) > PLACE_WITHIN {
            Err(Fault::PlaceUnconfirmed)
        } else {
            Ok(())
        }
    }

    /// Whether the wheel is beyond the end of travel.
    pub fn is_beyond(&self, state: &EstimateState) -> bool {
        -self.steps.remaining(state.direction, state.position) > PLACE_WITHIN
    }

    /// One sigma of the position, mm: that of the odometry, with the slip that was measured. A
    /// displaced step has a limit of its own.
    pub fn sigma(&self, state: &EstimateState) -> Millimetres {
        state.odometry.sigma(state.position)
    }
}

#[cfg(test)]
mod tests {
    use super::super::restore::tests::{estimator, sensed};
    use super::*;

    fn state(direction: Direction, position: f64, level: u8) -> EstimateState {
        let position = Q16::from_num(position);
        EstimateState { direction, position, level, ..EstimateState::default() }
    }

    #[test]
    fn close_to_a_face_the_level_decides_which_step_is_ahead() {
        // The steps of the prototype are at 18, 40 and 62 mm.
        for (position, level, out, back) in [
            (2.0, 0, 1, 0),
            (17.9, 0, 1, 0),
            // Up before the table has the face.
            (17.9, 1, 2, 1),
            (18.0, 1, 2, 1),
            // The face is passed: behind, even if the level has not been counted yet.
            (18.1, 0, 2, 1),
            (30.0, 1, 2, 1),
            (61.9, 3, 0, 3),
            (75.0, 3, 0, 3),
            (75.0, 2, 0, 3),
        ] {
            for (direction, expected) in [(Direction::Deploy, out), (Direction::Retract, back)] {
                let ahead = estimator().step_ahead(&state(direction, position, level));
                assert_eq!(ahead, expected, "{position} {level}");
            }
        }
    }

    /// Step ahead after turning to `direction` in the middle of this step's corner.
    fn ahead(step: u8, contact: Contact, direction: Direction, position: f64, level: u8) -> u8 {
        let mut state = state(direction, position, level);
        state.extra = u8::from(step == 0);
        state.watch.contact = contact;
        let before = direction.opposite();
        let open = OpenCrossing { step, direction: before, ..OpenCrossing::default() };
        state.crossing = Some(open);
        estimator().turn(&mut state, &sensed(level, 0.0, 0.3), 0);
        state.next_step
    }

    #[test]
    fn turned_on_a_corner_the_step_ahead_is_the_one_beyond_it() {
        let (out, back) = (Direction::Deploy, Direction::Retract);
        // Retracting, and up again.
        assert_eq!(ahead(1, Contact::Corner, out, 17.0, 1), 2);
        assert_eq!(ahead(3, Contact::Corner, out, 61.0, 3), 0);
        // Deploying, and off again; or over it the other way.
        assert_eq!(ahead(2, Contact::Both, back, 30.0, 1), 1);
        assert_eq!(ahead(2, Contact::Corner, back, 39.0, 1), 2);
        // At a step that the table lacks, between the first and the second.
        assert_eq!(ahead(0, Contact::Corner, out, 30.0, 2), 2);
        assert_eq!(ahead(0, Contact::Both, back, 30.0, 1), 1);
    }

    #[test]
    fn a_search_begins_towards_the_wall_that_the_arm_shows() {
        for (up, out, back) in [
            (0.0, (0, 1), (0, 0)),
            (0.1, (0, 1), (0, 0)),
            (0.14, (1, 2), (0, 0)),
            (0.5, (1, 2), (0, 0)),
            (0.86, (1, 2), (0, 0)),
            (0.9, (1, 2), (1, 1)),
            (2.5, (3, 0), (2, 2)),
            (3.0, (3, 0), (3, 3)),
            (-0.05, (0, 1), (0, 0)),
        ] {
            let seen = SensedState { steps_up: Q16::from_num(up), ..sensed(0, 0.0, 0.3) };
            for (direction, expected) in [(Direction::Deploy, out), (Direction::Retract, back)] {
                let mut state = state(direction, 30.0, 0);
                estimator().start_searching(&mut state, &seen);
                assert_eq!((state.level, state.next_step), expected, "{up} {direction:?}");
                assert_eq!(state.watch.contact, Contact::Leaving);
            }
        }
    }

    #[test]
    fn a_step_given_up_counts_to_the_level_that_is_up() {
        // Close before the face at 40 mm: the first step was given up, the second climbed.
        for (missed, out, back) in [(1, 3, 2), (0, 2, 1)] {
            for (direction, expected) in [(Direction::Deploy, out), (Direction::Retract, back)] {
                let state = EstimateState { missed, ..state(direction, 39.9, 1) };
                assert_eq!(estimator().step_ahead(&state), expected);
            }
        }
    }

    #[test]
    fn turned_on_a_wall_it_is_measured_again_and_turned_past_a_corner_it_is_the_one_behind() {
        let wall = sensed(1, 0.4, 0.3);
        let turned = |contact: Contact| {
            let mut state = state(Direction::Retract, 25.0, 1);
            state.watch.contact = contact;
            let mut again = state.watch;
            let seen = estimator().watch_input(&state, &wall);
            estimator().watch.begin(&mut again, &seen);
            estimator().turn(&mut state, &wall, 0);
            (state.watch == again, state.watch.contact, state.next_step)
        };
        assert_eq!(turned(Contact::Wall), (true, Contact::Wall, 1));
        assert_eq!(turned(Contact::Leaving), (false, Contact::Wall, 1));
    }

    #[test]
    fn beyond_the_end_is_farther_than_a_place_is_unsure() {
        for (direction, position, beyond) in [
            (Direction::Retract, -0.45, false),
            (Direction::Retract, -0.55, true),
            (Direction::Deploy, 80.45, false),
            (Direction::Deploy, 80.55, true),
        ] {
            assert_eq!(estimator().is_beyond(&state(direction, position, 0)), beyond);
        }
    }

    #[test]
    fn at_the_end_the_arm_must_show_the_steps_climbed_and_no_others() {
        let (out, back) = (Direction::Deploy, Direction::Retract);
        for (direction, missed, extra, level) in
            [(out, 0, 0, 3), (out, 1, 0, 2), (out, 0, 1, 4), (out, 1, 1, 3), (back, 0, 1, 0)]
        {
            for shown in 0..=4 {
                let state = EstimateState { missed, extra, ..state(direction, 0.0, 0) };
                let confirmed = estimator().confirms_end(&state, &sensed(shown, 0.0, 0.3));
                assert_eq!(confirmed.is_ok(), shown == level, "{missed} {extra} {shown}");
            }
        }
        // Nor is it confirmed by a record that may be off.
        let known = Position::Unconfirmed { searching: false };
        let state = EstimateState { known, ..state(back, 0.0, 0) };
        let confirmed = estimator().confirms_end(&state, &sensed(0, 0.0, 0.3));
        assert_eq!(confirmed, Err(Fault::PlaceUnconfirmed));
        // Nor where its place is less sure than half a millimetre.
        for (sigma, sure) in [(480_000, true), (520_000, false)] {
            let mut state = EstimateState { direction: back, ..EstimateState::default() };
            state.odometry.slip(Q16::ZERO, q16(sigma));
            let confirmed = estimator().confirms_end(&state, &sensed(0, 0.0, 0.3));
            assert_eq!(confirmed.is_ok(), sure, "{sigma}");
        }
    }
}
