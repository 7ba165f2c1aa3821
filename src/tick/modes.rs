//! Conditions and time-outs of the modes, and the service mode in the tick.

use super::state::BLEND_TICKS;
use super::{Controller, Event, Pass, State};
use crate::fault::{Fault, Limit};
use crate::sense::SensedState;
use crate::supervise::service::ServiceView;
use crate::supervise::startup::{SETTLED_TICKS, TEST_TICKS, UNLOADED, at_rest, silent, stowed};
use crate::supervise::{Mode, ServiceDuties, Trigger, next};
use crate::units::{Direction, Duty, MotorCommand, Q16};

/// Ticks for which a preload must be reached before the drive starts.
const STANDING_TICKS: u32 = 60;
/// Ticks after boot within which every sensor must answer.
const BOOT_TICKS: u32 = 2000;
/// Ticks within which the wheel must come to rest for the self-test.
const REST_TICKS: u32 = 2000;
/// Ticks within which the zero must be taken.
const ZERO_TICKS: u32 = 2000;
/// Ticks within which the wheel must be at rest after a stop.
const STOP_TICKS: u32 = 1500;

/// What the bounds of the service mode look at.
const fn view(sensed: &SensedState) -> ServiceView {
    ServiceView {
        travel: sensed.travel,
        preload: sensed.preload_filtered,
        compression: sensed.compression_filtered,
    }
}

impl Controller {
    /// Applies the transition that the stage asks for, and what follows from it.
    pub(super) fn transit(&self, state: &mut State, tick: &mut Pass<'_>) {
        while let Some(trigger) = tick.trigger.take() {
            let Some(mode) = next(state.mode, trigger) else { continue };
            if let Trigger::Fault(fault) = trigger {
                tick.log(Event::Fault(fault));
            }
            if mode != state.mode {
                let before = core::mem::replace(&mut state.mode, mode);
                let ticks = core::mem::take(&mut state.in_mode);
                state.rested = if before.is_at_rest() {
                    state.rested.map(|rested| rested.saturating_add(ticks))
                } else {
                    Some(0)
                };
                state.condition_ticks = 0;
                tick.log(Event::Mode(mode));
                self.enter(state, tick, before);
            }
        }
    }

    fn enter(&self, state: &mut State, tick: &mut Pass<'_>, before: Mode) {
        if before == Mode::Service || state.mode == Mode::Service {
            state.forget();
        }
        match state.mode {
            Mode::Service => state.service.enter(&view(tick.sensed)),
            Mode::SelfTest => tick.output.rearm = matches!(before, Mode::FaultHold(_)),
            Mode::Zero => state.senses.begin_zero(),
            Mode::Preload(direction) => self.begin_run(state, tick, direction),
            Mode::Idle if matches!(before, Mode::SelfTest | Mode::Zero) => {
                self.estimator.locate(&mut state.estimate, tick.sensed, before == Mode::Zero);
            }
            _ => {}
        }
    }

    fn begin_run(&self, state: &mut State, tick: &mut Pass<'_>, direction: Direction) {
        let load = self.load_of(state);
        let (found, on_corner) =
            self.estimator.begin_run(&mut state.estimate, tick.sensed, tick.now, direction, load);
        if on_corner {
            // The drive has been off: without the corner's full feed-forward the wheel would roll
            // off before the speed loop reacts.
            state.corner_blend_ticks = BLEND_TICKS;
        }
        self.take_findings(state, tick, found);
    }

    /// Checks the condition of the present mode.
    pub(super) fn advance_mode(&self, state: &mut State, tick: &mut Pass<'_>) {
        state.in_mode = state.in_mode.saturating_add(1);
        let rests = at_rest(state.estimate.turns(tick.sensed).1);
        match state.mode {
            Mode::Boot => match silent(tick.sensed) {
                None => tick.trigger(Trigger::SensorsAnswer),
                Some(fault) if state.in_mode >= BOOT_TICKS => tick.fail(fault),
                Some(_) => {}
            },
            Mode::SelfTest => self.await_rest(state, tick, rests),
            Mode::Zero => self.await_zero(state, tick),
            Mode::Preload(direction) => self.await_preload(state, tick, direction),
            Mode::Run(direction, _) => self.await_arrival(state, tick, direction),
            Mode::Stopping(_) if state.profile.speed() == Q16::ZERO && rests => {
                tick.trigger(Trigger::AtRest);
            }
            Mode::Stopping(_) if state.in_mode >= STOP_TICKS => tick.fail(Fault::DriveRunaway),
            _ => {}
        }
    }

