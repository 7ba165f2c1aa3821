//! What each mode waits for, and what entering a mode does.

use super::{Controller, Pass, State};
use crate::control::schedule::Targets;
use crate::control::start::{TEST_TICKS, all_answer, at_rest, silent, stowed};
use crate::estimate::crossing::Seen;
use crate::log::Event;
use crate::model::{Plan, PlanRequest};
use crate::supervise::{Direction, Fault, Limit, Mode, Trigger, next};
use crate::units::{Millimetres, Q16, q16};

/// Ticks that a preload must stand before the drive starts.
const STANDING_TICKS: u32 = 60;
/// Ticks after which a sensor that has not answered since boot counts as missing.
const BOOT_TICKS: u32 = 2000;
/// Ticks after which a zero that does not come in counts as failed.
const ZERO_TICKS: u32 = 2000;

impl Controller {
    /// Offers a trigger to the table; whether it was taken.
    pub(super) fn trigger(&self, state: &mut State, pass: &mut Pass<'_>, trigger: Trigger) -> bool {
        let Some(mode) = next(state.mode, trigger) else { return false };
        if let Trigger::Fault(fault) = trigger {
            pass.log(Event::Fault(fault));
        }
        if mode != state.mode {
            let before = state.mode;
            state.mode = mode;
            state.in_mode = 0;
            pass.log(Event::Mode(mode));
            self.enter(state, pass, before);
        }
        true
    }

    fn enter(&self, state: &mut State, pass: &mut Pass<'_>, before: Mode) {
        match state.mode {
            Mode::Zero => state.senses.begin_zero(),
            Mode::Preload(direction) => self.prepare(state, pass, direction),
            Mode::Idle if matches!(before, Mode::SelfTest | Mode::Zero) => {
                self.locate(state, pass);
            }
            _ => {}
        }
    }

    /// What the present mode waits for.
    pub(super) fn advance_mode(&self, state: &mut State, pass: &mut Pass<'_>) {
        state.in_mode = state.in_mode.saturating_add(1);
        match state.mode {
            Mode::Boot if all_answer(pass.sensed) => {
                self.trigger(state, pass, Trigger::SensorsAnswer);
            }
            Mode::Boot if state.in_mode >= BOOT_TICKS => {
                let fault = silent(pass.sensed);
                self.trigger(state, pass, Trigger::Fault(fault));
            }
            Mode::SelfTest if !at_rest(pass.sensed) => state.in_mode = 0,
            Mode::SelfTest if state.in_mode >= TEST_TICKS => {
                let stowed = stowed(pass.sensed);
                self.trigger(state, pass, Trigger::TestPassed { stowed });
            }
            Mode::Zero => match state.senses.zeroed() {
                Some(true) => {
                    self.trigger(state, pass, Trigger::Zeroed);
                }
                None if state.in_mode < ZERO_TICKS => {}
                _ => {
                    self.trigger(state, pass, Trigger::Fault(Fault::SelfTest));
                }
            },
            Mode::Preload(direction) => self.await_preload(state, pass, direction),
            Mode::Run(direction, _) => self.await_arrival(state, pass, direction),
            Mode::Stopping(_) if state.profile.speed() == Q16::ZERO && at_rest(pass.sensed) => {
                self.trigger(state, pass, Trigger::AtRest);
            }
            _ => {}
        }
    }

    /// Gives the odometry its origin: the arm tells the level, and a level at either
    /// end tells the position. Between the ends the middle of the level is taken for
    /// want of better, and the next step is searched for.
    fn locate(&self, state: &mut State, pass: &mut Pass<'_>) {
        state.level = pass.sensed.level;
        if state.located {
            return;
        }
        let level = usize::from(state.level);
        let low = level.checked_sub(1).and_then(|i| self.steps.get(i)).copied();
        let high = self.steps.get(level).copied();
        let position = match (low, high) {
            _ if level == 0 => Millimetres::ZERO,
            (_, None) | (None, _) => self.travel,
            (Some(low), Some(high)) => {
                state.searching = true;
                (low + high) * q16(500_000)
            }
        };
        state.odometry.set(pass.sensed.travel, position);
        state.located = true;
        pass.position = position;
    }

