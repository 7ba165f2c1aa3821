//! The board on its test bench: the plant at the other end of its pins.
//!
//! The plant advances by milliseconds under the mean duty of the bridges over that
//! millisecond; then its sensors are read. In between, the chip runs cycle by cycle with
//! constant voltages and frames at its inputs.

use super::chip::Motor;
use super::error::{BoardError, ImageError};
use super::fault_injector::{BoardInjector, Saving};
use super::faults;
use super::log::{Line, Reader, Strings};
use super::machine::Machine;
use super::peripherals::HZ;
use super::peripherals::rcc::Cause;
use super::rtt::Probe;
use hil_sim::injector::{FaultInjector, FaultTimes};
use hil_sim::plant::draw::PlantParameters;
use hil_sim::plant::rig::{Drives, VirtualRig};
use hil_sim::plant::sensors::{Codes, Sensors};
use hil_sim::record::letter;
use hil_sim::scenario::Scenario;
use hil_sim::scenario::injection::Injection;
use hil_sim::session;
use interstage::sense::raw::{EncoderCount, SensorId};

use super::wiring::{Mistake, Wiring};

/// Step of the plant, s and cycles.
const STEP_S: f64 = 1e-3;
/// Most counts of the encoder in a millisecond.
const MOST_COUNTS: i16 = 512;
/// Core cycles in a millisecond.
pub const STEP: u64 = HZ / 1000;
/// Cycles from the plant's step to the firmware's tick: the converters have codes of after it.
const BEFORE_TICK: u64 = STEP / 4;
/// Cycles of a start at the slow clock, at most.
const LONGEST_START: u64 = 30 * STEP;

/// The board's inputs and outputs over a millisecond.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Passed {
    /// Codes of the sensors, constant over the millisecond.
    pub codes: Codes,
    /// Mean commands at the bridges.
    pub drives: Drives,
}

/// A board and its plant.
pub struct Bench<'a> {
    pub machine: Machine,
    pub plant: VirtualRig,
    sensors: Sensors,
    probe: Probe,
    reader: Reader<'a>,
    codes: Codes,
    /// The wheel's position in counts, beyond the 16 bits of a code.
    wheel: i64,
    millisecond: u64,
    /// Cycle at which the current millisecond ends.
    pub end: u64,
    /// Bytes from the binary log's channel; none while it is not read.
    frames: Option<Vec<u8>>,
    /// The faults of the scenario, if it has some.
    injector: Option<BoardInjector>,
    /// Between the pins and the plant; `connect` applies a change of it.
    pub wiring: Wiring,
}

impl<'a> Bench<'a> {
    /// A board with this image, off, and the plant of a scenario: for deployment with
    /// the wheel unloaded at the stow end, for retraction pressed at the end of travel.
    pub fn new(elf: &[u8], strings: &'a Strings, scenario: &Scenario) -> Result<Self, ImageError> {
        Self::wired(elf, strings, scenario, &[])
    }

    /// The same with mistakes in the wiring.
    pub fn wired(
        elf: &[u8],
        strings: &'a Strings,
        scenario: &Scenario,
        mistakes: &[Mistake],
    ) -> Result<Self, ImageError> {
        let mut scenario = scenario.clone();
        let faults: Vec<Injection> = mistakes.iter().flat_map(|mistake| mistake.faults()).collect();
        scenario.run.faults.extend(&faults);
        let scenario = &scenario;
        let mut wiring = Wiring::with(mistakes);
        let mut parameters = scenario.plant();
        wiring.build(&scenario.rig, &mut parameters);
        let machine = Machine::new(elf)?;
        let mut sensors = Sensors::new(parameters.sensors.clone(), scenario.run.seed);
        let plant = session::plant_at_start(parameters, scenario, STEP_S);
        let codes = session::read(&mut sensors, &plant);
        let mut bench = Self {
            probe: Probe::of(&machine)?,
            machine,
            plant,
            sensors,
            reader: strings.reader(),
            codes,
            wheel: 0,
            millisecond: 0,
            end: STEP,
            frames: Some(Vec::new()),
            injector: FaultInjector::of(scenario)
                .map(|faults| BoardInjector::new(faults, scenario)),
            wiring,
        };
        bench.connect();
        bench.set_sensors(codes);
        // A probe sees them before the first instruction.
        faults.iter().try_for_each(|fault| faults::switch(&mut bench.machine, fault, true))?;
        Ok(bench)
    }

