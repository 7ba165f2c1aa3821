//! One tick of the controller: the pipeline from sensor codes to bridge commands.

#[allow(clippy::float_arithmetic, reason = "SI to machine units, once at start")]
mod build;
mod drive;
mod event;
mod modes;
mod plans;
mod report;
mod state;
mod telemetry;

use crate::control::preload_loop::PreloadLoop;
use crate::control::schedule::Schedule;
use crate::control::speed_loop::SpeedLoop;
use crate::estimate::vibration::VibrationObserver;
use crate::estimate::{Estimator, Follow};
use crate::fault::Fault;
use crate::model::profile::Profile;
use crate::model::{Plan, PlanRequest};
use crate::sense::raw::SensorFrame;
use crate::sense::{SensedState, Senses};
use crate::supervise::{Command, Mode, Monitor, Observed, ServiceDuties, Trigger, next};
use crate::units::{
    Direction, Millimetres, MillimetresPerSecond, MotorCommand, Newtons, Q16, Ratio, Seconds, Tick,
};

pub use event::{CrossingRecord, Entry, Event};
pub use state::State;
pub use telemetry::Telemetry;

/// Most log entries of a tick.
pub const EVENTS_PER_TICK: usize = 8;

/// Ticks that a fault hold lasts at least.
const HOLD_TICKS: u32 = 100;

/// Input of a tick.
#[derive(Clone, Copy, Debug, Default)]
pub struct Input {
    /// Time.
    pub now: Tick,
    /// Latest code of each sensor.
    pub sensors: SensorFrame,
    /// Operator command since the last tick.
    pub command: Option<Command>,
    /// Duties that the host asks for in the service mode, since the last tick.
    pub service: Option<ServiceDuties>,
    /// Answer to an earlier [`Output::request`].
    pub plan: Option<Plan>,
    /// This tick starts more than a period late.
    pub overrun: bool,
    /// The emergency stop has cut the bridges.
    pub emergency_stop: bool,
}

/// Output of a tick.
#[derive(Clone, Debug, Default)]
pub struct Output {
    /// Drive bridge.
    pub drive: MotorCommand,
    /// Pre-tightener bridge.
    pub preload: MotorCommand,
    /// Work for the model task: the schedule of the segment ahead.
    pub request: Option<PlanRequest>,
    /// Re-enable the bridges after an emergency stop.
    pub rearm: bool,
    /// What happened.
    pub events: heapless::Vec<Entry, EVENTS_PER_TICK>,
    /// State after the tick.
    pub telemetry: Telemetry,
}

/// The controller's configuration in machine units; its state is apart. The default is a place to
/// read one into.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Controller {
    senses: Senses,
    monitor: Monitor,
    estimator: Estimator,
    vibration: VibrationObserver,
    /// Stages that the phase does not need are skipped.
    skipping: bool,
    schedule: Schedule,
    profile: Profile,
    speed_loop: SpeedLoop,
    preload_loop: PreloadLoop,
    /// Ticks within which any preload can be reached.
    preload_timeout: u32,
    /// Speed times slope of the corner at which the spring takes the actuator's full slew, mm/s.
    climb_speed: MillimetresPerSecond,
    /// Spring rate of the pre-tightener, N/mm.
    spring: Q16,
    /// Dead time and lag of the pre-tightener, s.
    preload_latency: Seconds,
    /// Axial load on this wheel, N.
    load: Newtons,
    /// Radial force that the arm's inclination adds, per load and tangent of its angle.
    arm_coupling: Ratio,
    /// Inertia of rotor, gears and carriage at the tread, N s^2/mm.
    inertia: Q16,
    friction: Ratio,
    /// Least useful speed of a crossing, mm/s.
    least_speed: MillimetresPerSecond,
    /// Preload with which the wheel may roll along the wall, N.
    rolling_preload: Newtons,
}

/// A pass of a tick through its stages: the data that they share.
struct Pass<'a> {
    now: Tick,
    sensed: &'a SensedState,
    /// Radial force that the arm's inclination adds to the preload, N.
    arm_thrust: Newtons,
    /// The transition that the present stage asks for; the first one counts.
    trigger: Option<Trigger>,
    output: &'a mut Output,
}

impl Pass<'_> {
    fn log(&mut self, event: Event) {
        // A tick with more events than fit reports the first eight.
        let _ = self.output.events.push(Entry { at: self.now, event });
    }

    fn trigger(&mut self, trigger: Trigger) {
        self.trigger.get_or_insert(trigger);
    }

    fn fail(&mut self, fault: Fault) {
        self.trigger(Trigger::Fault(fault));
    }

    /// Radial force on the wheel, N.
    fn pressed(&self) -> Newtons {
        self.sensed.preload_filtered + self.arm_thrust
    }
}

