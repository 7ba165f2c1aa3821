//! A run under way: controller and plant, a tick at a time, with commands and sensor
//! failures given from outside.

use interstage::blackbox::{Flight, Late, Recorder, Reset, Restart};
use interstage::control::{Controller, Input, Output, State};
use interstage::hal::MotorCommand;
use interstage::model::{Plan, Planner};
use interstage::sense::raw::{Sample, SensorFrame};
use interstage::supervise::{Command, Direction, Mode};
use interstage::units::{Millimetres, Tick};

use super::stream::Stream;
use super::trace::Trace;
use super::{Options, RunError, TICK_S};
use crate::injector::{FaultInjector, RecordFound};
use crate::plant::draw::PlantParameters;
use crate::plant::rig::{Drives, VirtualRig};
use crate::plant::sensors::{Codes, Sensed, Sensors};
use crate::record::Recording;
use crate::scenario::Scenario;

/// The angle sensor is read every second tick.
const ANGLE_EVERY: Tick = 2;

/// A run under way.
///
/// [`Session::step`] is one millisecond. To change what the controller gets, call its
/// two halves: [`Session::sense`] and [`Session::advance`].
pub struct Session {
    scenario: Scenario,
    options: Options,
    controller: Controller,
    planner: Planner,
    state: State,
    plant: VirtualRig,
    sensors: Sensors,
    frame: SensorFrame,
    tick: Tick,
    plan: Option<Plan>,
    trace: Trace,
    stream: Option<Stream>,
    injector: Option<FaultInjector>,
    /// What the bridges and the record hold on to while ticks are lost.
    held: Output,
    /// Ticks were lost before this one, and with them this command.
    overrun: bool,
    missed: Option<Command>,
}

impl Session {
    /// A session before its first tick: for deployment with the wheel unloaded at the
    /// stow end, for retraction pressed at the end of travel.
    ///
    /// # Errors
    /// [`RunError::Rig`] if the parameters do not make a controller, [`RunError::Refused`] if
    /// they do not make a plant, [`RunError::Hardware`] if a fault takes a board.
    pub fn new(scenario: &Scenario, options: Options) -> Result<Self, RunError> {
        if let Some(fault) = scenario.run.faults.iter().find(|f| f.target.is_hardware()) {
            let (target, kind) = (fault.target.name(), fault.kind.name());
            return Err(RunError::Hardware(format!("{target} {kind}")));
        }
        let strategy = scenario.run.controller.into();
        let mut planner = Planner::try_build_as(&scenario.rig, strategy)?;
        if let Some((speed, uniform)) = options.speed {
            planner = planner.with_speed(speed, uniform)?;
        }
        let direction = scenario.run.direction.into();
        let parameters = PlantParameters::draw(scenario);
        parameters.check(scenario.rig.preload.limit_n)?;
        // The way back begins where the way out ended: at the end of travel, pressed.
        let (position, preload) = match direction {
            Direction::Deploy => (0.0, 0.0),
            Direction::Retract => (scenario.rig.rig.travel_mm, scenario.rig.preload.cruise_n),
        };
        let sensors = Sensors::new(parameters.sensors.clone(), scenario.run.seed);
        let plant = VirtualRig::new(parameters, position, preload, TICK_S);
        let controller = Controller::try_build(&scenario.rig)?;
        Ok(Self {
            injector: FaultInjector::of(scenario),
            held: Output::default(),
            overrun: false,
            missed: None,
            stream: options.rows.then(|| Stream::new(scenario, &controller)),
            controller,
            trace: Trace::new(planner.gap_ref(direction).to_num(), position),
            planner,
            state: State::default(),
            sensors,
            plant,
            frame: SensorFrame::default(),
            tick: 0,
            plan: None,
            scenario: scenario.clone(),
            options,
        })
    }

    /// The same session with every stage of the controller run in every tick, needed or
    /// not.
    #[must_use]
    pub fn without_skipping(mut self) -> Self {
        self.controller = self.controller.without_skipping();
        self
    }