    /// Puts another plant there, stowed and unloaded, with its sensors.
    pub fn put(&mut self, parameters: PlantParameters, seed: u64) {
        self.sensors = Sensors::new(parameters.sensors.clone(), seed);
        self.plant = VirtualRig::new(parameters, 0.0, 0.0, STEP_S);
    }

    /// Runs one millisecond. Returns inputs and outputs, and the lines of the log.
    pub fn step(&mut self) -> Result<(Passed, Vec<Line>), BoardError> {
        let end = self.end;
        self.save()?;
        if let Some(injector) = &mut self.injector {
            // A fault at time zero is present before the first instruction.
            if self.millisecond == 0 {
                injector.begin(&mut self.machine, &mut self.plant, 0.0)?;
            }
            let (command, noise) = (injector.faults.command(None), injector.noise());
            injector.run_to_strike(&mut self.machine, end)?;
            if let Some(command) = command {
                self.send(letter(command))?;
            }
            if let Some(noise) = noise {
                self.line_send(&noise)?;
            }
        }
        self.machine.run_on(end)?;
        self.start()?;
        self.close()
    }

    /// A start up to the chip's full clock is put before a millisecond: the firmware's begin with
    /// that clock. A start that hangs is left after a while.
    fn start(&mut self) -> Result<(), BoardError> {
        let (begun, mut passed) = (self.machine.now(), 0);
        while self.machine.chip().rcc.slow_hz.is_some() && passed < LONGEST_START {
            self.machine.run_on(self.machine.now() + STEP / 1000)?;
            if (self.machine.now() - begun) / STEP > passed / STEP {
                let drives = self.drives();
                self.plant.step(&self.wiring.drives(drives), STEP_S)?;
            }
            passed = self.machine.now() - begun;
            self.end = self.machine.now() + STEP - BEFORE_TICK;
        }
        Ok(self.machine.run_on(self.end)?)
    }

    /// The host of a fault that interrupts a parameter save exchanges bytes with the board.
    fn save(&mut self) -> Result<(), BoardError> {
        let Some(bytes) = self.injector.as_ref().and_then(BoardInjector::to_board) else {
            return Ok(());
        };
        let sent = self.line_send(&bytes)?;
        let received = self.line_take()?;
        if let Some(injector) = &mut self.injector {
            injector.exchanged(&mut self.machine, &received, sent);
        }
        Ok(())
    }

    /// State of a parameter save that a fault interrupts.
    pub(crate) fn saving(&self) -> Option<Saving> {
        self.injector.as_ref().and_then(BoardInjector::saving)
    }

    /// Closes a millisecond that is over: the plant makes its step.
    fn close(&mut self) -> Result<(Passed, Vec<Line>), BoardError> {
        self.millisecond += 1;
        self.end += STEP;
        let drives = self.drives();
        let passed = Passed { codes: self.codes, drives };
        let taken = match &mut self.injector {
            Some(injector) => injector.faults.drives(drives),
            None => drives,
        };
        let taken = self.wiring.drives(taken);
        self.plant.step(&taken, STEP_S)?;
        let mut codes = session::read(&mut self.sensors, &self.plant);
        if let Some(injector) = &mut self.injector {
            let t_s = self.millisecond as f64 * STEP_S;
            injector.begin(&mut self.machine, &mut self.plant, t_s)?;
            codes = injector.sensors(&mut self.machine, codes, self.millisecond as u32);
        }
        self.set_sensors(codes);
        if self.injector.as_ref().is_some_and(|injector| injector.faults.log_gone()) {
            return Ok((passed, Vec::new()));
        }
        if let Some(frames) = &mut self.frames {
            frames.extend(self.probe.up(&mut self.machine, 1)?);
        }
        let bytes = self.probe.up(&mut self.machine, 0)?;
        Ok((passed, self.reader.read(&bytes)))
    }

    /// Mean commands at the bridges since the last call.
    fn drives(&mut self) -> Drives {
        let now = self.machine.now();
        let [drive, preload] = self.machine.chip_mut().take_motors(now);
        let on = |motor: Motor| motor.enabled > 0.5;
        Drives {
            drive: drive.duty,
            drive_on: on(drive),
            preload: preload.duty,
            preload_on: on(preload),
            ..Drives::default()
        }
    }

