//! One tick of the controller.

#![deny(clippy::float_arithmetic)]

#[allow(clippy::float_arithmetic, reason = "SI to machine units, once at start")]
mod build;
mod crossing;
mod modes;
mod plans;
mod resume;
mod runs;
mod state;

use super::preload_loop::PreloadLoop;
use super::profile::Profile;
use super::rise::Rise;
use super::schedule::{Course, Schedule, Targets};
use super::speed_loop::SpeedLoop;
use crate::estimate::ContactStage;
use crate::estimate::crossing::{Contact, CrossingWatch};
use crate::estimate::tread::TreadLaw;
use crate::estimate::vibration::VibrationObserver;
use crate::hal::{Duty, MotorCommand};
use crate::log::{Entry, Event, Telemetry};
use crate::model::{Plan, PlanRequest};
use crate::numeric::part;
use crate::rig::MAX_STEPS;
use crate::sense::raw::SensorFrame;
use crate::sense::{SensedState, Senses};
use crate::supervise::{Command, Direction, Leg, Mode, Monitor, Observed, Trigger};
use crate::units::{
    Millimetres, MillimetresPerSecond, Newtons, NewtonsPerSecond, Q16, Ratio, Seconds, Tick, q16,
};

pub use state::State;

/// Most log entries one tick can give.
pub const EVENTS_PER_TICK: usize = 8;

/// Slope below which a corner does not limit the speed.
const LEVEL_SLOPE: Ratio = q16(50_000);

/// Ticks that a fault hold lasts at least.
const HOLD_TICKS: u32 = 100;

/// Log entries of one tick.
pub(crate) type Events = heapless::Vec<Entry, EVENTS_PER_TICK>;

/// What a tick is given.
#[derive(Clone, Copy, Debug, Default)]
pub struct Input {
    /// Time.
    pub now: Tick,
    /// Latest code of each sensor.
    pub sensors: SensorFrame,
    /// Operator command since the last tick.
    pub command: Option<Command>,
    /// Answer to an earlier [`Output::request`].
    pub plan: Option<Plan>,
    /// This tick starts more than a period late.
    pub overrun: bool,
    /// The emergency stop has cut the bridges.
    pub emergency_stop: bool,
}

/// What a tick gives.
#[derive(Clone, Debug, Default)]
pub struct Output {
    /// Drive bridge.
    pub drive: MotorCommand,
    /// Pre-tightener bridge.
    pub preload: MotorCommand,
    /// Work for the model task: the schedule of the segment ahead.
    pub request: Option<PlanRequest>,
    /// Give the bridges their power back after an emergency stop.
    pub rearm: bool,
    /// What happened.
    pub events: Events,
    /// State after the tick.
    pub telemetry: Telemetry,
}

/// The controller's configuration in machine units; its state is apart. The default is room
/// to read one into, and controls nothing.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Controller {
    senses: Senses,
    monitor: Monitor,
    watch: CrossingWatch,
    tread: TreadLaw,
    vibration: VibrationObserver,
    /// Stages that the phase does not need are left out.
    skipping: bool,
    rise: Rise,
    schedule: Schedule,
    profile: Profile,
    speed_loop: SpeedLoop,
    preload_loop: PreloadLoop,
    /// Step positions, mm, from the stow end.
    steps: heapless::Vec<Millimetres, MAX_STEPS>,
    travel: Millimetres,
    /// Ticks within which any preload can be reached.
    patience: u32,
    /// Speed times slope of the corner at which the spring uses the actuator up, mm/s.
    rise_speed: MillimetresPerSecond,
    /// Way of the wheel over a corner, mm.
    corner_reach: Millimetres,
    /// Wheel travel on a corner beyond which the wheel slips, mm.
    corner_way: Millimetres,
    /// Spring rate of the pre-tightener, N/mm.
    spring: Q16,
    /// Dead time and lag of the pre-tightener, s.
    foresight: Seconds,
    /// Axial load on this wheel, N.
    load: Newtons,
    /// Radial force per tangent of the arm angle: coupling times axial load, N.
    full_wedge: Newtons,
    /// Rotor, gears and carriage seen at the tread, N s^2/mm.
    inertia: Q16,
    friction: Ratio,
}

/// What one tick carries from stage to stage.
struct Pass<'a> {
    now: Tick,
    sensed: &'a SensedState,
    position: Millimetres,
    /// Radial force that the arm's inclination adds to the preload, N.
    wedge: Newtons,
    output: &'a mut Output,
}