    fn await_rest(&self, state: &mut State, tick: &mut Pass<'_>, rests: bool) {
        state.condition_ticks = if rests { state.condition_ticks + 1 } else { 0 };
        if state.condition_ticks >= TEST_TICKS {
            let pressed = self.estimator.means(tick.sensed.compression_filtered);
            let (limit, known) = (self.senses.preload_zero_limit(), state.estimate.has_zeros());
            let stowed = stowed(tick.sensed, pressed, limit, known);
            let off = stowed && tick.sensed.preload_filtered.abs() >= UNLOADED;
            if !off || state.condition_ticks >= SETTLED_TICKS {
                tick.trigger(Trigger::TestPassed { stowed });
            }
        } else if state.in_mode >= REST_TICKS {
            tick.fail(Fault::SelfTest);
        }
    }

    fn await_zero(&self, state: &mut State, tick: &mut Pass<'_>) {
        match state.senses.zeroed() {
            Some(true) => tick.trigger(Trigger::Zeroed),
            None if state.in_mode < ZERO_TICKS => {}
            _ => tick.fail(Fault::SelfTest),
        }
    }

    fn await_preload(&self, state: &mut State, tick: &mut Pass<'_>, direction: Direction) {
        let begin = state.in_mode <= 1;
        let begin = begin.then_some(state.rested);
        if self.estimator.rest(&mut state.estimate, tick.sensed, tick.arm_thrust, begin) {
            tick.log(Event::Limit(Limit::CompressionStrange));
        }
        let reached = state.planning.plan.as_ref().is_some_and(|plan| {
            let course = self.course(state, tick, direction);
            let targets = self.schedule.targets(self.estimator.steps(), plan, &course);
            let enough = targets.preload - self.schedule.reached_within;
            tick.sensed.preload_filtered >= enough.min(plan.rolling_preload)
        });
        state.condition_ticks = if reached { state.condition_ticks + 1 } else { 0 };
        if state.condition_ticks >= STANDING_TICKS {
            tick.trigger(Trigger::PreloadReached);
        } else if state.in_mode >= self.preload_timeout {
            tick.fail(Fault::PreloadNotReached);
        }
    }

    /// Takes a request of the host. Asking for rest enters the mode from idle; in any other mode
    /// it is logged and changes nothing.
    pub(super) fn take_duties(&self, state: &mut State, tick: &mut Pass<'_>, asked: ServiceDuties) {
        if state.service.ask(asked) {
            tick.log(Event::Service(asked));
        }
        if state.mode == Mode::Idle && asked.is_rest() {
            tick.trigger(Trigger::Service);
        }
    }

    /// Commands of drive and pre-tightener in the service mode.
    pub(super) fn serve(
        &self,
        state: &mut State,
        tick: &mut Pass<'_>,
    ) -> (MotorCommand, MotorCommand) {
        let (duties, limit) = state.service.step(&view(tick.sensed));
        if let Some(limit) = limit {
            tick.log(Event::Limit(limit));
        }
        // A bridge without a duty stays off, unless it brakes.
        let command = |duty, brakes| MotorCommand { duty, enable: brakes || duty != Duty::ZERO };
        (command(duties.drive, state.service.brakes()), command(duties.pretightener, false))
    }