    /// Applies the wiring to the chip's pins.
    pub(crate) fn connect(&mut self) {
        let now = self.machine.now();
        self.wiring.connect(self.machine.chip_mut(), now);
    }

    /// A hand holds the board in reset for so many milliseconds.
    pub(crate) fn hold_reset(&mut self, milliseconds: u32) -> Result<(), BoardError> {
        for _ in 0..milliseconds {
            self.machine.restart(Cause::Pin)?;
            self.connect();
            let end = self.machine.now() + STEP - 1;
            self.machine.halt(STEP - 1);
            self.machine.run_on(end)?;
            let drives = self.drives();
            self.plant.step(&self.wiring.drives(drives), STEP_S)?;
        }
        self.machine.restart(Cause::Pin)?;
        self.connect();
        Ok(())
    }

    /// Applies these codes to the sensors' lines.
    fn set_sensors(&mut self, codes: Codes) {
        let codes = self.wiring.codes(codes);
        // Noise on the lines can exceed the wheel's own speed.
        let [count, before] = [codes, self.codes]
            .map(|codes| EncoderCount::new(codes.sensors[SensorId::WheelEncoder as usize]));
        let turned = count.since(before).clamp(-MOST_COUNTS, MOST_COUNTS);
        self.wheel += i64::from(turned);
        self.codes = codes;
        let chip = self.machine.chip_mut();
        // The readback converts with 12 of the 16 bits.
        let bridges = [codes.bridges.drive, codes.bridges.pretightener].map(|code| code.get() << 4);
        chip.set_analog(SensorId::ANALOG.map(|sensor| codes.sensors[sensor as usize]), bridges);
        chip.angle.angle = codes.sensors[SensorId::ArmAngle as usize];
        chip.turn_wheel(self.wheel, STEP);
    }

    /// A probe attaches, and halts the core for some 30 accesses of half a millisecond: to halt it,
    /// read the reason and clear it, look for breakpoints, step and run. Source: probe-rs 0.32,
    /// `Session::new`, `Session::halted_access`, `Armv7m`.
    pub fn attach(&mut self) {
        self.machine.halt(15 * STEP);
    }

    /// Sends a letter to the board's console; false if it has no room or is not set up yet.
    pub fn send(&mut self, letter: u8) -> Result<bool, BoardError> {
        Ok(self.probe.down(&mut self.machine, 0, &[letter])? == 1)
    }

    /// Sends bytes down the binary line; returns how many it had room for.
    pub fn line_send(&mut self, bytes: &[u8]) -> Result<usize, BoardError> {
        Ok(self.probe.down(&mut self.machine, 1, bytes)?)
    }

    /// Bytes that the board has sent up its binary line.
    pub(crate) fn line_take(&mut self) -> Result<Vec<u8>, BoardError> {
        Ok(self.probe.up(&mut self.machine, 2)?)
    }

    /// Bytes from the binary log's channel since the last call.
    pub fn take_frames(&mut self) -> Vec<u8> {
        self.frames.as_mut().map(std::mem::take).unwrap_or_default()
    }

    /// The same, or what its ring holds while it is not read.
    pub(crate) fn read_log(&mut self) -> Result<Vec<u8>, BoardError> {
        match &mut self.frames {
            Some(frames) => Ok(std::mem::take(frames)),
            None => Ok(self.probe.up(&mut self.machine, 1)?),
        }
    }

    /// Sets whether the binary log's channel is read each millisecond; it is at first.
    pub fn listen(&mut self, listen: bool) {
        self.frames = listen.then(|| self.take_frames());
    }

    /// When the scenario's faults struck and acted.
    pub(crate) fn fault_times(&self) -> FaultTimes {
        self.injector.as_ref().map(BoardInjector::times).unwrap_or_default()
    }

    /// Distance that the tread has turned, mm.
    pub fn tread_mm(&self) -> f64 {
        self.plant.truth().rotation_rad * self.plant.parameters().ring.radius_mm
    }

    /// Time since power came up, s, but for starts at the slow clock.
    pub fn time_s(&self) -> f64 {
        self.millisecond as f64 * STEP_S
    }
}