impl Pass<'_> {
    /// Compression of the tread, smoothed, mm.
    fn compressed(&self) -> Millimetres {
        self.sensed.compression_filtered
    }

    fn log(&mut self, event: Event) {
        // A tick that has more to say than fits says the first eight.
        let _ = self.output.events.push(Entry { at: self.now, event });
    }
}

impl Controller {
    /// Way of the wheel over a corner, mm.
    #[must_use]
    pub const fn corner_reach(&self) -> Millimetres {
        self.corner_reach
    }

    /// One tick: sensors, faults, command, mode, phase, schedule, loops.
    pub fn step(&self, state: &mut State, input: &Input) -> Output {
        let mut output = Output::default();
        self.step_into(state, input, &mut output);
        output
    }

    /// The same with the output where it is wanted: it is too large to be moved in every
    /// tick. What it held before is forgotten.
    pub fn step_into(&self, state: &mut State, input: &Input, output: &mut Output) {
        output.request = None;
        output.rearm = false;
        output.events.clear();
        let acceleration = state.acceleration();
        let sensed = self.senses.step(&mut state.senses, input.now, &input.sensors, acceleration);
        let mut pass = Pass {
            now: input.now,
            sensed: &sensed,
            position: state.odometry.position(sensed.travel),
            wedge: self.full_wedge * sensed.tan_arm,
            output,
        };
        self.take_plan(state, &mut pass, input.plan.as_ref());
        self.look_for_faults(state, &mut pass, input);
        self.take_command(state, &mut pass, input.command);
        self.advance_mode(state, &mut pass);
        self.follow_contact(state, &mut pass);
        let targets = self.targets(state, &mut pass);
        let (drive, preload) = self.actuate(state, &pass, &targets);
        self.note_stage(state, &mut pass);
        self.follow_vibration(state, &pass);
        pass.output.drive = drive;
        pass.output.preload = preload;
        pass.output.telemetry = self.telemetry(state, &pass, &targets);
        let given = &pass.output.telemetry;
        state.monitor.give(given.drive, given.pretightener);
    }

    fn look_for_faults(&self, state: &mut State, pass: &mut Pass<'_>, input: &Input) {
        let steady = state.profile.acceleration() == Q16::ZERO && !state.on_corner();
        let observed = Observed {
            now: pass.now,
            mode: state.mode,
            sensed: pass.sensed,
            bridges: input.sensors.bridges,
            speed_ref: state.signed_speed(),
            preload_due: state.preload_loop.due(),
            effort: steady.then(|| state.speed_loop.value()),
            overrun: input.overrun,
            emergency_stop: input.emergency_stop,
        };
        if let Some(fault) = self.monitor.step(&mut state.monitor, &observed) {
            self.trigger(state, pass, Trigger::Fault(fault));
        }
    }

    fn take_command(&self, state: &mut State, pass: &mut Pass<'_>, command: Option<Command>) {
        let Some(command) = command else { return };
        // A reset that was already on its way must not clear a fault unseen.
        let hasty = matches!(state.mode, Mode::FaultHold(_)) && state.in_mode < HOLD_TICKS;
        if !hasty && self.trigger(state, pass, Trigger::Command(command)) {
            pass.log(Event::Command(command));
        } else {
            pass.log(Event::Refused(command));
        }
    }

    /// Axial way to the face of the step ahead, mm; none if no step is left.
    fn distance(
        &self,
        state: &State,
        pass: &Pass<'_>,
        direction: Direction,
    ) -> Option<Millimetres> {
        self.step_position(state.next_step).map(|face| match direction {
            Direction::Deploy => face - pass.position,
            Direction::Retract => pass.position - face,
        })
    }

    /// Where the wheel is on its way.
    fn course(&self, state: &State, pass: &Pass<'_>, direction: Direction) -> Course {
        Course {
            direction,
            distance: self.distance(state, pass, direction),
            remaining: self.schedule.remaining(direction, pass.position),
            critical: state.critical(),
            ramping: state.ramping,
            braking: state.braking,
            speed: state.profile.speed(),
            acceleration: state.profile.acceleration(),
            reference: state.preload_loop.reference(),
            preload: pass.sensed.preload_filtered,
        }
    }

