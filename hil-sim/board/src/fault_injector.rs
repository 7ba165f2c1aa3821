//! The faults of a scenario on the board: at its pins and registers, or in its plant.
//!
//! What software breaks between sensor and controller breaks here before the pin. A sensor
//! that gives nothing is a broken line: a bridge reads the low end, the encoder's lines stay
//! high, the angle sensor does not answer. Lost ticks are an interrupt that asks without end
//! for as long; a task that hangs is caught in a loop in its next turn. Of parameters in flash a
//! bit is turned over, or a host saves new ones, as soon as the drive rests, and power goes or
//! the reset pin is pulled while the flash is at work.

mod save;

use interstage::sense::raw::{AdcCode, Sample, SensorFrame};
use interstage::supervise::Command;

use super::chip::map::PARAMETER_SETS;
use super::core::CoreError;
use super::elf::FLASH;
use super::faults::Fault;
use super::machine::Machine;
use super::peripherals::HZ;
use super::peripherals::flash::Cut;
use hil_sim::faults::sets;
use hil_sim::injector::FaultInjector;
use hil_sim::params::set_of;
use hil_sim::plant::rig::{Drives, VirtualRig};
use hil_sim::plant::sensors::Codes;
use hil_sim::scenario::Scenario;
use hil_sim::scenario::injection::{Injection, Kind, Target};
use interstage::params::slots::SLOT_BYTES;
use interstage::rig::Rig;

use save::Save;
pub(crate) use save::Saving;

/// Cycles into its turn at which a task is caught.
const INTO_TURN: u64 = 100;
/// Milliseconds for which a function that runs tasks is waited for, before the next is.
const PATIENCE: u32 = 20;

/// The faults of a run, and how far they have come.
pub(super) struct BoardInjector {
    faults: FaultInjector,
    hunt: Option<Hunt>,
    /// When the task that was to hang was caught, or the save broken off, s.
    caught_s: Option<f64>,
    /// A task is to hang, or a save to be broken off: it strikes later than it comes.
    waits: bool,
    /// Ticks are being lost.
    losing: bool,
    /// A reset that comes within the millisecond, after this part of it.
    reset: Option<(Fault, f64)>,
    /// Encoder and angle sensor give nothing.
    silent: [bool; 2],
    /// The host's line is flooded, and with what next.
    flood: Option<u32>,
    /// A host that saves parameters.
    save: Option<Save>,
    /// The rig of the parameters.
    rig: Rig,
    /// Seed of the run.
    seed: u64,
}

impl BoardInjector {
    pub(super) fn new(faults: FaultInjector, scenario: &Scenario) -> Self {
        Self {
            faults,
            hunt: None,
            caught_s: None,
            waits: false,
            losing: false,
            reset: None,
            silent: [false; 2],
            flood: None,
            save: None,
            rig: scenario.rig.clone(),
            seed: scenario.run.seed,
        }
    }

    /// A millisecond begins: faults come and go.
    pub(super) fn begin(
        &mut self,
        machine: &mut Machine,
        plant: &mut VirtualRig,
        t_s: f64,
    ) -> Result<(), CoreError> {
        self.faults.begin(t_s, plant.truth());
        self.faults.plant(plant);
        for (injection, comes) in self.faults.changes() {
            self.change(machine, &injection, comes)?;
        }
        let losing = self.faults.lost();
        if losing != std::mem::replace(&mut self.losing, losing) {
            switch(Fault::ButtonStorm, machine, losing)?;
        }
        Ok(())
    }

    fn change(
        &mut self,
        machine: &mut Machine,
        injection: &Injection,
        comes: bool,
    ) -> Result<(), CoreError> {
        if injection.target == Target::HostLine {
            self.flood = comes.then_some(1);
        }
        if let Some(task) = task(injection) {
            self.waits = true;
            self.hunt = comes.then(|| Hunt::new(machine, task));
        }
        if injection.target == Target::ParameterSave {
            self.waits = true;
            // An unsound rig has been refused where the sets were put into flash.
            let set = sets::set(sets::SAVED, &self.rig).ok().filter(|_| comes);
            self.save = set.map(|set| Save::new(machine, set, cut(injection)));
        }
        if let Some(bit) = flipped(machine, injection)?.filter(|_| comes) {
            return bit.strike(machine);
        }
        match register(injection) {
            Some(fault) if comes && injection.resets_board() => {
                // Between any two instructions.
                self.reset = Some((fault, (self.seed as f64 * 0.618_034).fract()));
                Ok(())
            }
            Some(fault) => switch(fault, machine, comes),
            None => Ok(()),
        }
    }

