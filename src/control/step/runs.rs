//! Before and at the end of a run: where the wheel is, what lies ahead, whether it
//! has arrived.

use super::state::OpenCrossing;
use super::{Controller, Pass, State};
use crate::estimate::crossing::Contact;
use crate::restart::PositionConfidence;
use crate::supervise::{Direction, Fault, Trigger};
use crate::units::{Millimetres, Q16, Ratio, q16};

/// Off a whole number of steps by no more than this, the arm shows a level: half the
/// hysteresis of a corner, and the sleeve's and the arm's tolerance.
const LEVEL_WITHIN: Ratio = q16(120_000);

impl Controller {
    /// Gives the odometry its origin. Only the stow end, found unloaded, is certain;
    /// elsewhere the arm tells the level, a place on it is assumed, and the next step is
    /// searched for.
    pub(super) fn locate(&self, state: &mut State, pass: &mut Pass<'_>, stowed: bool) {
        if stowed {
            state.odometry.set(pass.sensed.travel, Millimetres::ZERO);
            state.located = true;
            (state.searching, state.unsure) = (false, false);
            (state.kept, state.resumed) = (None, false);
            state.crossing = None;
            state.level = 0;
            (state.given_up, state.extra) = (0, 0);
            pass.position = Millimetres::ZERO;
            return;
        }
        if state.located || self.go_on_from(state, pass) {
            return;
        }
        state.level = pass.sensed.level;
        let level = usize::from(state.level);
        let low = level.checked_sub(1).and_then(|i| self.steps.get(i)).copied();
        let high = self.steps.get(level).copied();
        let position = match (low, high) {
            _ if level == 0 => Millimetres::ZERO,
            (Some(low), Some(high)) => (low + high) * q16(500_000),
            _ => self.travel,
        };
        state.odometry.set(pass.sensed.travel, position);
        state.located = true;
        (state.searching, state.unsure) = (true, false);
        pass.position = position;
    }

    /// Before a run: step ahead, baseline, plan.
    pub(super) fn prepare(&self, state: &mut State, pass: &mut Pass<'_>, direction: Direction) {
        let turned = state.direction != direction;
        state.direction = direction;
        state.leaving = None;
        // A crossing that was begun in its middle has no wall measured to turn back to.
        let between = state.crossing.as_ref().is_some_and(|open| open.resumed);
        // Away from the end that it went to in doubt, steps lie ahead that tell the place.
        state.searching |= turned && state.trust() == PositionConfidence::Unsure;
        if core::mem::take(&mut state.resumed) || turned && between {
            self.resume(state, pass, direction);
        } else if state.searching {
            self.start_searching(state, pass, direction);
        } else if turned {
            self.turn(state, pass, direction);
        } else if state.crossing.is_none() {
            self.start_afresh(state, pass, direction);
        }
        state.ramping = false;
        state.braking = false;
        state.late = false;
        state.waited = false;
        state.standing_since = None;
        state.lost_in_a_row = 0;
        self.ask(state, pass);
        if state.searching && state.next_step == 0 {
            self.give_up(state, pass, Fault::PositionUnknown);
        }
    }

    fn start_afresh(&self, state: &mut State, pass: &Pass<'_>, direction: Direction) {
        state.next_step = self.step_ahead(state, pass, direction);
        self.begin_on_wall(state, pass, direction);
    }

    /// After a restart away from the stow end the wheel may stand on a corner: off it
    /// first, towards the wall that the arm shows, then search.
    fn start_searching(&self, state: &mut State, pass: &Pass<'_>, direction: Direction) {
        let steps = self.steps.len() as u8;
        let up = pass.sensed.steps_up.max(Q16::ZERO);
        let level = match direction {
            // Up to the next whole step, or down to the last.
            Direction::Deploy => up + (q16(1_000_000) - LEVEL_WITHIN),
            Direction::Retract => up + LEVEL_WITHIN,
        };
        let level = level.floor().clamp(0, 255) as u8;
        state.crossing = None;
        state.level = level;
        state.next_step = match direction {
            Direction::Deploy if level < steps => level + 1,
            Direction::Deploy => 0,
            Direction::Retract => level.min(steps),
        };
        // As if the wheel had just come onto a corner: clear of that it surely is then.
        self.begin_off(state, pass, direction, self.corner_reach);
    }