    /// Schedule of this tick; holds what stands where nothing runs.
    fn targets(&self, state: &mut State, pass: &mut Pass<'_>) -> Targets {
        let hold = Targets {
            speed: Q16::ZERO,
            preload: state.preload_loop.reference(),
            ramping: state.ramping,
            braking: state.braking,
            approaching: false,
            waiting: false,
        };
        let (direction, running) = match state.mode {
            Mode::Preload(direction) => (direction, false),
            Mode::Run(direction, _) => (direction, true),
            _ => return hold,
        };
        let Some(plan) = state.plan.as_ref() else { return hold };
        let course = self.course(state, pass, direction);
        let mut targets = self.schedule.targets(&self.rise, plan, &course);
        let (step, cross_speed, cross_preload) = (plan.step, plan.cross_speed, plan.cross_preload);
        state.ramping = targets.ramping;
        state.braking = targets.braking;
        if !running {
            targets.speed = Q16::ZERO;
            return targets;
        }
        self.watch_expectation(state, pass, &course);
        self.limit_climb(state, pass, &mut targets);
        if state.slow_down() || step != state.next_step {
            targets.speed = targets.speed.min(cross_speed);
            targets.preload = cross_preload;
        }
        self.note_preload(state, pass, cross_preload, &targets);
        let leg = state.leg(targets.approaching);
        if state.mode != Mode::Run(direction, leg) {
            self.trigger(state, pass, Trigger::Leg(leg));
        }
        targets
    }

    /// On a corner the wheel's rise moves the spring: no faster than the pre-tightener
    /// can follow.
    fn limit_climb(&self, state: &State, pass: &Pass<'_>, targets: &mut Targets) {
        if !state.on_corner() {
            return;
        }
        let slope = self.rise.slope(self.ahead(state, pass, Q16::ZERO));
        targets.speed = self.followed(targets.speed, slope);
    }

    /// `speed`, or the largest below it at which the pre-tightener still follows a spring
    /// that moves on this slope, mm/s: `v s <= v_rise`.
    fn followed(&self, speed: MillimetresPerSecond, slope: Ratio) -> MillimetresPerSecond {
        // Divided only where it limits: the quotient is dear.
        if slope > LEVEL_SLOPE && speed * slope > self.rise_speed {
            speed.min(crate::numeric::divide(self.rise_speed, slope))
        } else {
            speed
        }
    }

    /// Loops and bridges.
    fn actuate(
        &self,
        state: &mut State,
        pass: &Pass<'_>,
        targets: &Targets,
    ) -> (MotorCommand, MotorCommand) {
        let direction = match state.mode {
            Mode::Run(direction, _) | Mode::Stopping(direction) => direction,
            Mode::Preload(_) => {
                state.profile.halt();
                state.speed_loop.reset();
                let preload = self.regulate(state, pass, targets, Q16::ZERO);
                return (MotorCommand::OFF, preload);
            }
            _ => {
                state.halt();
                return (MotorCommand::OFF, MotorCommand::OFF);
            }
        };
        self.profile.step(&mut state.profile, targets.speed);
        state.direction = direction;
        // Corners that are not felt are not fed forward: the table may be wrong. One that
        // is felt is blended in, or the drive would jump.
        let felt = state.feel_corner();
        let wanted = state.signed_speed();
        let (climb, drift) = if felt == Q16::ZERO {
            (Q16::ZERO, Q16::ZERO)
        } else {
            self.corner(state, pass, direction, felt)
        };
        let load = self.load + climb + self.inertia * state.acceleration();
        let measured = pass.sensed.speed.value;
        let duty = self.speed_loop.step(&mut state.speed_loop, wanted, measured, load);
        let preload = self.regulate(state, pass, targets, drift);
        (MotorCommand { duty, enable: true }, preload)
    }

    /// What a felt corner asks of the drive, N, and the rate at which it will move the
    /// spring, N/s.
    fn corner(
        &self,
        state: &State,
        pass: &Pass<'_>,
        direction: Direction,
        felt: Ratio,
    ) -> (Newtons, NewtonsPerSecond) {
        let lean = felt * self.rise.lean(direction, self.ahead(state, pass, Q16::ZERO));
        // The slope under the wheel when this tick's duty moves the screw.
        let way = state.signed_speed() * self.foresight;
        let later = felt * self.rise.slope(self.ahead(state, pass, way));
        let pressed = pass.sensed.preload_filtered + pass.wedge;
        (pressed * lean, self.spring * later * state.signed_speed())
    }

