//! A run in software: the shipping control tick in closed loop with the plant, a
//! millisecond at a time, as fast as the host goes.

mod trace;

use std::time::Instant;

use interstage::control::{Controller, Input, State};
use interstage::hal::MotorCommand;
use interstage::log::{CrossingRecord, Event};
use interstage::model::{Plan, Planner, Strategy};
use interstage::rig::RigError;
use interstage::sense::raw::{Sample, SensorFrame};
use interstage::supervise::{Command, Direction, Mode};

use crate::plant::draw::PlantParameters;
use crate::plant::rig::{Drives, PlantError, VirtualRig};
use crate::plant::sensors::{Sensed, Sensors};
use crate::record::{LogLine, Recording, Report, Row};
use crate::scenario::{ControllerKind, Scenario};

pub use trace::text;

/// Control period, s.
const TICK_S: f64 = 1e-3;
/// The angle sensor is read every second tick.
const ANGLE_EVERY: u32 = 2;
/// Longest run, s: the whole travel at the least useful speed, three times over.
const LONGEST_S: f64 = 120.0;

/// What is asked of a run beside its scenario.
#[derive(Clone, Copy, Debug, Default)]
pub struct Options {
    /// Keep one row a tick.
    pub rows: bool,
    /// Crossing speed prescribed to the planner, mm/s, and whether it holds
    /// throughout.
    pub speed: Option<(f64, bool)>,
}

/// A run that could not be made.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The parameters do not make a controller.
    #[error("{0}")]
    Rig(#[from] RigError),
    /// The plant left the set of meaningful states.
    #[error("{0}")]
    Plant(#[from] PlantError),
}

impl From<ControllerKind> for Strategy {
    fn from(kind: ControllerKind) -> Self {
        match kind {
            ControllerKind::Scheduled => Self::Scheduled,
            ControllerKind::Constant => Self::Constant,
            ControllerKind::Limit => Self::Limit,
            ControllerKind::Reactive => Self::Reactive,
        }
    }
}

/// Runs a scenario to its end: arrival, fault hold, or time.
///
/// # Errors
/// [`RunError`] if the parameters are out of range or the plant fails. A run that
/// ends in a fault is a result, not an error.
pub fn run(scenario: &Scenario, options: Options) -> Result<Recording, RunError> {
    let mut run = Run::new(scenario, options)?;
    let started = Instant::now();
    while run.step()? {}
    let wall_s = started.elapsed().as_secs_f64();
    Ok(run.finish(scenario, wall_s))
}

/// A run under way.
struct Run {
    controller: Controller,
    planner: Planner,
    state: State,
    plant: VirtualRig,
    sensors: Sensors,
    frame: SensorFrame,
    tick: u32,
    plan: Option<Plan>,
    start: Command,
    started: bool,
    options: Options,
    trace: trace::Trace,
}

impl Run {
    fn new(scenario: &Scenario, options: Options) -> Result<Self, RunError> {
        let strategy = scenario.run.controller.into();
        let mut planner = Planner::try_build_as(&scenario.rig, strategy)?;
        if let Some((speed, uniform)) = options.speed {
            planner = planner.with_speed(speed, uniform)?;
        }
        let direction: Direction = scenario.run.direction.into();
        let parameters = PlantParameters::draw(scenario);
        // The way back begins where the way out ended: at the end of travel, pressed.
        let (position, preload, start) = match direction {
            Direction::Deploy => (0.0, 0.0, Command::Start),
            Direction::Retract => {
                (scenario.rig.rig.travel_mm, scenario.rig.preload.cruise_n, Command::Retract)
            }
        };
        let sensors = Sensors::new(parameters.sensors.clone(), scenario.run.seed);
        Ok(Self {
            controller: Controller::try_build(&scenario.rig)?,
            trace: trace::Trace::new(planner.gap_ref(direction).to_num(), position),
            planner,
            state: State::default(),
            plant: VirtualRig::new(parameters, position, preload, TICK_S),
            sensors,
            frame: SensorFrame::default(),
            tick: 0,
            plan: None,
            start,
            started: false,
            options,
        })
    }

    /// One tick; whether there is another.
    fn step(&mut self) -> Result<bool, RunError> {
        self.read_sensors();
        let input = Input {
            now: self.tick,
            sensors: self.frame,
            command: self.command(),
            plan: self.plan.take(),
            overrun: false,
        };
        let output = self.controller.step(&mut self.state, &input);
        if let Some(request) = output.request {
            // The model task runs between the ticks.
            self.plan = Some(self.planner.plan(&request));
        }
        self.trace.look(&output, self.plant.truth(), self.options.rows);
        self.plant.step(&drives(output.drive, output.preload), TICK_S)?;
        self.tick += 1;
        let ended = matches!(self.state.mode(), Mode::Complete(_) | Mode::FaultHold(_));
        Ok(!ended && f64::from(self.tick) * TICK_S < LONGEST_S)
    }

    fn read_sensors(&mut self) {
        let truth = self.plant.truth();
        let sensed = Sensed {
            rotation_rad: truth.rotation_rad,
            preload_n: truth.preload_n,
            depth_mm: truth.depth_mm,
            arm_rad: truth.arm_rad,
        };
        let codes = self.sensors.read(sensed, TICK_S);
        let at = self.tick;
        self.frame.wheel = Some(Sample { code: codes.wheel, at });
        self.frame.load_cell = Some(Sample { code: codes.load_cell, at });
        self.frame.tread = Some(Sample { code: codes.tread, at });
        if self.tick.is_multiple_of(ANGLE_EVERY) {
            self.frame.arm = Some(Sample { code: codes.arm, at });
        }
    }

    /// The operator presses the button as soon as the drive is idle.
    fn command(&mut self) -> Option<Command> {
        if self.started || self.state.mode() != Mode::Idle {
            return None;
        }
        self.started = true;
        Some(self.start)
    }

    fn finish(self, scenario: &Scenario, wall_s: f64) -> Recording {
        let steps = self.plant.parameters().wall.steps().len();
        let arrived = matches!(self.state.mode(), Mode::Complete(_));
        self.trace.finish(scenario, &self.plant, arrived, steps, wall_s)
    }
}

/// Bridge commands as the plant sees them.
fn drives(drive: MotorCommand, preload: MotorCommand) -> Drives {
    let duty = |command: MotorCommand| f64::from(command.duty.to_bits()) / 32_768.0;
    Drives {
        drive: duty(drive),
        drive_on: drive.enable,
        preload: duty(preload),
        preload_on: preload.enable,
    }
}

/// Kept for the ledger: what the controller reported of a crossing.
type Reported = CrossingRecord;

/// Log line, fault and limit reports of an event.
fn report(t_s: f64, event: &Event) -> (LogLine, Option<(bool, Report)>) {
    let line = LogLine { t_s, text: text(event) };
    let found = match event {
        Event::Fault(fault) => Some((true, fault.code(), fault.sentence())),
        Event::Limit(limit) => Some((false, limit.code(), limit.sentence())),
        _ => None,
    };
    let found =
        found.map(|(latched, code, text)| (latched, Report { t_s, code, text: text.to_owned() }));
    (line, found)
}

/// Row of a tick.
type Rows = Vec<Row>;