    /// Starts towards the wall of the present level, off a corner whose face may still be so
    /// far ahead.
    pub(super) fn begin_off(
        &self,
        state: &mut State,
        pass: &Pass<'_>,
        direction: Direction,
        ahead: Millimetres,
    ) {
        state.leaving = Some(match direction {
            Direction::Deploy => pass.position + ahead,
            Direction::Retract => pass.position,
        });
        self.watch.begin_on_corner(&mut state.watch, direction, state.level);
    }

    /// Turning back, perhaps on a corner.
    fn turn(&self, state: &mut State, pass: &mut Pass<'_>, direction: Direction) {
        let open = state.crossing.take();
        let before = state.watch.contact;
        self.watch.reverse(&mut state.watch, direction);
        let Some(open) = open else {
            if before == Contact::Wall {
                self.start_afresh(state, pass, direction);
            } else {
                state.next_step = self.step_ahead(state, pass, direction);
            }
            return;
        };
        let table = self.step_position(open.step);
        state.leaving = open.lift.map(|point| point.face).or(table);
        let steps = self.steps.len() as u8;
        let beyond = if open.step < steps { open.step + 1 } else { 0 };
        let again = OpenCrossing {
            turned: true,
            ..OpenCrossing::begin(open.step, direction, false, pass.now)
        };
        match (before, direction) {
            // Off the corner onto the wall it came from.
            (Contact::Both, Direction::Retract) => {
                state.next_step = open.step.saturating_sub(1);
            }
            (Contact::Corner, Direction::Deploy) => state.next_step = beyond,
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
            state.next_step = self.step_ahead(state, pass, direction);
        }
    }

    /// Number of the step ahead, 0 if there is none.
    fn step_ahead(&self, state: &State, pass: &Pass<'_>, direction: Direction) -> u8 {
        let behind = self.steps.iter().take_while(|face| **face <= pass.position).count();
        // Close to a face the level decides: a step is behind once the wheel is up.
        let up = usize::from((state.level + state.given_up).saturating_sub(state.extra));
        let behind = if up == behind + 1 { up.min(self.steps.len()) } else { behind };
        match direction {
            Direction::Deploy if behind < self.steps.len() => behind as u8 + 1,
            Direction::Deploy => 0,
            Direction::Retract => behind as u8,
        }
    }

    /// The end of travel, confirmed by the arm.
    pub(super) fn await_arrival(
        &self,
        state: &mut State,
        pass: &mut Pass<'_>,
        direction: Direction,
    ) {
        let remaining = self.schedule.remaining(direction, pass.position);
        if !self.schedule.arrived(remaining) || state.profile.speed() != Q16::ZERO {
            return;
        }
        // A crossing still open gets its line first.
        if let Some(point) = state.crossing.as_ref().and_then(|open| open.lift) {
            self.closed(state, pass, point.gap, false);
        }
        if state.line.is_some() {
            return;
        }
        let steps = self.steps.len() as u8;
        let expected = match direction {
            Direction::Deploy => (steps + state.extra).saturating_sub(state.given_up),
            Direction::Retract => 0,
        };
        let on_wall = matches!(state.watch.contact, Contact::Wall | Contact::Leaving);
        if on_wall && pass.sensed.level == expected && !state.searching {
            self.trigger(state, pass, Trigger::Arrived);
        } else {
            self.give_up(state, pass, Fault::LevelMismatch);
        }
    }
}

#[cfg(test)]
#[allow(clippy::float_arithmetic, reason = "quantities of a test")]
mod tests {
    use super::super::tests::{at, sensed};
    use super::*;
    use crate::supervise::{Leg, Mode};

