//! A run in progress: controller and plant, a tick per step, with commands and sensor
//! failures from outside.

use interstage::log::{Record, SnapshotRecorder};
use interstage::model::{Plan, Planner};
use interstage::restart::{DriveSnapshot, MissedCheckIns, Reset, Restart};
use interstage::sense::raw::SensorFrame;
use interstage::supervise::{Command, Mode};
use interstage::tick::{Controller, Input, Output, State};
use interstage::units::{Millimetres, MotorCommand, Tick};

use super::stream::Stream;
use super::{Options, RunError, RunningRig};
use crate::injector::{FaultInjector, FaultTimes, RecordFound};
use crate::plant::draw::PlantParameters;
use crate::plant::limits::Refusal;
use crate::plant::rig::{Drives, VirtualRig};
use crate::plant::sensors::{Codes, Sensors};
use crate::record::{Columns, Recording, RunRecorder};
use crate::scenario::{Direction, Scenario, TICK_S};

/// A run in progress.
///
/// [`RunningRig::step`] is one millisecond. Its two halves, [`Session::sense`] and
/// [`Session::advance`], let a caller change what the controller is given.
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
    recorder: RunRecorder,
    stream: Option<Stream>,
    injector: Option<FaultInjector>,
    /// Output that bridges and record keep while ticks are lost.
    held: Output,
    /// Whether ticks were lost before this one, and the command that was lost with them.
    overrun: bool,
    missed: Option<Command>,
}

