//! The board on its test bench: the plant at the other end of its pins.
//!
//! The plant advances by whole milliseconds under the mean of what the bridges' lines
//! said meanwhile; then its sensors speak anew. In between, the chip's clock goes on
//! cycle by cycle and takes the voltages, edges and frames as they stand.

use super::chip::Motor;
use super::error::ImageError;
use super::fault_injector::{BoardInjector, Saving, letter};
use super::log::{Line, Reader, Strings};
use super::machine::Machine;
use super::peripherals::HZ;
use super::rtt::Probe;
use hil_sim::injector::FaultInjector;
use hil_sim::plant::rig::{Drives, PlantError, VirtualRig};
use hil_sim::plant::sensors::{Codes, Sensed, Sensors};
use hil_sim::scenario::{Direction, Scenario};

/// Step of the plant, s and cycles.
const STEP_S: f64 = 1e-3;
/// Most counts that the encoder's lines go through in a millisecond.
const MOST_COUNTS: i16 = 512;
/// Cycles of a millisecond.
pub const STEP: u64 = HZ / 1000;

/// What can go wrong on the bench.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// The image or the core.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// The plant left the set of meaningful states.
    #[error(transparent)]
    Plant(#[from] PlantError),
}

impl From<super::core::CoreError> for BenchError {
    fn from(error: super::core::CoreError) -> Self {
        Self::Image(error.into())
    }
}

/// What passed at the pins in a millisecond.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Passed {
    /// What the sensors said throughout.
    pub codes: Codes,
    /// What the bridges were driven with.
    pub drives: Drives,
}

/// A board and its plant.
pub struct Bench<'a> {
    machine: Machine,
    plant: VirtualRig,
    sensors: Sensors,
    probe: Probe,
    reader: Reader<'a>,
    codes: Codes,
    /// The wheel's position in counts, beyond the 16 bits of a code.
    wheel: i64,
    millisecond: u64,
    /// Cycle at which the millisecond under way is over.
    end: u64,
    /// Restarts after which it was set.
    restarts: usize,
    /// What has come on the binary log's channel; none if nobody listens.
    frames: Option<Vec<u8>>,
    /// The faults of the scenario, if it has some.
    injector: Option<BoardInjector>,
}