    #[test]
    fn close_to_a_face_the_level_tells_which_step_is_ahead() {
        // The steps of the prototype stand at 18, 40 and 62 mm.
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
            let mut state = State::default();
            state.level = level;
            at(&sensed(level, 0.0, 0.3), position, |controller, pass| {
                let ahead = |direction| controller.step_ahead(&state, pass, direction);
                assert_eq!(ahead(Direction::Deploy), out, "{position} {level}");
                assert_eq!(ahead(Direction::Retract), back, "{position} {level}");
            });
        }
    }

    /// Step ahead after turning to `direction` in the middle of this step's corner.
    fn ahead(step: u8, contact: Contact, direction: Direction, position: f64, level: u8) -> u8 {
        let before = match direction {
            Direction::Deploy => Direction::Retract,
            Direction::Retract => Direction::Deploy,
        };
        let mut state = State::default();
        (state.level, state.extra) = (level, u8::from(step == 0));
        state.watch.contact = contact;
        state.crossing = Some(OpenCrossing::begin(step, before, true, 0));
        at(&sensed(level, 0.0, 0.3), position, |controller, pass| {
            controller.turn(&mut state, pass, direction);
        });
        state.next_step
    }

    #[test]
    fn turned_on_a_corner_the_step_ahead_is_the_one_beyond_it() {
        let (out, back) = (Direction::Deploy, Direction::Retract);
        // On the way back, and up again.
        assert_eq!(ahead(1, Contact::Corner, out, 17.0, 1), 2);
        assert_eq!(ahead(2, Contact::Corner, out, 39.0, 2), 3);
        assert_eq!(ahead(3, Contact::Corner, out, 61.0, 3), 0);
        // On the way out, and off again; or over it the other way.
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
            let mut seen = sensed(0, 0.0, 0.3);
            seen.steps_up = Q16::from_num(up);
            for (direction, (level, next)) in [(Direction::Deploy, out), (Direction::Retract, back)]
            {
                let mut state = State::default();
                let clear = at(&seen, 30.0, |controller, pass| {
                    controller.start_searching(&mut state, pass, direction);
                    match direction {
                        Direction::Deploy => pass.position + controller.corner_reach(),
                        Direction::Retract => pass.position,
                    }
                });
                assert_eq!((state.level, state.next_step), (level, next), "{up} {direction:?}");
                assert_eq!(state.leaving, Some(clear), "{up} {direction:?}");
                assert_eq!(state.watch.contact, Contact::Leaving);
            }
        }
    }

    #[test]
    fn a_step_given_up_counts_to_the_level_that_is_up() {
        // Close before the face at 40 mm: the first step was given up, the second climbed.
        let mut state = State::default();
        (state.level, state.given_up) = (1, 1);
        at(&sensed(1, 0.0, 0.3), 39.9, |controller, pass| {
            assert_eq!(controller.step_ahead(&state, pass, Direction::Deploy), 3);
            assert_eq!(controller.step_ahead(&state, pass, Direction::Retract), 2);
            state.given_up = 0;
            assert_eq!(controller.step_ahead(&state, pass, Direction::Deploy), 2);
        });
    }

    #[test]
    fn turned_on_a_wall_it_is_measured_anew_and_turned_past_a_corner_it_is_the_one_behind() {
        let wall = sensed(1, 0.4, 0.3);
        let turned = |contact: Contact| {
            let mut state = State::default();
            state.level = 1;
            state.watch.contact = contact;
            at(&wall, 25.0, |controller, pass| {
                let mut anew = state.watch;
                let seen = controller.seen(&state, pass);
                controller.watch.begin(&mut anew, &seen);
                controller.turn(&mut state, pass, Direction::Retract);
                (state.watch == anew, state.watch.contact, state.next_step)
            })
        };
        assert_eq!(turned(Contact::Wall), (true, Contact::Wall, 1));
        assert_eq!(turned(Contact::Leaving), (false, Contact::Wall, 1));
    }

    #[test]
    fn at_the_end_the_arm_must_show_the_steps_climbed_and_no_others() {
        let (out, back) = (Direction::Deploy, Direction::Retract);
        for (direction, given_up, extra, level) in
            [(out, 0, 0, 3), (out, 1, 0, 2), (out, 0, 1, 4), (out, 1, 1, 3), (back, 0, 1, 0)]
        {
            for shown in 0..=4 {
                let mut state = State::default();
                state.mode = Mode::Run(direction, Leg::Cruise);
                (state.given_up, state.extra) = (given_up, extra);
                at(&sensed(shown, 0.0, 0.3), 0.0, |controller, pass| {
                    pass.position = if direction == out { controller.travel } else { Q16::ZERO };
                    controller.await_arrival(&mut state, pass, direction);
                });
                let mismatch = Mode::FaultHold(Fault::LevelMismatch);
                let expected = if shown == level { Mode::Complete(direction) } else { mismatch };
                assert_eq!(state.mode, expected, "{given_up} {extra} {shown}");
            }
        }
    }
}