    /// Before a run: next step, baseline, plan.
    fn prepare(&self, state: &mut State, pass: &mut Pass<'_>, direction: Direction) {
        let turned = state.direction != direction && state.crossing.is_some();
        state.direction = direction;
        let steps = self.steps.len() as u8;
        if turned {
            self.watch.reverse(&mut state.watch, direction);
        }
        if !turned && state.crossing.is_none() {
            let seen = self.seen(state, pass);
            self.watch.begin(&mut state.watch, &seen);
        }
        if state.crossing.is_none() || turned {
            state.next_step = match direction {
                Direction::Deploy if state.level < steps => state.level + 1,
                Direction::Deploy => 0,
                Direction::Retract => state.level.min(steps),
            };
            state.crossing = None;
        }
        state.ramping = false;
        state.late = false;
        state.waited = false;
        state.standing_since = None;
        self.ask(state, pass);
    }

    fn await_preload(&self, state: &mut State, pass: &mut Pass<'_>, direction: Direction) {
        let seen = self.seen(state, pass);
        self.watch.rest(&mut state.watch, &seen);
        let Some(plan) = state.plan else {
            state.in_mode = 0;
            return;
        };
        let course = self.course(state, pass, direction);
        let wanted = self.schedule.targets(&self.rise, &plan, &course).preload;
        let off = (pass.sensed.preload_filtered - wanted).abs();
        if off > self.schedule.stands_within() {
            state.in_mode = 0;
        } else if state.in_mode >= STANDING_TICKS {
            self.trigger(state, pass, Trigger::PreloadStands);
        }
    }

    fn await_arrival(&self, state: &mut State, pass: &mut Pass<'_>, direction: Direction) {
        let remaining = self.schedule.remaining(direction, pass.position);
        if !self.schedule.arrived(remaining) || state.profile.speed() != Q16::ZERO {
            return;
        }
        let home = direction == Direction::Deploy || pass.sensed.level == 0;
        if pass.sensed.level == state.level && home {
            self.trigger(state, pass, Trigger::Arrived);
        } else {
            self.trigger(state, pass, Trigger::Fault(Fault::LevelMismatch));
        }
    }

    /// Asks the model for the schedule of the step ahead.
    pub(super) fn ask(&self, state: &mut State, pass: &mut Pass<'_>) {
        state.sequence = state.sequence.wrapping_add(1);
        if state.plan.is_some_and(|plan| plan.direction != state.direction) {
            state.plan = None;
        }
        pass.request = Some(PlanRequest {
            sequence: state.sequence,
            direction: state.direction,
            step: state.next_step,
            scale: state.scale,
            review: state.review,
        });
    }

    /// Takes the model's answer if it is the one waited for.
    pub(super) fn take_plan(&self, state: &mut State, pass: &mut Pass<'_>, plan: Option<Plan>) {
        let Some(plan) = plan.filter(|plan| plan.sequence == state.sequence) else { return };
        for limit in plan.limits.into_iter().flatten() {
            let known = state.plan.is_some_and(|old| old.limits.contains(&Some(limit)));
            if !known {
                pass.log(Event::Limit(limit));
            }
        }
        if let Some(outcome) = plan.outcome {
            state.scale = outcome.scale;
            if outcome.bounded {
                pass.log(Event::Limit(Limit::AdaptationBounded));
            }
            self.close_line(state, pass, &outcome);
        }
        state.plan = Some(plan);
    }

    /// Since when the crossing preload stands, and whether the drive waits for it.
    pub(super) fn note_preload(
        &self,
        state: &mut State,
        pass: &mut Pass<'_>,
        plan: &Plan,
        targets: &Targets,
    ) {
        let stands =
            plan.cross_preload - pass.sensed.preload_filtered <= self.schedule.stands_within();
        state.standing_since = match state.standing_since {
            Some(since) if stands => Some(since),
            _ if stands => Some(pass.now),
            _ => None,
        };
        if targets.waiting && !state.waited {
            state.waited = true;
            pass.log(Event::Limit(Limit::PreloadWait));
        }
    }

    /// What the crossing watch looks at.
    pub(super) fn seen(&self, state: &State, pass: &Pass<'_>) -> Seen {
        let course = self.course(state, pass, state.direction);
        let near =
            self.schedule.to_window(&self.rise, &course).is_some_and(|ahead| ahead <= Q16::ZERO);
        Seen {
            radius: pass.sensed.radius.value,
            compression: pass.sensed.compression_filtered,
            near,
            clear: self.clear_of(state, pass),
        }
    }
}
