//! Targets of the tick, and the two loops that follow them.

use super::{Controller, Pass, State};
use crate::control::schedule::{Course, Targets};
use crate::control::speed_loop::SpeedLoopState;
use crate::numeric::{between, divide};
use crate::supervise::{Mode, Trigger};
use crate::units::{
    Direction, Millimetres, MillimetresPerSecond, MotorCommand, Newtons, NewtonsPerSecond, Q16,
    Ratio, q16,
};

/// Slope below which a corner does not limit the speed.
pub(super) const LEVEL_SLOPE: Ratio = q16(50_000);

impl Controller {
    /// Where the wheel is on its run.
    pub(super) fn course(&self, state: &State, tick: &Pass<'_>, direction: Direction) -> Course {
        let (steps, estimate) = (self.estimator.steps(), &state.estimate);
        let felt = self.estimator.felt(estimate);
        let behind = state.preload_loop.due() - tick.sensed.preload_filtered;
        // A wheel that climbs does not rush at its corner when the preload is hardly less late.
        let within = self.schedule.reached_within;
        let held_back = state.approach.late && direction == Direction::Deploy;
        let within = if held_back { within.half() } else { within };
        Course {
            direction,
            distance: felt.or_else(|| self.estimator.distance(estimate)),
            felt: felt.is_some(),
            remaining: steps.remaining(direction, estimate.position),
            critical: estimate.critical(),
            ramping: state.approach.ramping,
            begun: state.approach.begun,
            speed: state.profile.speed(),
            acceleration: state.profile.acceleration(),
            reference: state.preload_loop.reference(tick.sensed.preload.value),
            preload: estimate.remembered_preload(),
            preload_late: behind > within,
        }
    }

    /// Schedule of this tick; holds preload and position while nothing runs.
    pub(super) fn targets(&self, state: &mut State, tick: &mut Pass<'_>) -> Targets {
        let hold = Targets {
            preload: state.preload_loop.reference(tick.sensed.preload.value),
            ramping: state.approach.ramping,
            begun: state.approach.begun,
            ..Targets::default()
        };
        let (direction, running) = match state.mode {
            Mode::Preload(direction) => (direction, false),
            Mode::Run(direction, _) => (direction, true),
            _ => return hold,
        };
        let Some(plan) = state.planning.plan.as_ref() else {
            // Any plan rolls with this.
            let least = if running { Q16::ZERO } else { self.rolling_preload };
            let preload = hold.preload.max(least);
            return Targets { preload, ..hold };
        };
        let course = self.course(state, tick, direction);
        let mut plan = *plan;
        let learned = &state.planning.learned;
        if state.planning.asked > 0 && (learned.unknown || learned.extra_load > Q16::ZERO) {
            // The plan that is on its way knows of it: until then the wheel does not look for the
            // corner faster than any plan would.
            plan.approach.window_speed = plan.approach.window_speed.min(self.least_speed);
        }
        state.approach.late = course.preload_late;
        let mut targets = self.schedule.targets(self.estimator.steps(), &plan, &course);
        state.approach.ramping = targets.ramping;
        state.approach.begun = targets.begun;
        if !running {
            targets.speed = Q16::ZERO;
            return targets;
        }
        let found = self.estimator.watch_expectation(&mut state.estimate);
        self.take_findings(state, tick, found);
        targets.speed = self.climb(state, targets.speed);
        let surprised = state.estimate.slow_down();
        let unplanned = plan.step != state.estimate.next_step;
        if surprised || unplanned {
            targets.preload = if surprised { plan.cross_preload } else { plan.ramp_preload };
        }
        if surprised {
            targets.speed = targets.speed.min(plan.approach.slowest_speed);
        }
        // Without its plan a step that is near is come to as the last one was crossed.
        let needs = plan.brake_horizon + plan.approach.window_from.abs();
        let near = self.estimator.distance(&state.estimate).is_some_and(|ahead| ahead <= needs);
        if unplanned && near {
            targets.speed = targets.speed.min(plan.cross_speed);
        }
        state.approach.sped_up &= !state.estimate.critical();
        if let Some(speed) = state.estimate.lifting()
            && !state.approach.sped_up
        {
            targets.speed = targets.speed.min(speed.max(self.least_speed));
            targets.preload = targets.preload.max(hold.preload);
        }
        // A wheel that slips grips by more preload alone; deploying, it waits for that.
        let (slipping, slipped) = state.estimate.slips();
        if slipped {
            targets.preload = plan.most_preload;
            targets.speed = targets.speed.min(plan.cross_speed);
        }
        self.learn_slip(state, tick);
        let missing = plan.most_preload - tick.sensed.preload_filtered;
        let waits = missing > self.schedule.reached_within && direction == Direction::Deploy;
        if slipping || slipped && waits {
            targets.speed = targets.speed.min(self.least_speed);
        }
        self.note_preload(state, tick, plan.cross_preload, targets.waiting);
        let leg = state.leg(targets.approaching);
        if state.mode != Mode::Run(direction, leg) {
            tick.trigger(Trigger::Leg(leg));
        }
        targets
    }

