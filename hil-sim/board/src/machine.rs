//! The board under way: core and chip in lockstep, exceptions taken and returned from,
//! sleep passed over to the next event.

mod access;
mod exceptions;
mod frame;
mod profile;
mod tasks;

use std::path::Path;

use super::chip::Chip;
use super::core::unicorn::{Counted, UnicornCore};
use super::core::{Access, Bus, Core, CoreError, Mark, Register, Stop};
use super::elf::{FLASH, Function, Loaded, RAM, named};
use super::error::ImageError;
use super::exceptions::number::SV_CALL;
use super::peripherals::flash::Change;
use super::peripherals::rcc::Cause as Restart;
use super::peripherals::system::Cause;

pub use profile::{Poll, Profile};

use tasks::Tasks;

/// What RAM holds when power comes up.
pub const BLANK: u8 = 0xA5;
/// Why the core does not execute.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Asleep {
    /// Until an event.
    Event,
    /// Until an interrupt.
    Interrupt,
    /// For good: it has locked up.
    Locked,
}

/// A board that runs an image.
pub struct Machine {
    core: UnicornCore<Chip>,
    pc: u32,
    asleep: Option<Asleep>,
    profile: Profile,
    tasks: Tasks,
    marks: Vec<Mark>,
    functions: Vec<Function>,
    restarts: Vec<(u64, Restart)>,
    /// Symbols of the image.
    loaded: Loaded,
}

impl Machine {
    /// A board with the image at `path` in its flash, before its first instruction.
    ///
    /// # Errors
    /// [`ImageError`] if it is no image of the board.
    pub fn open(path: &Path) -> Result<Self, ImageError> {
        let bytes = std::fs::read(path)
            .map_err(|source| ImageError::Read { path: path.to_owned(), source })?;
        Self::new(&bytes)
    }

    /// The same with the image in `elf`.
    ///
    /// # Errors
    /// As [`Machine::open`].
    pub fn new(elf: &[u8]) -> Result<Self, ImageError> {
        let loaded = Loaded::of(elf)?;
        let counted = Counted { base: FLASH.base, bytes: &loaded.flash, code: &loaded.code };
        let chip = Chip::new(FLASH.base);
        let mut core = UnicornCore::with_bus(&[FLASH, RAM], &counted, chip)?;
        core.write(RAM.base, &vec![BLANK; RAM.size as usize])?;
        let mut machine = Self {
            core,
            pc: 0,
            asleep: None,
            profile: Profile::default(),
            tasks: Tasks::of(&loaded),
            marks: Vec::new(),
            functions: loaded.functions.clone(),
            restarts: Vec::new(),
            loaded,
        };
        for address in machine.tasks.marks() {
            machine.core.mark(address)?;
        }
        machine.start()?;
        Ok(machine)
    }

    /// Cycles since the start.
    #[must_use]
    pub fn now(&self) -> u64 {
        self.core.meter().cycles
    }

    /// The chip.
    #[must_use]
    pub fn chip(&self) -> &Chip {
        self.core.bus()
    }

    /// The chip, to work its pins.
    pub fn chip_mut(&mut self) -> &mut Chip {
        self.core.bus_mut()
    }

    /// Cycles asleep since the start.
    #[must_use]
    pub const fn slept(&self) -> u64 {
        self.profile.slept()
    }

    /// Runs of tasks, to take what has gathered.
    pub fn profile_mut(&mut self) -> &mut Profile {
        &mut self.profile
    }

    /// Names of the tasks, by their numbers in the profile.
    pub fn tasks(&self) -> impl Iterator<Item = &str> {
        self.tasks.names()
    }

    /// Name of the task that the executor is about to run, if it stands at that.
    #[must_use]
    pub fn task(&self) -> Option<&str> {
        let pointer = self.core.register(Register::R(0)).ok()?;
        self.tasks.names().nth(self.tasks.begins(self.pc, pointer)?)
    }

    /// Restarts so far: when, and why.
    #[must_use]
    pub fn restarts(&self) -> &[(u64, Restart)] {
        &self.restarts
    }

    /// The image.
    #[must_use]
    pub const fn image(&self) -> &Loaded {
        &self.loaded
    }

    /// Name of the function that the core is in.
    #[must_use]
    pub fn place(&self) -> &str {
        named(&self.functions, self.pc)
    }

    /// Whether the core has locked up.
    #[must_use]
    pub fn is_locked_up(&self) -> bool {
        self.asleep == Some(Asleep::Locked)
    }

