//! The exchange with the model task.

use super::{Controller, CrossingRecord, Event, Pass, State};
use crate::estimate::OpenCrossing;
use crate::fault::{Fault, Limit};
use crate::model::plan::PLAN_TICKS;
use crate::model::{Outcome, Plan, PlanRequest};
use crate::supervise::Mode;
use crate::units::{Direction, Millimetres, Newtons, Q16, Seconds, Tick, q16, ticks_to_seconds};

/// Ticks for which the drive may wait for the preload unreported: a spring that moves with the
/// wheel takes that long to be followed.
const WAIT_TICKS: u32 = 100;
/// Slip on a corner that ends a run for want of friction, mm: twice what a measured one is off by.
const SURE_SLIP: Millimetres = q16(1_000_000);
/// Ticks within which the model task must answer: more than its longest search takes with the waits
/// of flash, 1.2 s at rest and 1.0 s under way. One that hangs is found by its check-ins.
const ANSWER_TICKS: u32 = 1200;

impl Controller {
    /// Asks the model for the schedule of the step ahead.
    pub(super) fn ask(&self, state: &mut State, tick: &mut Pass<'_>) {
        let (planning, estimate) = (&mut state.planning, &state.estimate);
        planning.sequence = planning.sequence.wrapping_add(1);
        planning.asked = 1;
        planning.answer = None;
        if planning.plan.as_ref().is_some_and(|plan| plan.direction != estimate.direction) {
            planning.plan = None;
        }
        tick.output.request = Some(PlanRequest {
            sequence: planning.sequence,
            direction: estimate.direction,
            step: estimate.next_step,
            learned: planning.learned,
            preload: tick.sensed.preload_filtered,
            distance: self.estimator.distance(estimate).unwrap_or_default(),
            speed: state.profile.speed(),
            searching: estimate.is_searching(),
            review: planning.review,
            slipped: planning.slipped,
        });
    }

    /// Takes the model's answer if it is the one waited for.
    pub(super) fn take_plan(&self, state: &mut State, tick: &mut Pass<'_>, plan: Option<&Plan>) {
        let planning = &mut state.planning;
        if let Some(plan) = plan.filter(|plan| plan.sequence == planning.sequence) {
            planning.answer = Some(*plan);
        }
        if planning.asked == 0 {
            return;
        }
        planning.asked += 1;
        if planning.asked <= PLAN_TICKS {
            return;
        }
        let Some(plan) = planning.answer.take() else {
            let waits = matches!(state.mode, Mode::Preload(_) | Mode::Run(..));
            if planning.asked > ANSWER_TICKS && waits {
                planning.asked = 0;
                tick.fail(Fault::ModelSilent);
            }
            return;
        };
        planning.asked = 0;
        for limit in plan.limits.into_iter().flatten() {
            let known = planning.plan.as_ref().is_some_and(|old| old.limits.contains(&Some(limit)));
            if !known {
                tick.log(Event::Limit(limit));
            }
        }
        if let Some(outcome) = plan.outcome.as_ref() {
            planning.learned = outcome.learned;
            if outcome.bounded {
                tick.log(Event::Limit(Limit::AdaptationBounded));
            }
            if outcome.strange {
                tick.log(Event::Limit(Limit::GapStrange));
            }
            if outcome.wide {
                tick.log(Event::Limit(Limit::GapWide));
            }
            planning.review = None;
            if let Some(open) = planning.closed.take() {
                record(tick, &open, outcome);
            }
        }
        planning.plan = Some(plan);
        planning.slipped = None;
        planning.learned.slips = plan.slips;
        let sure = planning.lost > SURE_SLIP;
        if plan.short && sure && matches!(state.mode, Mode::Run(Direction::Deploy, _)) {
            tick.fail(Fault::FrictionShort);
        }
    }

    /// Since when the crossing preload has been reached, and whether the drive waits for it.
    pub(super) fn note_preload(
        &self,
        state: &mut State,
        tick: &mut Pass<'_>,
        cross_preload: Newtons,
        waiting: bool,
    ) {
        let missing = cross_preload - tick.sensed.preload_filtered;
        let reached = missing <= self.schedule.reached_within;
        let approach = &mut state.approach;
        let since = approach.standing_since.unwrap_or(tick.now);
        approach.standing_since = reached.then_some(since);
        // A preload that flickers about its reference is still waited for by a wheel at rest.
        let moves = state.profile.speed() > Q16::ZERO;
        approach.waiting = match (waiting, moves) {
            (true, _) => approach.waiting + 1,
            (false, true) => 0,
            (false, false) => approach.waiting,
        };
        if approach.waiting > WAIT_TICKS && !approach.wait_reported {
            approach.wait_reported = true;
            tick.log(Event::Limit(Limit::PreloadWait));
        }
        if approach.waiting > self.preload_timeout {
            tick.fail(Fault::PreloadNotReached);
        }
    }
}