    /// Runs the board towards the turn of a task that is to hang, up to this cycle.
    pub(super) fn hunt(&mut self, machine: &mut Machine, until: u64) -> Result<(), CoreError> {
        if let Some((fault, part)) = self.reset.take() {
            let now = machine.now();
            machine.run_on(now + (part * until.saturating_sub(now) as f64) as u64)?;
            fault.strike(machine)?;
        }
        if let Some(hunt) = &mut self.hunt
            && hunt.go(machine, until)?
        {
            self.hunt = None;
            self.caught_s = Some(machine.now() as f64 / HZ as f64);
        }
        Ok(())
    }

    /// What a host that saves parameters has to send, if there is one.
    pub(super) fn says(&self) -> Option<Vec<u8>> {
        self.save.as_ref().map(Save::says)
    }

    /// So much of it went, and this came back.
    pub(super) fn hears(&mut self, machine: &mut Machine, came: &[u8], went: usize) {
        let Some(save) = &mut self.save else { return };
        save.turn(machine, came, went);
        if self.caught_s.is_none() {
            self.caught_s = save.cut_at(machine).map(|at| at as f64 / HZ as f64);
        }
    }

    /// How far a save of parameters has come, if there is one.
    pub(super) fn saving(&self) -> Option<Saving> {
        self.save.as_ref().map(Save::state)
    }

    /// What the sensors say at the pins, of what they would.
    pub(super) fn tell(&mut self, machine: &mut Machine, codes: Codes, now: u32) -> Codes {
        let mut frame = SensorFrame {
            wheel_encoder: Some(Sample { code: codes.wheel_encoder, at: now }),
            preload_sensor: Some(Sample { code: codes.preload_sensor, at: now }),
            compression_sensor: Some(Sample { code: codes.compression_sensor, at: now }),
            arm_angle: Some(Sample { code: codes.arm_angle, at: now }),
            bridges: Some(codes.bridges),
        };
        self.faults.sensors(&mut frame);
        let bridge = |sample: Option<Sample<AdcCode>>| match sample {
            Some(sample) if sample.at == now => sample.code,
            _ => AdcCode::new(0),
        };
        let fresh = [frame.wheel_encoder.map(|s| s.at), frame.arm_angle.map(|s| s.at)];
        let silent = fresh.map(|at| at != Some(now));
        if silent != std::mem::replace(&mut self.silent, silent) {
            let chip = machine.chip_mut();
            chip.defects.encoder_lines = [silent[0]; 2];
            chip.angle.lost = silent[1];
        }
        Codes {
            wheel_encoder: frame
                .wheel_encoder
                .filter(|_| !silent[0])
                .map_or(codes.wheel_encoder, |s| s.code),
            preload_sensor: bridge(frame.preload_sensor),
            compression_sensor: bridge(frame.compression_sensor),
            arm_angle: frame.arm_angle.filter(|_| !silent[1]).map_or(codes.arm_angle, |s| s.code),
            bridges: frame.bridges.unwrap_or_default(),
        }
    }

    /// The bridges as the plant gets them.
    pub(super) fn drives(&mut self, asked: Drives) -> Drives {
        self.faults.drives(asked)
    }

    /// A command that nobody gave.
    pub(super) fn command(&mut self) -> Option<Command> {
        self.faults.command(None)
    }

    /// Bytes that nobody meant for the host's line.
    pub(super) fn noise(&mut self) -> Option<[u8; 4]> {
        let state = self.flood.as_mut()?;
        // Marsaglia's xorshift.
        *state ^= *state << 13;
        *state ^= *state >> 17;
        *state ^= *state << 5;
        Some(state.to_le_bytes())
    }

    /// Whether nobody reads the log.
    pub(super) fn log_gone(&self) -> bool {
        self.faults.log_gone()
    }

    /// When the first fault came, s since power-up; of a task that hangs, when it was
    /// caught; of a save, when it was broken off.
    pub(super) fn struck_s(&self) -> Option<f64> {
        if self.waits { self.caught_s } else { self.faults.struck_s() }
    }

    /// When it first did something, see [`FaultInjector::acts_s`].
    pub(super) fn acts_s(&self) -> Option<f64> {
        if self.waits { self.caught_s } else { self.faults.acts_s() }
    }

    /// When the readback had to tell it, see [`FaultInjector::tells_s`].
    pub(super) fn tells_s(&self) -> Option<f64> {
        if self.waits { self.caught_s } else { self.faults.tells_s() }
    }
}