    /// Catches what runs in a loop without end: it goes on at an instruction that branches
    /// to itself.
    ///
    /// # Errors
    /// [`CoreError::Engine`] if the image has no such instruction, or the engine fails.
    pub fn catch(&mut self) -> Result<(), CoreError> {
        const TO_ITSELF: [u8; 2] = [0xFE, 0xE7];
        let flash = &self.loaded.flash;
        let place = self.loaded.code.iter().find_map(|code| {
            code.clone().step_by(2).find(|at| {
                let at = (at - FLASH.base) as usize;
                flash.get(at..at + 2) == Some(&TO_ITSELF)
            })
        });
        let place = place.ok_or_else(|| CoreError::Engine {
            what: "catch the program",
            why: "the image has no loop".to_owned(),
        })?;
        self.set_register(Register::Pc, place)
    }

    /// Power lost and back, or another restart from outside.
    ///
    /// # Errors
    /// [`CoreError::Engine`] if the engine fails.
    pub fn restart(&mut self, cause: Restart) -> Result<(), CoreError> {
        let now = self.now();
        self.restarts.push((now, cause));
        if let Some(change) = self.chip_mut().reset(cause, FLASH.base, now) {
            self.take_over(change)?;
        }
        if cause == Restart::Power {
            self.core.write(RAM.base, &vec![BLANK; RAM.size as usize])?;
        }
        self.start()
    }

    /// Puts the core to its state after a reset.
    fn start(&mut self) -> Result<(), CoreError> {
        // Thread mode on the main stack, no mask, floating point without a context.
        self.core.set_register(Register::Xpsr, 1 << 24)?;
        for register in
            [Register::Control, Register::Primask, Register::Basepri, Register::Faultmask]
        {
            self.core.set_register(register, 0)?;
        }
        self.core.set_register(Register::Fpscr, 0)?;
        self.core.set_register(Register::Lr, u32::MAX)?;
        let stack = self.word(FLASH.base)?;
        self.core.set_register(Register::Sp, stack)?;
        self.pc = self.word(FLASH.base + 4)? & !1;
        self.asleep = None;
        self.profile.restart(self.core.meter().cycles);
        Ok(())
    }

    /// Sees to what is due, to sleep and to an interrupt that can be taken; whether nothing
    /// of that was to be done, so that the next instruction is the program's.
    fn executes(&mut self, cycle: u64) -> Result<bool, CoreError> {
        self.look_after()?;
        if self.asleep.is_some() {
            self.sleep(cycle);
            return Ok(false);
        }
        if let Some(number) = self.takeable()? {
            self.enter(number, self.pc, false)?;
            return Ok(false);
        }
        Ok(true)
    }

    /// Runs until this cycle, or the first block behind it. Returns early at a
    /// breakpoint instruction, with its address.
    ///
    /// # Errors
    /// [`CoreError`] if the engine fails. What a processor faults on is the program's
    /// to handle.
    pub fn run_until(&mut self, cycle: u64) -> Result<Option<u32>, CoreError> {
        while self.now() < cycle {
            if !self.executes(cycle)? {
                continue;
            }
            let stop = self.core.run(self.pc, cycle - self.now())?;
            if let Some(at) = self.follow(stop)? {
                return Ok(Some(at));
            }
        }
        Ok(None)
    }

    /// Does what follows from a stop of the core; the address if it is a breakpoint.
    fn follow(&mut self, stop: Stop) -> Result<Option<u32>, CoreError> {
        self.note_tasks();
        match stop {
            Stop::Spent(at) | Stop::Urgent(at) => self.pc = at,
            Stop::Breakpoint(at) => {
                self.pc = at;
                return Ok(Some(at));
            }
            Stop::Call(at) => {
                self.pc = at;
                let now = self.now();
                self.chip_mut().system.exceptions.pend(SV_CALL, now);
                if self.takeable()? != Some(SV_CALL) {
                    // Masked or no more urgent than what runs: not to be waited for.
                    self.chip_mut().system.exceptions.clear(SV_CALL);
                    self.fault(Cause::Program(super::core::Fault::Undefined), at)?;
                }
            }
            Stop::Return(value) => self.leave(value)?,
            Stop::Event(at) => {
                self.pc = at;
                let exceptions = &mut self.chip_mut().system.exceptions;
                if !std::mem::take(&mut exceptions.event) {
                    self.fall_asleep(Asleep::Event);
                }
            }
            Stop::Wait(at) => {
                self.pc = at;
                self.fall_asleep(Asleep::Interrupt);
            }
            Stop::Fault { at, fault } => self.fault(Cause::Program(fault), at)?,
        }
        Ok(None)
    }

    /// Carries out one instruction, or takes an exception; asleep it passes time, up to
    /// this cycle at most.
    ///
    /// Slow: code is translated anew for it.
    ///
    /// # Errors
    /// As [`Machine::run_until`].
    pub fn step(&mut self, cycle: u64) -> Result<(), CoreError> {
        while self.now() < cycle {
            self.look_after()?;
            if self.asleep.is_some() {
                self.sleep(cycle);
                continue;
            }
            if let Some(number) = self.takeable()? {
                return self.enter(number, self.pc, false);
            }
            let stop = self.core.step(self.pc)?;
            return self.follow(stop).map(|_| ());
        }
        Ok(())
    }