impl Controller {
    /// Axial load on this wheel as learned, N.
    fn load_of(&self, state: &State) -> Newtons {
        self.load + state.planning.learned.extra_load
    }

    /// Travel of the wheel over a corner, mm.
    pub const fn corner_reach(&self) -> Millimetres {
        self.estimator.steps().corner_reach()
    }

    /// One tick.
    pub fn step(&self, state: &mut State, input: &Input) -> Output {
        let mut output = Output::default();
        self.step_into(state, input, &mut output);
        output
    }

    /// One tick into a reused `output`, which is too large to be moved in every tick. The
    /// transitions that a stage asks for are applied at its end, so that a fault switches the
    /// bridges off in the same tick.
    pub fn step_into(&self, state: &mut State, input: &Input, output: &mut Output) {
        output.request = None;
        output.rearm = false;
        output.events.clear();
        let outwards = state.outwards(state.profile.acceleration());
        let mut sensed = self.senses.step(&mut state.senses, input.now, &input.sensors, outwards);
        state.estimate.rim(&mut sensed, matches!(state.mode, Mode::Run(..)));
        self.estimator.begin_tick(&mut state.estimate, &sensed);
        let arm_thrust = self.arm_coupling * self.load_of(state) * sensed.tan_arm;
        let tick = &mut Pass { now: input.now, sensed: &sensed, arm_thrust, trigger: None, output };
        self.take_plan(state, tick, input.plan.as_ref());
        self.transit(state, tick);
        self.look_for_faults(state, tick, input);
        self.transit(state, tick);
        self.take_command(state, tick, input.command);
        if let Some(request) = input.service {
            self.take_duties(state, tick, request);
        }
        self.advance_mode(state, tick);
        self.transit(state, tick);
        self.follow_contact(state, tick);
        self.transit(state, tick);
        let targets = self.targets(state, tick);
        self.transit(state, tick);
        let (drive, preload) = self.actuate(state, tick, &targets);
        (tick.output.drive, tick.output.preload) = (drive, preload);
        state.monitor.readback.set_duties(drive.duty, preload.duty);
        self.note_stage(state, tick);
        self.follow_vibration(state, tick);
        tick.output.telemetry = self.telemetry(state, tick, &targets);
    }

    fn look_for_faults(&self, state: &mut State, tick: &mut Pass<'_>, input: &Input) {
        // A corner's force is fed forward on the way out alone, by a place that is known.
        let estimate = &state.estimate;
        let unknown = estimate.on_corner()
            && (estimate.direction == Direction::Retract || estimate.is_searching());
        let steady = state.profile.acceleration() == Q16::ZERO && !unknown;
        let observed = Observed {
            now: tick.now,
            mode: state.mode,
            sensed: tick.sensed,
            travel: state.estimate.driven(tick.sensed),
            wound: state.estimate.wound(),
            bridges: input.sensors.bridges,
            speed_ref: state.outwards(state.profile.speed()),
            preload_due: state.preload_loop.due(),
            effort: steady.then(|| state.speed_loop.effort()),
            overrun: input.overrun,
            emergency_stop: input.emergency_stop,
        };
        if let Some(fault) = self.monitor.step(&mut state.monitor, &observed) {
            tick.fail(fault);
        }
    }

    fn take_command(&self, state: &mut State, tick: &mut Pass<'_>, command: Option<Command>) {
        let Some(command) = command else { return };
        // A reset sent before the fault must not clear it unseen.
        let hasty = matches!(state.mode, Mode::FaultHold(_)) && state.in_mode < HOLD_TICKS;
        let trigger = Trigger::Command(command);
        if hasty || next(state.mode, trigger).is_none() {
            tick.log(Event::Refused(command));
        } else {
            tick.trigger(trigger);
            self.transit(state, tick);
            tick.log(Event::Command(command));
        }
    }

    /// Follows steps and corners while the drive moves, and an axle that sinks on its tread.
    fn follow_contact(&self, state: &mut State, tick: &mut Pass<'_>) {
        let plan = state.planning.plan.as_ref();
        let most = plan.map_or(Q16::MAX, |plan| plan.most_preload);
        let follow = Follow {
            now: tick.now,
            sensed: tick.sensed,
            pressed: tick.pressed(),
            load: self.load_of(state),
            duty: state.speed_loop.duty(),
            most_pressed: most - tick.sensed.preload_filtered <= self.schedule.reached_within,
            standing_since: state.approach.standing_since,
            limited_by: plan.map(|plan| plan.limited_by),
        };
        if state.mode.moves() {
            let found = self.estimator.follow(&mut state.estimate, &follow);
            self.take_findings(state, tick, found);
        } else if state.mode != Mode::Service {
            self.estimator.sink(&mut state.estimate, &follow);
        }
    }
}

#[cfg(test)]
#[path = "tick/tick_tests.rs"]
mod tests;