impl<'a> Bench<'a> {
    /// A board with this image, off, and the plant of a scenario: for deployment with
    /// the wheel unloaded at the stow end, for retraction pressed at the end of travel.
    ///
    /// # Errors
    /// [`ImageError`] if the image is none, or lacks its log.
    pub fn new(elf: &[u8], strings: &'a Strings, scenario: &Scenario) -> Result<Self, ImageError> {
        let parameters = scenario.plant();
        let (position, preload) = match scenario.run.direction {
            Direction::Deploy => (0.0, 0.0),
            Direction::Retract => (scenario.rig.rig.travel_mm, scenario.rig.preload.cruise_n),
        };
        let machine = Machine::new(elf)?;
        let mut sensors = Sensors::new(parameters.sensors.clone(), scenario.run.seed);
        let plant = VirtualRig::new(parameters, position, preload, STEP_S);
        let codes = sensors.read(sensed(&plant), STEP_S);
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
            restarts: 0,
            frames: Some(Vec::new()),
            injector: FaultInjector::of(scenario)
                .map(|faults| BoardInjector::new(faults, scenario)),
        };
        bench.speak(codes);
        Ok(bench)
    }

    /// One millisecond. Returns what passed at the pins, and what was logged.
    ///
    /// # Errors
    /// [`BenchError`] if the engine or the plant fails.
    pub fn step(&mut self) -> Result<(Passed, Vec<Line>), BenchError> {
        let end = self.end();
        self.save()?;
        if let Some(injector) = &mut self.injector {
            // What is broken from the first is so before the first instruction.
            if self.millisecond == 0 {
                injector.begin(&mut self.machine, &mut self.plant, 0.0)?;
            }
            let (command, noise) = (injector.command(), injector.noise());
            injector.hunt(&mut self.machine, end)?;
            if let Some(command) = command {
                self.send(letter(command))?;
            }
            if let Some(noise) = noise {
                self.line_send(&noise)?;
            }
        }
        self.machine.run_on(end)?;
        self.close()
    }

    /// A host that saves parameters, if a fault has it so, has its turn at the line.
    fn save(&mut self) -> Result<(), BenchError> {
        let Some(says) = self.injector.as_ref().and_then(BoardInjector::says) else {
            return Ok(());
        };
        let went = self.line_send(&says)?;
        let came = self.line_take()?;
        if let Some(injector) = &mut self.injector {
            injector.hears(&mut self.machine, &came, went);
        }
        Ok(())
    }

    /// How far a save of parameters has come that a fault is to break off.
    #[must_use]
    pub(crate) fn saving(&self) -> Option<Saving> {
        self.injector.as_ref().and_then(BoardInjector::saving)
    }

    /// Cycle at which the millisecond under way is over.
    ///
    /// The board counts its milliseconds from its start, and so does the plant: a tick always
    /// comes a little into one. Where a restart shifted the two against one another, a tick
    /// could meet the step of the plant, and find the wheel a whole millisecond farther or
    /// not by a few microseconds of its own.
    fn end(&mut self) -> u64 {
        let restarts = self.machine.restarts();
        if let Some((at, _)) = restarts.last()
            && restarts.len() != self.restarts
        {
            self.restarts = restarts.len();
            let since = self.machine.now().saturating_sub(*at);
            self.end = at + (since / STEP + 1) * STEP;
        }
        self.end
    }

    /// Goes on up to the end of the millisecond or to a breakpoint, whose address is
    /// returned.
    ///
    /// # Errors
    /// As [`Bench::step`].
    pub fn run_to_break(&mut self) -> Result<Option<u32>, BenchError> {
        let end = self.end();
        Ok(self.machine.run_until(end)?)
    }

    /// Goes on by one instruction.
    ///
    /// # Errors
    /// As [`Bench::step`].
    pub fn step_instruction(&mut self) -> Result<(), BenchError> {
        let end = self.end();
        Ok(self.machine.step(end)?)
    }

    /// Whether the millisecond is over and has to be closed.
    #[must_use]
    pub fn is_due(&mut self) -> bool {
        self.machine.now() >= self.end()
    }

    /// Closes a millisecond that is over: the plant takes its step.
    ///
    /// # Errors
    /// As [`Bench::step`].
    pub fn close(&mut self) -> Result<(Passed, Vec<Line>), BenchError> {
        self.millisecond += 1;
        self.end = self.end() + STEP;
        let now = self.machine.now();
        let [drive, preload] = self.machine.chip_mut().take_motors(now);
        let on = |motor: Motor| motor.enabled > 0.5;
        let drives = Drives {
            drive: drive.duty,
            drive_on: on(drive),
            preload: preload.duty,
            preload_on: on(preload),
            ..Drives::default()
        };
        let passed = Passed { codes: self.codes, drives };
        let taken = self.injector.as_mut().map_or(drives, |injector| injector.drives(drives));
        self.plant.step(&taken, STEP_S)?;
        let mut codes = self.sensors.read(sensed(&self.plant), STEP_S);
        if let Some(injector) = &mut self.injector {
            let t_s = self.millisecond as f64 * STEP_S;
            injector.begin(&mut self.machine, &mut self.plant, t_s)?;
            codes = injector.tell(&mut self.machine, codes, self.millisecond as u32);
        }
        self.speak(codes);
        if self.injector.as_ref().is_some_and(BoardInjector::log_gone) {
            return Ok((passed, Vec::new()));
        }
        if let Some(frames) = &mut self.frames {
            frames.extend(self.probe.up(&mut self.machine, 1)?);
        }
        let bytes = self.probe.up(&mut self.machine, 0)?;
        Ok((passed, self.reader.read(&bytes)))
    }

    /// The sensors' lines take on these codes.
    fn speak(&mut self, codes: Codes) {
        // More than a wheel can do is what can be made of noise on its lines.
        let turned =
            codes.wheel_encoder.since(self.codes.wheel_encoder).clamp(-MOST_COUNTS, MOST_COUNTS);
        self.wheel += i64::from(turned);
        self.codes = codes;
        let chip = self.machine.chip_mut();
        // Twelve bits and no more is what the readback takes of the sixteen.
        let bridges = [codes.bridges.drive, codes.bridges.pretightener].map(|code| code.get() << 4);
        chip.set_analog([
            codes.preload_sensor.get(),
            codes.compression_sensor.get(),
            bridges[0],
            bridges[1],
        ]);
        chip.angle.angle = codes.arm_angle.get();
        chip.turn_wheel(self.wheel, STEP);
    }

    /// Sends a letter to the board's console; false if it does not listen yet.
    ///
    /// # Errors
    /// [`BenchError`] if the engine fails.
    pub fn send(&mut self, letter: u8) -> Result<bool, BenchError> {
        Ok(self.probe.down(&mut self.machine, 0, letter)?)
    }

    /// Sends bytes down the binary line; gives how many there was room for.
    ///
    /// # Errors
    /// [`BenchError`] if the engine fails.
    pub fn line_send(&mut self, bytes: &[u8]) -> Result<usize, BenchError> {
        for (sent, byte) in bytes.iter().enumerate() {
            if !self.probe.down(&mut self.machine, 1, *byte)? {
                return Ok(sent);
            }
        }
        Ok(bytes.len())
    }

    /// What the board has sent up its binary line.
    ///
    /// # Errors
    /// [`BenchError`] if the engine fails.
    pub fn line_take(&mut self) -> Result<Vec<u8>, BenchError> {
        Ok(self.probe.up(&mut self.machine, 2)?)
    }

    /// What has come on the binary log's channel since the last call.
    pub fn take_frames(&mut self) -> Vec<u8> {
        self.frames.as_mut().map(std::mem::take).unwrap_or_default()
    }

    /// Whether the binary log's channel is read from now on; it is until told otherwise.
    pub fn listen(&mut self, listen: bool) {
        self.frames = listen.then(|| self.take_frames());
    }

    /// The board.
    #[must_use]
    pub const fn machine(&self) -> &Machine {
        &self.machine
    }

    /// The board, to be tampered with.
    pub fn machine_mut(&mut self) -> &mut Machine {
        &mut self.machine
    }

    /// The board alone, for what is to be asked of it after the run.
    #[must_use]
    pub fn into_machine(self) -> Machine {
        self.machine
    }

    /// When the first of the scenario's faults came, s since power-up.
    #[must_use]
    pub fn struck_s(&self) -> Option<f64> {
        self.injector.as_ref().and_then(BoardInjector::struck_s)
    }

    /// When it first did something, s since power-up.
    #[must_use]
    pub fn acts_s(&self) -> Option<f64> {
        self.injector.as_ref().and_then(BoardInjector::acts_s)
    }

    /// When the readback had to tell it, s since power-up.
    #[must_use]
    pub fn tells_s(&self) -> Option<f64> {
        self.injector.as_ref().and_then(BoardInjector::tells_s)
    }

    /// The plant.
    #[must_use]
    pub const fn plant(&self) -> &VirtualRig {
        &self.plant
    }

    /// Time since power came up, s.
    #[must_use]
    pub fn time_s(&self) -> f64 {
        self.millisecond as f64 * STEP_S
    }
}

/// What the sensors look at.
fn sensed(plant: &VirtualRig) -> Sensed {
    let truth = plant.truth();
    Sensed {
        rotation_rad: truth.rotation_rad,
        preload_n: truth.preload_n,
        depth_mm: truth.depth_mm,
        arm_rad: truth.arm_rad,
        bridges: truth.bridges,
    }
}