/// The letter of a command on the console.
pub(crate) const fn letter(command: Command) -> u8 {
    match command {
        Command::Start => b's',
        Command::Stop => b'x',
        Command::Retract => b'r',
        Command::Reset => b'0',
    }
}

fn switch(fault: Fault, machine: &mut Machine, on: bool) -> Result<(), CoreError> {
    if on {
        return fault.strike(machine);
    }
    fault.heal(machine);
    Ok(())
}

/// Name of the task that is to hang.
fn task(injection: &Injection) -> Option<&'static str> {
    Some(match injection.target {
        Target::Model | Target::ModelTask => "model",
        Target::WheelEncoderTask => "wheel_encoder",
        Target::PreloadSensorTask => "preload_sensor",
        Target::CompressionSensorTask => "compression_sensor",
        Target::ArmAngleTask => "arm_angle",
        Target::TickTask => "motors",
        Target::JournalTask => "journal",
        Target::LineTask => "link",
        _ => return None,
    })
}

/// When a save is broken off.
fn cut(injection: &Injection) -> Cut {
    let operation = injection.magnitude() as u64;
    match injection.kind {
        Kind::Reset => Cut::Pulled(operation),
        _ => Cut::Within(operation),
    }
}

/// The bit of the image or of a set of parameters that is turned over; none if it is another
/// fault, or the image has no such set.
fn flipped(machine: &Machine, injection: &Injection) -> Result<Option<Fault>, CoreError> {
    let bit = injection.magnitude() as u32;
    let (place, bit) = match injection.target {
        Target::StoredSet => (Some(PARAMETER_SETS), bit),
        Target::SpareSet => (Some(PARAMETER_SETS + SLOT_BYTES as u32), bit),
        Target::ImageSet => {
            let set = set_of("prototype", &Rig::prototype()).unwrap_or_default();
            (machine.find(&set)?, bit % (8 * set.len() as u32).max(1))
        }
        Target::Image => {
            let used = machine.image().flash.iter().rposition(|byte| *byte != 0xFF);
            (Some(FLASH.base), bit % (8 * used.map_or(1, |last| last as u32 + 1)))
        }
        _ => return Ok(None),
    };
    Ok(place.map(|place| Fault::BitFlip(place + bit / 8, (bit % 8) as u8)))
}

/// What it is in registers and lines.
fn register(injection: &Injection) -> Option<Fault> {
    let word = injection.magnitude() as u16;
    Some(match (injection.target, injection.kind) {
        (Target::PreloadSensorConverter, _) => Fault::StuckCode(0, word),
        (Target::TreadConverter, _) => Fault::StuckCode(1, word),
        (Target::AngleBus, Kind::BitErrors) => Fault::BitErrors(word),
        (Target::AngleBus, _) => Fault::AngleLost,
        (Target::EncoderLineA, _) => Fault::EncoderLine(0),
        (Target::EncoderLineB, _) => Fault::EncoderLine(1),
        (Target::Dma, _) => Fault::DmaStalled,
        (Target::Timer, _) => Fault::TimerFlags,
        (Target::Interrupt, _) => Fault::ButtonStorm,
        (Target::Processor, _) => Fault::Caught,
        (Target::Supply, Kind::Off) => Fault::BrownOut,
        (Target::Supply, Kind::Weak) => Fault::SupplyDip,
        (Target::Supply, _) => Fault::SupplyCut,
        (Target::ResetPin, _) => Fault::ResetPin,
        (Target::Debugger, _) => Fault::Software,
        _ => return None,
    })
}

/// The search for a task's next turn.
struct Hunt {
    task: &'static str,
    /// Functions that run tasks, of which each runs one, and may run this one.
    places: Vec<u32>,
    tried: u32,
}

impl Hunt {
    fn new(machine: &Machine, task: &'static str) -> Self {
        let functions = &machine.image().functions;
        let polls = functions.iter().filter(|f| f.name.contains("TaskStorage<F>::poll"));
        Self { task, places: polls.map(|f| f.range.start).collect(), tried: 0 }
    }

    /// Goes on up to this cycle; whether the task was caught.
    fn go(&mut self, machine: &mut Machine, until: u64) -> Result<bool, CoreError> {
        while let Some(&place) = self.places.first() {
            if !machine.run_to(place, until)? {
                self.tried += 1;
                if self.tried.is_multiple_of(PATIENCE) {
                    self.places.rotate_left(1);
                }
                return Ok(false);
            }
            if machine.task() == Some(self.task) {
                machine.run_on(machine.now() + INTO_TURN)?;
                machine.catch()?;
                return Ok(true);
            }
            self.places.remove(0);
        }
        Ok(false)
    }
}