impl Session {
    /// A session before its first tick, see [`initial_rig`].
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
        let (plant, sensors) = initial_rig(scenario)?;
        let position = plant.truth().position_mm;
        let controller = Controller::try_build(&scenario.rig)?;
        Ok(Self {
            injector: FaultInjector::of(scenario),
            held: Output::default(),
            overrun: false,
            missed: None,
            stream: options.rows.then(|| Stream::new(scenario, &controller)),
            controller,
            recorder: RunRecorder::new(planner.gap_ref(direction).to_num(), position),
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

    /// The same session with every stage of the controller run in every tick.
    pub fn without_skipping(mut self) -> Self {
        self.controller = self.controller.without_skipping();
        self
    }

    /// The same session with the binary log kept, whether rows are or not.
    pub fn logging(mut self) -> Self {
        self.stream.get_or_insert_with(|| Stream::new(&self.scenario, &self.controller));
        self
    }

    /// The same with every ring element visited, see [`VirtualRig::visiting_all`].
    pub fn visiting_all(mut self) -> Self {
        self.plant = self.plant.visiting_all();
        self
    }

    /// The same session on a plant, or read by sensors, changed like this; the controller does not know.
    pub fn with_plant(mut self, change: impl FnOnce(&mut VirtualRig, &mut Sensors)) -> Self {
        change(&mut self.plant, &mut self.sensors);
        self
    }

    /// Reads the sensors: the latest code of each at the present tick. Once a tick,
    /// before [`Session::advance`]. Here the scenario's faults come and go.
    pub fn sense(&mut self) -> SensorFrame {
        let codes = read(&mut self.sensors, &self.plant);
        let at = self.tick;
        codes.put(&mut self.frame, at);
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
    pub fn advance(
        &mut self,
        sensors: &SensorFrame,
        command: Option<Command>,
    ) -> Result<Output, RunError> {
        let command = self.missed.take().or(command);
        let columns = if self.injector.as_ref().is_some_and(FaultInjector::lost) {
            (self.overrun, self.missed) = (true, command);
            self.options.rows.then(|| Columns::unknown(self.tick))
        } else {
            self.control(sensors, command)
        };
        let output = self.held.clone();
        self.held.events.clear();
        self.held.request = None;
        self.recorder.take(&output.telemetry, &output.events, self.plant.truth(), columns);
        let mut drives = drives(output.drive, output.preload);
        if let Some(injector) = &mut self.injector {
            drives = injector.drives(drives);
        }
        self.plant.step(&drives, TICK_S)?;
        self.tick += 1;
        Ok(output)
    }

    /// The control tick and the model task behind it; the tick's columns if they are kept.
    fn control(&mut self, sensors: &SensorFrame, command: Option<Command>) -> Option<Columns> {
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
        let rows = self.options.rows;
        rows.then(|| Columns::of(&Record::of(&input, output), sensors))
    }

    /// A power cycle: the controller forgets everything, the rig stays where it is.
    pub fn reboot(&mut self) {
        self.state = State::default();
        self.plan = None;
        if let Some(stream) = &mut self.stream {
            stream.restart(&self.scenario, &self.controller);
        }
    }

    /// The snapshot of the last tick that memory keeps over a reset.
    pub fn record(&self) -> DriveSnapshot {
        SnapshotRecorder::default().snapshot(
            &self.held.telemetry,
            self.state.confidence(),
            MissedCheckIns::NOBODY,
            self.state.zeros(),
        )
    }

    /// A reset that keeps memory and switches the bridges off at once: the controller starts
    /// with the position of its last snapshot.
    pub fn restart(&mut self) {
        let snapshot = Some(self.record());
        self.restart_from(Restart { reset: Reset::Pin, snapshot, crash: None });
    }

    /// The reset of a fault.
    fn reset(&mut self, record: RecordFound) {
        match record {
            RecordFound::Intact => self.restart(),
            RecordFound::Off(mm) => {
                let mut snapshot = self.record();
                snapshot.position += Millimetres::from_num(mm);
                let snapshot = Some(snapshot);
                self.restart_from(Restart { reset: Reset::Power, snapshot, crash: None });
            }
            RecordFound::Gone => self.reboot(),
        }
    }

    /// A start that finds this state of the time before it.
    pub fn restart_from(&mut self, restart: Restart) {
        self.reboot();
        self.state = State::restored(restart.place());
        if let Some(stream) = &mut self.stream {
            stream.report(restart);
        }
    }

    /// The recording of a session that ends here; it took `wall_s` to compute.
    pub fn finish(mut self, wall_s: f64) -> Recording {
        let stream = self.take_log(true);
        let arrived = match self.state.mode() {
            Mode::Complete(direction) => Some(direction),
            _ => None,
        };
        let recording = self.recorder.finish("sil", &self.scenario, &self.plant, arrived, wall_s);
        Recording { stream, ..recording }
    }
}

impl RunningRig for Session {
    type Error = RunError;

    fn step(&mut self, command: Option<Command>) -> Result<Output, RunError> {
        let frame = self.sense();
        self.advance(&frame, command)
    }

    fn mode(&self) -> Mode {
        self.state.mode()
    }

    fn time_s(&self) -> f64 {
        f64::from(self.tick) * TICK_S
    }

    fn plant(&self) -> &VirtualRig {
        &self.plant
    }

    fn fault_times(&self) -> FaultTimes {
        self.injector.as_ref().map(FaultInjector::times).unwrap_or_default()
    }

    fn take_log(&mut self, end: bool) -> Vec<u8> {
        self.stream.as_mut().map(|stream| stream.take(end)).unwrap_or_default()
    }
}

/// The plant of a scenario and its sensors before the first tick.
pub fn initial_rig(scenario: &Scenario) -> Result<(VirtualRig, Sensors), Refusal> {
    let parameters = scenario.plant();
    parameters.check(scenario.rig.preload.limit_n)?;
    let sensors = Sensors::new(parameters.sensors.clone(), scenario.run.seed);
    Ok((plant_at_start(parameters, scenario, TICK_S), sensors))
}

/// A plant before the run of a scenario, which advances by `dt_s`: for deployment with the wheel
/// unloaded at the stow end; for retraction where deployment ended, pressed at the end of travel,
/// where it has borne the load for long.
pub fn plant_at_start(parameters: PlantParameters, scenario: &Scenario, dt_s: f64) -> VirtualRig {
    let rig = &scenario.rig;
    match scenario.run.direction {
        Direction::Deploy => VirtualRig::new(parameters, 0.0, 0.0, dt_s),
        Direction::Retract => {
            VirtualRig::new(parameters, rig.rig.travel_mm, rig.preload.cruise_n, dt_s)
                .with_speed(0.0)
        }
    }
}

/// What the sensors of this plant read now, a tick after the last call.
pub fn read(sensors: &mut Sensors, plant: &VirtualRig) -> Codes {
    sensors.read(plant.truth(), TICK_S)
}

/// Bridge commands as the plant sees them.
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