    /// The same session with the binary log kept, whether rows are or not.
    #[must_use]
    pub fn logging(mut self) -> Self {
        self.stream.get_or_insert_with(|| Stream::new(&self.scenario, &self.controller));
        self
    }

    /// The same with every ring element visited, see [`VirtualRig::visiting_all`].
    #[must_use]
    pub fn visiting_all(mut self) -> Self {
        self.plant = self.plant.visiting_all();
        self
    }

    /// One millisecond with an operator's command or none.
    ///
    /// # Errors
    /// [`RunError::Plant`] if the plant leaves the set of meaningful states.
    pub fn step(&mut self, command: Option<Command>) -> Result<Output, RunError> {
        let frame = self.sense();
        self.advance(&frame, command)
    }

    /// Reads the sensors: the latest code of each at the present tick. Once a tick,
    /// before [`Session::advance`]. Here the scenario's faults come and go.
    pub fn sense(&mut self) -> SensorFrame {
        let codes = read(&mut self.sensors, &self.plant);
        let at = self.tick;
        self.frame.wheel = Some(Sample { code: codes.wheel, at });
        self.frame.load_cell = Some(Sample { code: codes.load_cell, at });
        self.frame.tread = Some(Sample { code: codes.tread, at });
        self.frame.bridges = Some(codes.bridges);
        if at.is_multiple_of(ANGLE_EVERY) {
            self.frame.arm = Some(Sample { code: codes.arm, at });
        }
        let mut frame = self.frame;
        if let Some(injector) = &mut self.injector {
            injector.begin(f64::from(at) * TICK_S, self.plant.truth());
            injector.plant(&mut self.plant);
            injector.sensors(&mut frame);
            if let Some(record) = injector.reset() {
                self.reset(record);
            }
        }
        frame
    }

    /// The control tick on what `sensors` holds, then the plant's millisecond under
    /// its output.
    ///
    /// # Errors
    /// [`RunError::Plant`] if the plant leaves the set of meaningful states.
    pub fn advance(
        &mut self,
        sensors: &SensorFrame,
        command: Option<Command>,
    ) -> Result<Output, RunError> {
        let command = self.missed.take().or(command);
        if self.injector.as_ref().is_some_and(FaultInjector::lost) {
            (self.overrun, self.missed) = (true, command);
        } else {
            self.control(sensors, command);
        }
        let output = self.held.clone();
        self.held.events.clear();
        self.held.request = None;
        self.trace.look(&output, self.plant.truth(), self.options.rows);
        let mut drives = drives(output.drive, output.preload);
        if let Some(injector) = &mut self.injector {
            drives = injector.drives(drives);
        }
        self.plant.step(&drives, TICK_S)?;
        self.tick += 1;
        Ok(output)
    }

    /// The control tick and the model task behind it.
    fn control(&mut self, sensors: &SensorFrame, command: Option<Command>) {
        let injector = self.injector.as_mut();
        let (command, hangs, read) = injector.map_or((command, false, true), |injector| {
            (injector.command(command), injector.model_hangs(), !injector.log_gone())
        });
        let input = Input {
            now: self.tick,
            sensors: *sensors,
            command,
            plan: self.plan.take(),
            overrun: std::mem::take(&mut self.overrun),
            ..Input::default()
        };
        self.controller.step_into(&mut self.state, &input, &mut self.held);
        let output = &self.held;
        if let Some(request) = output.request.filter(|_| !hangs) {
            // The model task runs between the ticks.
            self.plan = Some(self.planner.plan(&request));
        }
        if let Some(stream) = &mut self.stream {
            stream.keep(&input, output, read);
        }
    }

    /// When it first did something, see [`FaultInjector::acts_s`], s since boot.
    #[must_use]
    pub fn acts_s(&self) -> Option<f64> {
        self.injector.as_ref().and_then(FaultInjector::acts_s)
    }

