//! The faults of a scenario on the board: at its pins and registers, or in its plant.
//!
//! A fault that the software campaign injects between sensor and controller is injected here
//! before the pin. A silent sensor is a broken line: a bridge reads the low end, the encoder's
//! lines stay high, the angle sensor does not answer. Lost ticks are an interrupt line that
//! stays active; a hanging task loops in its next poll. In the stored parameters a bit is
//! inverted, or a host saves new ones as soon as the drive rests, and power is lost or the
//! reset pin is pulled during a flash operation. With a short of the emergency stop's wire, its
//! button is pressed: the line does not show it.

mod save;

use interstage::sense::raw::{SensorFrame, SensorId};

use super::core::CoreError;
use super::faults;
use super::machine::Machine;
use super::peripherals::HZ;
use super::peripherals::flash::Cut;
use hil_sim::faults::sets;
use hil_sim::injector::{FaultInjector, FaultTimes};
use hil_sim::plant::rig::VirtualRig;
use hil_sim::plant::sensors::Codes;
use hil_sim::scenario::Scenario;
use hil_sim::scenario::injection::{Injection, Kind, Target, entry};
use interstage::rig::Rig;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use save::Save;
pub(crate) use save::Saving;

/// Cycles into its poll at which a task hangs, before the shortest checks in.
const INTO_POLL: u64 = 60;
/// Milliseconds to wait for one poll function before the next is tried.
const PATIENCE: u32 = 20;

/// The faults of a run, and their progress.
pub(super) struct BoardInjector {
    /// The faults that are injected as in software.
    pub(super) faults: FaultInjector,
    search: Option<TaskSearch>,
    /// When the task was made to hang, or the save was interrupted, s.
    struck_later_s: Option<f64>,
    /// A task is to hang, or a save to be interrupted: the fault strikes after its onset.
    waits: bool,
    losing: bool,
    /// A reset or a halt within the millisecond, after this part of it.
    within: Option<(Injection, f64)>,
    /// Encoder and angle sensor are silent.
    silent: [bool; 2],
    /// Source of the noise on the host's line, while it is flooded.
    flood: Option<ChaCha8Rng>,
    save: Option<Save>,
    rig: Rig,
    seed: u64,
}

impl BoardInjector {
    pub(super) fn new(faults: FaultInjector, scenario: &Scenario) -> Self {
        Self {
            faults,
            search: None,
            struck_later_s: None,
            waits: false,
            losing: false,
            within: None,
            silent: [false; 2],
            flood: None,
            save: None,
            rig: scenario.rig.clone(),
            seed: scenario.run.seed,
        }
    }

    /// A millisecond begins: switches faults on and off.
    pub(super) fn begin(
        &mut self,
        machine: &mut Machine,
        plant: &mut VirtualRig,
        t_s: f64,
    ) -> Result<(), CoreError> {
        self.faults.begin(t_s, plant.truth());
        self.faults.plant(plant);
        for (injection, on) in self.faults.changes() {
            self.change(machine, &injection, on)?;
        }
        let losing = self.faults.lost();
        if losing != std::mem::replace(&mut self.losing, losing) {
            let storm = Injection::at(Target::Interrupt, Kind::Flooding, 0.0, 0.0);
            faults::switch(machine, &storm, losing)?;
        }
        Ok(())
    }

    fn change(
        &mut self,
        machine: &mut Machine,
        injection: &Injection,
        on: bool,
    ) -> Result<(), CoreError> {
        if injection.target == Target::HostLine {
            self.flood = on.then(|| ChaCha8Rng::seed_from_u64(1));
        }
        if let Some(task) = entry(injection.target, injection.kind).and_then(|entry| entry.task) {
            self.waits = true;
            self.search = on.then(|| TaskSearch::new(machine, task, INTO_POLL));
        }
        if injection.target == Target::ParameterSave {
            self.waits = true;
            // An invalid rig was refused when the sets were stored in flash.
            let set = sets::set(sets::SAVED, &self.rig).ok().filter(|_| on);
            self.save = set.map(|set| Save::new(machine, set, cut(injection)));
        }
        if on && (injection.resets_board() || injection.kind == Kind::Halted) {
            // At a cycle that depends on the seed.
            self.within = Some((*injection, (self.seed as f64 * 0.618_034).fract()));
            return Ok(());
        }
        faults::switch(machine, injection, on)
    }

