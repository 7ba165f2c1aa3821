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