/// Reports a crossing with the model's review.
fn record(tick: &mut Pass<'_>, open: &OpenCrossing, outcome: &Outcome) {
    let Some(point) = open.lift else { return };
    let slip = open.slipped(Q16::ZERO);
    tick.log(Event::Crossing(CrossingRecord {
        index: open.step,
        direction: open.direction,
        position: point.face,
        residual: point.residual,
        speed: point.speed,
        preload: point.preload,
        peak_preload: open.peak_preload,
        compression: open.deepest,
        gap_predicted: outcome.gap_predicted,
        gap_measured: open.gap,
        height: open.height,
        slip: slip.map_or(Q16::ZERO, |slip| slip.amount),
        slip_sigma: slip.map_or(Q16::ZERO, |slip| slip.sigma),
        lead_time: lead_time(open, point.at),
        slip_margin: outcome.slip_margin,
        stiffness_scale: outcome.learned.scale,
        limited_by: open.limited_by,
    }));
}

/// Time for which the preload had been reached before the corner was detected; negative by how
/// long it was still missing.
fn lead_time(open: &OpenCrossing, lifted_at: Tick) -> Seconds {
    match open.standing_since {
        Some(since) => ticks_to_seconds(open.touched_at.wrapping_sub(since)),
        None => -ticks_to_seconds(lifted_at.wrapping_sub(open.touched_at)),
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{sensed, within};
    use super::*;
    use crate::supervise::Leg;

    /// In motion on the first wall.
    fn running() -> State {
        State { mode: Mode::Run(Direction::Deploy, Leg::Cruise), ..State::default() }
    }

    #[test]
    fn a_model_that_does_not_answer_is_a_fault_after_its_time() {
        let mut state = running();
        within(&sensed(0, 0.0, 0.3), |controller, pass| {
            controller.ask(&mut state, pass);
            for tick in 1..ANSWER_TICKS {
                controller.take_plan(&mut state, pass, None);
                controller.transit(&mut state, pass);
                assert_eq!(state.mode, running().mode, "{tick}");
            }
            controller.take_plan(&mut state, pass, None);
            controller.transit(&mut state, pass);
        });
        assert_eq!(state.mode, Mode::FaultHold(Fault::ModelSilent));
        // Without a request no answer is missed.
        let mut state = running();
        within(&sensed(0, 0.0, 0.3), |controller, pass| {
            for _ in 0..2000 {
                controller.take_plan(&mut state, pass, None);
                controller.transit(&mut state, pass);
            }
        });
        assert_eq!(state.mode, running().mode);
    }

    #[test]
    fn a_preload_that_is_never_reached_is_a_fault_after_its_timeout() {
        let mut state = running();
        within(&sensed(0, 0.0, 0.3), |controller, pass| {
            let cross = q16(48_000_000);
            for tick in 0..controller.preload_timeout {
                controller.note_preload(&mut state, pass, cross, true);
                controller.transit(&mut state, pass);
                assert_eq!(state.mode, running().mode, "{tick}");
            }
            // Reported once.
            let wait = Event::Limit(Limit::PreloadWait);
            assert_eq!(pass.output.events.iter().filter(|e| e.event == wait).count(), 1);
            controller.note_preload(&mut state, pass, cross, true);
            controller.transit(&mut state, pass);
        });
        assert_eq!(state.mode, Mode::FaultHold(Fault::PreloadNotReached));
    }

    #[test]
    fn a_preload_that_flickers_about_its_reference_is_a_fault_too() {
        let mut state = running();
        within(&sensed(0, 0.0, 0.3), |controller, pass| {
            for tick in 0..=2 * controller.preload_timeout {
                controller.note_preload(&mut state, pass, q16(48_000_000), tick % 2 == 0);
                controller.transit(&mut state, pass);
            }
        });
        assert_eq!(state.mode, Mode::FaultHold(Fault::PreloadNotReached));
    }

    #[test]
    fn a_preload_that_came_too_late_has_a_negative_lead() {
        let lead = |standing_since: Option<Tick>| {
            let open = OpenCrossing { touched_at: 5000, standing_since, ..OpenCrossing::default() };
            lead_time(&open, 5400).to_num::<f64>()
        };
        // Reached 0.25 s before the touch; or not yet when the wheel lifted, 0.4 s after it.
        assert!((lead(Some(4750)) - 0.25).abs() < 1e-4, "{}", lead(Some(4750)));
        assert!((lead(None) + 0.4).abs() < 1e-4, "{}", lead(None));
    }
}