    fn regulate(
        &self,
        state: &mut State,
        pass: &Pass<'_>,
        targets: &Targets,
        drift: NewtonsPerSecond,
    ) -> MotorCommand {
        let measured = pass.sensed.preload.value;
        let duty =
            self.preload_loop.step(&mut state.preload_loop, targets.preload, measured, drift);
        MotorCommand { duty, enable: true }
    }

    /// Distance outwards from where the centre will be after `way` to the face that
    /// it is on or that is next, mm; large if there is none.
    fn ahead(&self, state: &State, pass: &Pass<'_>, way: Millimetres) -> Millimetres {
        let at = pass.position + way;
        let near = |face: &&Millimetres| **face + self.rise.patch() > at;
        let table = self.steps.iter().find(near).map(|face| *face - at);
        state.extra_face(at).or(table).unwrap_or(Q16::MAX)
    }

    fn step_position(&self, step: u8) -> Option<Millimetres> {
        self.steps.get(usize::from(step).checked_sub(1)?).copied()
    }

    /// Listens to the arm's mode from the approach to a step until it is behind. The
    /// observer starts afresh each time, so that what it did before does not matter.
    fn follow_vibration(&self, state: &mut State, pass: &Pass<'_>) {
        let awake = matches!(state.mode, Mode::Run(_, Leg::Approach | Leg::Crossing));
        let shaking = &mut state.vibration;
        let compression = pass.sensed.compression.value;
        if awake && !shaking.awake {
            self.vibration.reset(&mut shaking.observer, compression);
            shaking.peak = Q16::ZERO;
        }
        shaking.awake = awake;
        if awake || !self.skipping {
            let amplitude = self.vibration.step(&mut shaking.observer, compression);
            if awake {
                shaking.peak = shaking.peak.max(amplitude);
            }
        }
    }

    fn note_stage(&self, state: &mut State, pass: &mut Pass<'_>) {
        let stage = match (state.mode, state.contact()) {
            (Mode::Run(..) | Mode::Stopping(_), Contact::Both) => ContactStage::StaticFriction,
            (Mode::Run(..) | Mode::Stopping(_), Contact::Corner) => ContactStage::Sliding,
            (Mode::Run(..) | Mode::Stopping(_), Contact::Leaving) => ContactStage::Rolling,
            (Mode::Run(..) | Mode::Stopping(_), Contact::Wall) => ContactStage::Continuous,
            (Mode::Preload(_), _) => ContactStage::Preloaded,
            _ if pass.sensed.preload_filtered > q16(1_000_000) => state.stage,
            _ => ContactStage::Initial,
        };
        if stage != state.stage {
            state.stage = stage;
            pass.log(Event::Stage(stage));
        }
    }

    fn telemetry(&self, state: &State, pass: &Pass<'_>, targets: &Targets) -> Telemetry {
        let duty = |command: MotorCommand| if command.enable { command.duty } else { Duty::ZERO };
        let crossing = matches!(state.mode, Mode::Run(_, Leg::Crossing | Leg::Approach));
        let planned = state.plan.as_ref().map_or(self.friction, |plan| plan.slip_margin);
        let pressed = pass.sensed.preload_filtered + pass.wedge;
        let rolling = self.friction - part(self.load, pressed);
        Telemetry {
            at: pass.now,
            mode: state.mode,
            stage: state.stage,
            position: pass.position,
            speed: pass.sensed.speed.value,
            speed_ref: state.signed_speed(),
            preload: pass.sensed.preload.value,
            preload_ref: targets.preload,
            compression: pass.sensed.compression.value,
            radius: pass.sensed.radius.value,
            level: state.level,
            gap_predicted: state.plan.as_ref().map_or(Q16::ZERO, |plan| plan.gap),
            slip_margin: if crossing { planned.min(rolling) } else { rolling },
            vibration: state.vibration.peak,
            distance: self.distance(state, pass, state.direction).unwrap_or(Q16::MAX),
            drive: duty(pass.output.drive),
            pretightener: duty(pass.output.preload),
        }
    }
}

#[cfg(test)]
#[path = "step_tests.rs"]
#[allow(clippy::float_arithmetic, reason = "the rig is written in SI")]
mod tests;