    /// When it first did what the readback must tell, see [`FaultInjector::tells_s`], s since boot.
    #[must_use]
    pub fn tells_s(&self) -> Option<f64> {
        self.injector.as_ref().and_then(FaultInjector::tells_s)
    }

    /// When the first of the scenario's faults came, s since boot.
    #[must_use]
    pub fn struck_s(&self) -> Option<f64> {
        self.injector.as_ref().and_then(FaultInjector::struck_s)
    }

    /// Power lost and back: the controller forgets everything, the rig stays where it is.
    pub fn reboot(&mut self) {
        self.state = State::default();
        self.plan = None;
        if let Some(stream) = &mut self.stream {
            stream.restart(&self.scenario, &self.controller);
        }
    }

    /// The record of the last tick, as memory keeps it.
    #[must_use]
    pub fn record(&self) -> Flight {
        Recorder::default().flight(&self.held.telemetry, self.state.trust(), Late::NOBODY)
    }

    /// A reset that leaves memory and takes the power from the bridges at once: the
    /// controller starts with what its record of the last tick tells of the place.
    pub fn restart(&mut self) {
        let flight = Some(self.record());
        self.restart_from(Restart { reset: Reset::Pin, flight, crash: None });
    }

    /// The reset of a fault.
    fn reset(&mut self, record: RecordFound) {
        match record {
            RecordFound::Intact => self.restart(),
            RecordFound::Off(mm) => {
                let mut flight = self.record();
                flight.position += Millimetres::from_num(mm);
                let flight = Some(flight);
                self.restart_from(Restart { reset: Reset::Power, flight, crash: None });
            }
            RecordFound::Gone => self.reboot(),
        }
    }

    /// A start that finds this of the time before it.
    pub fn restart_from(&mut self, restart: Restart) {
        self.reboot();
        self.state = State::standing(restart.place());
        if let Some(stream) = &mut self.stream {
            stream.tell(restart);
        }
    }

    /// What the drive is doing.
    #[must_use]
    pub const fn mode(&self) -> Mode {
        self.state.mode()
    }

    /// Time since boot, s.
    #[must_use]
    pub fn time_s(&self) -> f64 {
        f64::from(self.tick) * TICK_S
    }

    /// The plant.
    #[must_use]
    pub const fn plant(&self) -> &VirtualRig {
        &self.plant
    }

    /// The binary log since the last call; empty if it is not kept.
    pub fn take_stream(&mut self) -> Vec<u8> {
        self.stream.as_mut().map(Stream::take).unwrap_or_default()
    }

    /// What is left behind if the session ends here; it took `wall_s` to compute.
    #[must_use]
    pub fn finish(self, wall_s: f64) -> Recording {
        let arrived = match self.state.mode() {
            Mode::Complete(way) => Some(way),
            _ => None,
        };
        let mut recording = self.trace.finish("sil", &self.scenario, &self.plant, arrived, wall_s);
        recording.stream = self.stream.map(Stream::finish).unwrap_or_default();
        recording
    }
}

/// What the sensors of this plant read now, a tick after the last call.
pub fn read(sensors: &mut Sensors, plant: &VirtualRig) -> Codes {
    let truth = plant.truth();
    let sensed = Sensed {
        rotation_rad: truth.rotation_rad,
        preload_n: truth.preload_n,
        depth_mm: truth.depth_mm,
        arm_rad: truth.arm_rad,
        bridges: truth.bridges,
    };
    sensors.read(sensed, TICK_S)
}

/// Bridge commands as the plant sees them.
#[must_use]
pub fn drives(drive: MotorCommand, preload: MotorCommand) -> Drives {
    let duty = |command: MotorCommand| f64::from(command.duty.to_bits()) / 32_768.0;
    Drives {
        drive: duty(drive),
        drive_on: drive.enable,
        preload: duty(preload),
        preload_on: preload.enable,
        ..Drives::default()
    }
}