    /// Runs the board to a reset or halt, or to the poll of a task that is to hang, `until` this cycle
    /// at most.
    pub(super) fn run_to_strike(
        &mut self,
        machine: &mut Machine,
        until: u64,
    ) -> Result<(), CoreError> {
        if let Some((fault, part)) = self.within.take() {
            let now = machine.now();
            machine.run_on(now + (part * until.saturating_sub(now) as f64) as u64)?;
            faults::switch(machine, &fault, true)?;
        }
        if let Some(search) = &mut self.search
            && search.run(machine, until)?
        {
            self.search = None;
            machine.hang()?;
            self.struck_later_s = Some(machine.now() as f64 / HZ as f64);
        }
        Ok(())
    }

    /// Bytes from a host that saves parameters, if there is one.
    pub(super) fn to_board(&self) -> Option<Vec<u8>> {
        self.save.as_ref().map(|save| save.to_board.clone())
    }

    /// The board took `sent` of these bytes and answered with `received`.
    pub(super) fn exchanged(&mut self, machine: &mut Machine, received: &[u8], sent: usize) {
        let Some(save) = &mut self.save else { return };
        save.exchanged(machine, received, sent);
        if self.struck_later_s.is_none() {
            self.struck_later_s = save.cut_at(machine).map(|at| at as f64 / HZ as f64);
        }
    }

    /// State of a save of parameters, if there is one.
    pub(super) fn saving(&self) -> Option<Saving> {
        self.save.as_ref().map(|save| save.state)
    }

    /// The codes at the pins in tick `now`, from those of sound sensors.
    pub(super) fn sensors(&mut self, machine: &mut Machine, codes: Codes, now: u32) -> Codes {
        let mut frame = SensorFrame::taken(now, codes.sensors);
        frame.bridges = Some(codes.bridges);
        self.faults.sensors(&mut frame);
        let fresh = |sensor: SensorId| frame[sensor].filter(|sample| sample.at == now);
        let silent = [SensorId::WheelEncoder, SensorId::ArmAngle].map(|s| fresh(s).is_none());
        if silent != std::mem::replace(&mut self.silent, silent) {
            let chip = machine.chip_mut();
            chip.defects.encoder_lines = [silent[0]; 2];
            chip.angle.lost = silent[1];
        }
        let sensors = SensorId::ALL.map(|sensor| {
            let is_analog = SensorId::ANALOG.contains(&sensor);
            let lost = if is_analog { 0 } else { codes.sensors[sensor as usize] };
            fresh(sensor).map_or(lost, |sample| sample.code)
        });
        Codes { sensors, bridges: frame.bridges.unwrap_or_default() }
    }

    /// Noise on the host's line.
    pub(super) fn noise(&mut self) -> Option<[u8; 4]> {
        Some(self.flood.as_mut()?.random())
    }

    /// When the faults struck and acted.
    pub(super) fn times(&self) -> FaultTimes {
        let later_s = self.struck_later_s;
        match self.waits {
            true => FaultTimes { struck_s: later_s, acts_s: later_s, shows_s: later_s },
            false => self.faults.times(),
        }
    }
}

/// When a save is interrupted.
fn cut(injection: &Injection) -> Cut {
    let operation = injection.magnitude() as u64;
    match injection.kind {
        Kind::Reset => Cut::Pulled(operation),
        _ => Cut::Within(operation),
    }
}

/// The search for a task's next poll.
pub struct TaskSearch {
    task: &'static str,
    /// Cycles to be run of the poll.
    into: u64,
    /// Poll functions, of which one belongs to the task.
    places: Vec<u32>,
    tried: u32,
    /// Polls of other tasks of a pool in its place, some of which are polled twice a tick.
    others: usize,
}

impl TaskSearch {
    /// So many cycles into a poll of this task.
    pub fn new(machine: &Machine, task: &'static str, into: u64) -> Self {
        Self { task, into, places: machine.tasks.polls().to_vec(), tried: 0, others: 0 }
    }

    /// Runs to this cycle at most; returns whether the task is there.
    pub fn run(&mut self, machine: &mut Machine, until: u64) -> Result<bool, CoreError> {
        while let Some(&place) = self.places.first() {
            if !machine.run_to(place, until)? {
                self.tried += 1;
                if self.tried.is_multiple_of(PATIENCE) {
                    self.places.rotate_left(1);
                }
                return Ok(false);
            }
            if machine.task() == Some(self.task) {
                machine.run_on(machine.now() + self.into)?;
                // A poll that only restarts its timer can be over by now.
                if machine.place().contains("Executor::run") {
                    continue;
                }
                return Ok(true);
            }
            machine.run_on(machine.now() + 1)?;
            self.others += 1;
            if self.others == 4 * SensorId::ANALOG.len() {
                self.others = 0;
                self.places.remove(0);
            }
        }
        Ok(false)
    }
}
