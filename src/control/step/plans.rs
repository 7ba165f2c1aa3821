//! The exchange with the model task, and what a tick makes of the plan.

use super::{Controller, Pass, State};
use crate::control::schedule::Targets;
use crate::log::Event;
use crate::model::{Plan, PlanRequest};
use crate::supervise::{Fault, Limit, Mode};
use crate::units::Newtons;

/// Ticks within which the model task must answer.
const ANSWER_TICKS: u32 = 500;

impl Controller {
    /// Asks the model for the schedule of the step ahead.
    pub(super) fn ask(&self, state: &mut State, pass: &mut Pass<'_>) {
        state.sequence = state.sequence.wrapping_add(1);
        state.asked = 1;
        if state.plan.as_ref().is_some_and(|plan| plan.direction != state.direction) {
            state.plan = None;
        }
        pass.output.request = Some(PlanRequest {
            sequence: state.sequence,
            direction: state.direction,
            step: state.next_step,
            scale: state.scale,
            review: state.review,
        });
    }

    /// Takes the model's answer if it is the one waited for.
    pub(super) fn take_plan(&self, state: &mut State, pass: &mut Pass<'_>, plan: Option<&Plan>) {
        let Some(plan) = plan.filter(|plan| plan.sequence == state.sequence) else {
            self.await_answer(state, pass);
            return;
        };
        state.asked = 0;
        for limit in plan.limits.into_iter().flatten() {
            let known = state.plan.as_ref().is_some_and(|old| old.limits.contains(&Some(limit)));
            if !known {
                pass.log(Event::Limit(limit));
            }
        }
        if let Some(outcome) = plan.outcome.as_ref() {
            state.scale = outcome.scale;
            if outcome.bounded {
                pass.log(Event::Limit(Limit::AdaptationBounded));
            }
            if outcome.strange {
                pass.log(Event::Limit(Limit::GapStrange));
            }
            self.close_line(state, pass, outcome);
        }
        state.plan = Some(*plan);
    }

    fn await_answer(&self, state: &mut State, pass: &mut Pass<'_>) {
        if state.asked == 0 {
            return;
        }
        state.asked += 1;
        if state.asked > ANSWER_TICKS && matches!(state.mode, Mode::Preload(_) | Mode::Run(..)) {
            state.asked = 0;
            self.give_up(state, pass, Fault::ModelSilent);
        }
    }

    /// Since when the crossing preload stands, and whether the drive waits for it.
    pub(super) fn note_preload(
        &self,
        state: &mut State,
        pass: &mut Pass<'_>,
        cross_preload: Newtons,
        targets: &Targets,
    ) {
        let missing = cross_preload - pass.sensed.preload_filtered;
        let stands = missing <= self.schedule.stands_within();
        state.standing_since = match state.standing_since {
            Some(since) if stands => Some(since),
            _ if stands => Some(pass.now),
            _ => None,
        };
        state.waiting = if targets.waiting { state.waiting + 1 } else { 0 };
        if targets.waiting && !state.waited {
            state.waited = true;
            pass.log(Event::Limit(Limit::PreloadWait));
        }
        if state.waiting > self.patience {
            self.give_up(state, pass, Fault::PreloadNotReached);
        }
    }
}

#[cfg(test)]
#[allow(clippy::float_arithmetic, reason = "quantities of a test")]
mod tests {
    use super::super::tests::{at, sensed};
    use super::*;
    use crate::supervise::{Direction, Leg};
    use crate::units::q16;

    /// Under way on the first wall.
    fn running() -> State {
        let mut state = State::default();
        state.mode = Mode::Run(Direction::Deploy, Leg::Cruise);
        state
    }

    #[test]
    fn a_model_that_does_not_answer_is_given_up_after_half_a_second() {
        let mut state = running();
        at(&sensed(0, 0.0, 0.3), 2.0, |controller, pass| {
            controller.ask(&mut state, pass);
            for tick in 1..500 {
                controller.take_plan(&mut state, pass, None);
                assert_eq!(state.mode, running().mode, "{tick}");
            }
            controller.take_plan(&mut state, pass, None);
        });
        assert_eq!(state.mode, Mode::FaultHold(Fault::ModelSilent));
        // Nothing is missed that was not asked for.
        let mut state = running();
        at(&sensed(0, 0.0, 0.3), 2.0, |controller, pass| {
            for _ in 0..2000 {
                controller.take_plan(&mut state, pass, None);
            }
        });
        assert_eq!(state.mode, running().mode);
    }

    #[test]
    fn a_preload_that_never_stands_is_given_up_when_the_patience_is_over() {
        let mut state = running();
        let waiting = Targets {
            speed: q16(1_000_000),
            preload: q16(48_000_000),
            ramping: true,
            braking: true,
            approaching: true,
            waiting: true,
        };
        at(&sensed(0, 0.0, 0.3), 2.0, |controller, pass| {
            let cross = waiting.preload;
            for tick in 0..controller.patience {
                controller.note_preload(&mut state, pass, cross, &waiting);
                assert_eq!(state.mode, running().mode, "{tick}");
            }
            // Told once.
            let told = Event::Limit(Limit::PreloadWait);
            assert_eq!(pass.output.events.iter().filter(|e| e.event == told).count(), 1);
            controller.note_preload(&mut state, pass, cross, &waiting);
        });
        assert_eq!(state.mode, Mode::FaultHold(Fault::PreloadNotReached));
    }
}