    /// A slip under this preload shows a friction below what that needs: another plan is asked for.
    /// Retracting no choice needs much less, and an edge shows a slip less well.
    fn learn_slip(&self, state: &mut State, tick: &mut Pass<'_>) {
        let lost = state.estimate.crossing.as_ref().map_or(Q16::ZERO, |open| open.slip.lost);
        let grows = lost > state.planning.lost;
        state.planning.lost = lost;
        if grows && state.estimate.direction == Direction::Deploy {
            let unknown = state.planning.slipped.is_none();
            state.planning.slipped = state.planning.slipped.max(Some(tick.pressed()));
            // A plan on its way that knows of it comes first.
            if unknown || state.planning.asked == 0 {
                self.ask(state, tick);
            }
        }
    }

    /// On a corner the wheel's rise compresses the spring: limits the speed to what the
    /// pre-tightener can follow.
    pub(super) fn climb(&self, state: &State, speed: MillimetresPerSecond) -> MillimetresPerSecond {
        if !state.estimate.on_corner() {
            return speed;
        }
        self.follow(speed, self.estimator.corner().slope(self.ahead(state, Q16::ZERO)))
    }

    /// `speed`, or the largest below it at which the pre-tightener still follows a spring
    /// that moves on this slope, mm/s: `v s <= v_rise`.
    pub(super) fn follow(&self, speed: MillimetresPerSecond, slope: Ratio) -> MillimetresPerSecond {
        if slope > LEVEL_SLOPE && speed * slope > self.climb_speed {
            speed.min(divide(self.climb_speed, slope))
        } else {
            speed
        }
    }

    /// Loops: commands of drive and pre-tightener.
    pub(super) fn actuate(
        &self,
        state: &mut State,
        tick: &mut Pass<'_>,
        targets: &Targets,
    ) -> (MotorCommand, MotorCommand) {
        match state.mode {
            Mode::Run(..) | Mode::Stopping(_) => {}
            Mode::Service => {
                state.halt();
                return self.serve(state, tick);
            }
            Mode::Preload(_) => {
                state.profile.halt();
                state.speed_loop = SpeedLoopState::default();
                return (MotorCommand::OFF, self.regulate(state, tick, targets, Q16::ZERO));
            }
            _ => {
                state.halt();
                return (MotorCommand::OFF, MotorCommand::OFF);
            }
        }
        self.profile.step(&mut state.profile, targets.speed);
        // Only detected corners are fed forward: the table may be wrong. The feed-forward is
        // blended in, or the drive would jump.
        let (blend, added) = state.blend_corner();
        let wanted = state.outwards(state.profile.speed()) + state.make_up(targets.speed);
        let (climb, drift) = match blend {
            Q16::ZERO => (Q16::ZERO, Q16::ZERO),
            _ => self.corner(state, tick, targets.speed),
        };
        let measured = tick.sensed.speed.value;
        let held = self.load_of(state);
        let level = resisting(wanted, held);
        let climb = |part: Ratio| resisting(wanted, held + climb * part) - level;
        let error = wanted - measured;
        self.speed_loop.hand_over(&mut state.speed_loop, climb(Q16::ONE), added, error);
        let (climb, drift) = (climb(blend), drift * blend);
        let load = level + climb + self.inertia * state.outwards(state.profile.acceleration());
        let duty = self.speed_loop.step(&mut state.speed_loop, wanted, measured, load);
        (MotorCommand::on(duty), self.regulate(state, tick, targets, drift))
    }

    /// Force that a corner needs of the drive, N, and the rate at which it moves the spring, N/s.
    fn corner(
        &self,
        state: &State,
        tick: &Pass<'_>,
        target: MillimetresPerSecond,
    ) -> (Newtons, NewtonsPerSecond) {
        let (corner, direction) = (self.estimator.corner(), state.estimate.direction);
        let slope = corner.drive_slope(direction, self.ahead(state, Q16::ZERO));
        // Slope and speed of the wheel when this tick's duty moves the screw.
        let speed = state.profile.speed();
        let change = state.profile.acceleration() * self.preload_latency;
        let later = between(speed + change, speed.min(target), speed.max(target));
        let sign = Q16::from_num(direction.sign());
        let travel = sign * (speed + later).half() * self.preload_latency;
        let steep = corner.slope(self.ahead(state, travel));
        (tick.pressed() * slope, sign * self.spring * steep * later)
    }

    fn regulate(
        &self,
        state: &mut State,
        tick: &Pass<'_>,
        targets: &Targets,
        drift: NewtonsPerSecond,
    ) -> MotorCommand {
        let (preload_loop, measured) = (&mut state.preload_loop, tick.sensed.preload.value);
        MotorCommand::on(self.preload_loop.step(preload_loop, targets.preload, measured, drift))
    }

    /// Distance outwards from where the centre will be after `travel` to the face that it is
    /// on or that is next, mm; large if there is none.
    fn ahead(&self, state: &State, travel: Millimetres) -> Millimetres {
        let at = state.estimate.position + travel;
        let table = self.estimator.steps().next_face(at);
        let back = state.estimate.direction == Direction::Retract;
        let open = state.estimate.crossing.filter(|open| back || open.step == 0);
        let lifted = open.and_then(|open| open.lift);
        lifted.map(|point| point.face - at).or(table).unwrap_or(Q16::MAX)
    }
}

/// Part of an axial load, N, positive against motion outwards, that the drive feels at this
/// speed: its worm holds a load along the motion.
fn resisting(speed: MillimetresPerSecond, load: Newtons) -> Newtons {
    if speed < Q16::ZERO { load.min(Q16::ZERO) } else { load.max(Q16::ZERO) }
}