    /// The end of travel, confirmed by the arm.
    fn await_arrival(&self, state: &mut State, tick: &mut Pass<'_>, direction: Direction) {
        let steps = self.estimator.steps();
        let remaining = steps.remaining(direction, state.estimate.position);
        if !steps.arrived(remaining) || state.profile.speed() != Q16::ZERO {
            return;
        }
        // A crossing still open gets its record first.
        let found = self.estimator.close_crossing(&mut state.estimate, tick.sensed);
        self.take_findings(state, tick, found);
        if state.planning.closed.is_some() {
            return;
        }
        match self.estimator.confirms_end(&state.estimate, tick.sensed) {
            Ok(()) => {
                if self.estimator.is_beyond(&state.estimate) {
                    tick.log(Event::Limit(Limit::EndOverrun));
                }
                tick.trigger(Trigger::Arrived);
            }
            Err(fault) => tick.fail(fault),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{answering, within};
    use super::*;
    use crate::sense::Validity;
    use crate::supervise::Command;
    use crate::units::q16;

    fn advance(controller: &Controller, state: &mut State, tick: &mut Pass<'_>) {
        controller.advance_mode(state, tick);
        controller.transit(state, tick);
    }

    #[test]
    fn boot_waits_two_seconds_for_every_sensor() {
        let mut state = State::default();
        let mut deaf = answering();
        deaf.radius.validity = Validity::Absent;
        within(&deaf, |controller, pass| {
            for tick in 1..2000 {
                advance(controller, &mut state, pass);
                assert_eq!(state.mode, Mode::Boot, "{tick}");
            }
            advance(controller, &mut state, pass);
        });
        assert_eq!(state.mode, Mode::FaultHold(Fault::ArmAngleStale));
        let mut state = State::default();
        within(&answering(), |controller, pass| advance(controller, &mut state, pass));
        assert_eq!(state.mode, Mode::SelfTest);
    }

    #[test]
    fn a_zero_that_is_not_taken_is_a_fault_after_two_seconds() {
        let mut state = State { mode: Mode::Zero, ..State::default() };
        state.senses.begin_zero();
        within(&answering(), |controller, pass| {
            for tick in 1..2000 {
                advance(controller, &mut state, pass);
                assert_eq!(state.mode, Mode::Zero, "{tick}");
            }
            advance(controller, &mut state, pass);
        });
        assert_eq!(state.mode, Mode::FaultHold(Fault::SelfTest));
    }

    #[test]
    fn a_wheel_that_does_not_stop_is_a_fault_after_a_second_and_a_half() {
        let stopping = |speed: Q16| {
            let mut state = State { mode: Mode::Stopping(Direction::Deploy), ..State::default() };
            let mut turning = answering();
            turning.speed.value = speed;
            let ticks = within(&turning, |controller, pass| {
                (1..5000).find(|_| {
                    advance(controller, &mut state, pass);
                    state.mode != Mode::Stopping(Direction::Deploy)
                })
            });
            (ticks, state.mode)
        };
        let runs = (Some(1500), Mode::FaultHold(Fault::DriveRunaway));
        assert_eq!(stopping(q16(20_000_000)), runs);
        assert_eq!(stopping(q16(-20_000_000)), runs);
        assert_eq!(stopping(Q16::ZERO), (Some(1), Mode::Idle));
    }

    #[test]
    fn a_preload_that_is_never_reached_is_a_fault_after_twice_its_longest_rise_and_a_second() {
        let mut rig = crate::rig::Rig::prototype();
        for limit_n in [50.0, 60.0] {
            rig.preload.limit_n = limit_n;
            let controller = Controller::try_build(&rig).expect("sound");
            let mut state = State { mode: Mode::Preload(Direction::Deploy), ..State::default() };
            let ticks = within(&answering(), |_, pass| {
                (1..20_000).find(|_| {
                    advance(&controller, &mut state, pass);
                    state.mode != Mode::Preload(Direction::Deploy)
                })
            });
            assert_eq!(state.mode, Mode::FaultHold(Fault::PreloadNotReached));
            let timeout_s = 2.0 * limit_n / rig.preload.slew_n_per_s + 1.0;
            assert_eq!(ticks, Some((1000.0 * timeout_s) as u32));
        }
    }

    #[test]
    fn bridges_are_armed_again_by_a_reset_from_a_fault_alone() {
        let idle = answering();
        let armed = |from: Mode, trigger: Trigger| {
            let mut state = State { mode: from, ..State::default() };
            within(&idle, |controller, pass| {
                assert!(next(state.mode, trigger).is_some());
                pass.trigger(trigger);
                controller.transit(&mut state, pass);
                (state.mode, pass.output.rearm)
            })
        };
        let reset = Trigger::Command(Command::Reset);
        let fault = Mode::FaultHold(Fault::TickOverrun);
        assert_eq!(armed(fault, reset), (Mode::SelfTest, true));
        assert_eq!(armed(Mode::Boot, Trigger::SensorsAnswer), (Mode::SelfTest, false));
        for from in [Mode::Idle, Mode::Complete(Direction::Retract)] {
            assert_eq!(armed(from, reset), (Mode::SelfTest, false), "{from:?}");
        }
    }

    #[test]
    fn the_wheel_rolls_once_its_preload_carries_twice_load_and_carriage() {
        for coupling in [1.0, 0.0, -1.0] {
            let mut rig = crate::rig::Rig::prototype();
            rig.plant.arm_coupling = coupling;
            let controller = Controller::try_build(&rig).expect("a sound rig");
            let mut load = rig.plant.top_load_n * rig.plant.top_load_share;
            load += 1e-3 * rig.plant.moved_mass_kg * rig.drive.acceleration_mm_s2;
            // A leading arm, at an angle of which the sine is 105 / 145, lifts the wheel.
            let lifted = 2.0 * load * f64::max(-coupling, 0.0) * 1.05;
            let pressed = controller.rolling_preload.to_num::<f64>() - lifted;
            let carried = pressed * (rig.plant.mu - rig.control.slip_margin);
            assert!((carried / load - 2.0).abs() < 0.01, "{coupling}: {carried} {load}");
        }
    }
}