    /// Runs until this cycle whatever the program does at breakpoints.
    ///
    /// # Errors
    /// As [`Machine::run_until`].
    pub fn run_on(&mut self, cycle: u64) -> Result<(), CoreError> {
        while self.run_until(cycle)?.is_some() {
            // Without a debugger a breakpoint is a fault.
            self.fault(Cause::Program(super::core::Fault::Undefined), self.pc)?;
        }
        Ok(())
    }

    /// Books the tasks that have begun and ended.
    fn note_tasks(&mut self) {
        self.core.take_marks(&mut self.marks);
        for mark in self.marks.drain(..) {
            match self.tasks.begins(mark.address, mark.r0) {
                Some(task) => self.profile.begin(task, mark.cycles),
                None => self.profile.end(mark.cycles),
            }
        }
    }

    /// Runs up to this address, in any place of the code, or until the cycle. False if
    /// the program did not come there.
    ///
    /// # Errors
    /// As [`Machine::run_until`].
    pub fn run_to(&mut self, address: u32, cycle: u64) -> Result<bool, CoreError> {
        while self.now() < cycle {
            if !self.executes(cycle)? {
                continue;
            }
            let stop = self.core.run_to(self.pc, cycle - self.now(), address)?;
            if self.follow(stop)?.is_some() {
                return Ok(false);
            }
            self.pc &= !1;
            if self.pc == address {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Goes on behind the breakpoint instruction that the core stands at.
    pub fn step_over_breakpoint(&mut self) {
        self.pc += 2;
    }

    /// Everything of the chip that is due.
    fn look_after(&mut self) -> Result<(), CoreError> {
        let now = self.now();
        if self.chip().deadline() > now {
            return Ok(());
        }
        self.chip_mut().advance(now);
        while let Some(due) = self.chip().next_move() {
            let found = self.carry(due)?;
            self.chip_mut().moved(due.channel, found, now);
        }
        if let Some(place) = self.chip().flash.asks_for() {
            let mut before = [0; 8];
            self.core.read(place, &mut before)?;
            self.chip_mut().flash.found(before, now);
            self.chip_mut().advance(now);
        }
        if let Some(change) = self.chip_mut().flash.take_change() {
            self.take_over(change)?;
            self.chip_mut().advance(now);
        }
        if let Some(cause) = self.chip_mut().take_reset() {
            self.restart(cause)?;
        }
        Ok(())
    }

    /// Puts into memory what the flash was told to.
    fn take_over(&mut self, change: Change) -> Result<(), CoreError> {
        match change {
            Change::Programmed { address, bytes } => self.core.write(address, &bytes),
            Change::Erased { address, size } => {
                self.core.write(address, &vec![0xFF; size as usize])
            }
        }
    }

    /// Carries a word for DMA. False if nothing lies at an address.
    fn carry(&mut self, due: super::peripherals::dma::Move) -> Result<bool, CoreError> {
        let now = self.now();
        let (memory, bytes) = due.memory;
        let (address, size) = due.peripheral;
        let access = Access { address, size, pc: 0, now };
        let mut word = [0; 4];
        if due.from_memory {
            let found = self.core.read(memory, &mut word[..bytes as usize]).is_ok();
            if found {
                self.chip_mut().write(access, u32::from_le_bytes(word));
            }
            return Ok(found);
        }
        word = self.chip_mut().read(access).to_le_bytes();
        Ok(self.core.write(memory, &word[..bytes as usize]).is_ok())
    }

    fn fall_asleep(&mut self, how: Asleep) {
        self.asleep = Some(how);
        let now = self.now();
        self.profile.sleep(now);
    }

    /// Passes time up to the next event, `cycle` at most, and wakes if something is
    /// there to wake for.
    fn sleep(&mut self, cycle: u64) {
        let exceptions = &mut self.core.bus_mut().system.exceptions;
        let wakes = match self.asleep {
            // What would be taken if the interrupt mask were open wakes the core.
            Some(Asleep::Event) => {
                std::mem::take(&mut exceptions.event) || exceptions.urgent().is_some()
            }
            Some(Asleep::Interrupt) => exceptions.urgent().is_some(),
            Some(Asleep::Locked) => false,
            None => true,
        };
        let now = self.now();
        if wakes {
            self.asleep = None;
            self.profile.wake(now);
            return;
        }
        let next = self.chip().deadline().clamp(now, cycle);
        self.core.pass(next - now);
    }
}
