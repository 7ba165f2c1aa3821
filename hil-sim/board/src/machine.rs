//! The running board: core and chip in lockstep, entry to and return from exceptions, sleep
//! up to the next event.

mod access;
mod exceptions;
mod frame;
mod profile;
mod tasks;

use super::chip::Chip;
use super::core::unicorn::{Counted, UnicornCore};
use super::core::{Access, Bus, CoreError, Mark, Register, Stop};
use super::elf::{BELOW, FLASH, Loaded, RAM, named};
use super::error::ImageError;
use super::exceptions::number::SV_CALL;
use super::peripherals::flash::Change;
use super::peripherals::rcc::Cause as Restart;
use super::peripherals::system::Cause;

pub use profile::{Clock, Poll, Profile};

pub use tasks::Tasks;

/// Content of every byte of RAM at power-up.
pub(crate) const BLANK: u8 = 0xA5;
/// Why the core does not execute.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Asleep {
    /// Until an event.
    Event,
    /// Until an interrupt.
    Interrupt,
    /// For ever: it has locked up.
    Locked,
}

/// A board that runs an image.
pub struct Machine {
    core: UnicornCore<Chip>,
    pc: u32,
    asleep: Option<Asleep>,
    /// Polls of tasks, and sleep.
    pub profile: Profile,
    /// The tasks, by their numbers in the profile.
    pub tasks: Tasks,
    marks: Vec<Mark>,
    restarts: Vec<(u64, Restart)>,
    /// Cycle up to which a debugger halts the core.
    halted: Option<u64>,
    /// The image that it runs.
    pub image: Loaded,
}

impl Machine {
    /// A board with the image in `elf`, before its first instruction.
    pub fn new(elf: &[u8]) -> Result<Self, ImageError> {
        let loaded = Loaded::of(elf)?;
        let counted = Counted { base: FLASH.base, bytes: &loaded.flash, code: &loaded.code };
        let chip = Chip::new(FLASH.base);
        let mut core = UnicornCore::new(&[FLASH, BELOW, RAM], &counted, chip)?;
        core.write(RAM.base, &vec![BLANK; RAM.size as usize])?;
        let mut machine = Self {
            core,
            pc: 0,
            asleep: None,
            profile: Profile::default(),
            tasks: Tasks::of(&loaded),
            marks: Vec::new(),
            restarts: Vec::new(),
            halted: None,
            image: loaded,
        };
        for address in machine.tasks.marks() {
            machine.core.mark(address);
        }
        machine.start()?;
        Ok(machine)
    }

    /// Cycles since the start.
    pub fn now(&self) -> u64 {
        self.core.meter().cycles
    }

    /// Counts what the flash's wait states cost from now on, see [`crate::accelerator`].
    pub(crate) fn count_waits(&mut self) -> Result<(), CoreError> {
        self.core.count_waits(FLASH)
    }

    /// Cycles that the flash would have cost since then.
    pub fn waits(&self) -> u64 {
        self.core.waits()
    }

    /// Cycles so far, and what the flash would have cost.
    fn clock(&self) -> Clock {
        Clock { cycles: self.now(), waits: self.waits() }
    }

    pub fn chip(&self) -> &Chip {
        self.core.bus()
    }

    /// The chip, to change its pins.
    pub fn chip_mut(&mut self) -> &mut Chip {
        self.core.bus_mut()
    }

    /// Name of the task that the executor is about to poll.
    pub fn task(&self) -> Option<&str> {
        let pointer = self.core.register(Register::R(0)).ok()?;
        self.tasks.names().nth(self.tasks.begins(self.pc, pointer)?)
    }

    /// Cycle and cause of each restart so far.
    pub fn restarts(&self) -> &[(u64, Restart)] {
        &self.restarts
    }

    /// Name of the function that the core is in.
    pub fn place(&self) -> &str {
        named(&self.image.functions, self.pc)
    }

    /// Makes the running code hang: it continues at an instruction that branches to itself.
    pub fn hang(&mut self) -> Result<(), CoreError> {
        const TO_ITSELF: [u8; 2] = [0xFE, 0xE7];
        let flash = &self.image.flash;
        let place = self.image.code.iter().find_map(|code| {
            code.clone().step_by(2).find(|at| {
                let at = (at - FLASH.base) as usize;
                flash.get(at..at + 2) == Some(&TO_ITSELF)
            })
        });
        self.set_register(Register::Pc, place.ok_or(CoreError::NoLoop)?)
    }

    /// Resets the board; [`Restart::Power`] also clears RAM.
    pub fn restart(&mut self, cause: Restart) -> Result<(), CoreError> {
        let now = self.now();
        self.restarts.push((now, cause));
        if let Some(change) = self.chip_mut().reset(cause, FLASH.base, now) {
            self.apply(change)?;
        }
        if cause == Restart::Power {
            self.core.write(RAM.base, &vec![BLANK; RAM.size as usize])?;
        }
        self.start()
    }

    /// Sets the core to its state after a reset.
    fn start(&mut self) -> Result<(), CoreError> {
        self.core.set_guards(Vec::new())?;
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
        self.halted = None;
        self.profile.restart(self.clock());
        Ok(())
    }

    /// Handles what is due, sleep and an exception that can be taken; true if there was
    /// nothing of these and the program executes next.
    fn executes(&mut self, cycle: u64) -> Result<bool, CoreError> {
        self.advance_chip()?;
        if self.stays_halted(cycle) {
            return Ok(false);
        }
        if self.asleep.is_some() {
            self.sleep(cycle);
            return Ok(false);
        }
        if let Some(number) = self.takeable() {
            self.enter(number, self.pc, false)?;
            return Ok(false);
        }
        Ok(true)
    }

    /// Runs until this cycle, or the first block after it. Returns early at a breakpoint
    /// instruction, with its address.
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

    /// Handles a stop of the core; returns the address of a breakpoint.
    fn follow(&mut self, stop: Stop) -> Result<Option<u32>, CoreError> {
        self.note_tasks();
        match stop {
            Stop::Spent(at) => self.pc = at,
            Stop::Breakpoint(at) => {
                self.pc = at;
                return Ok(Some(at));
            }
            Stop::Call(at) => {
                self.pc = at;
                self.chip_mut().system.exceptions.pend(SV_CALL);
                if self.takeable() != Some(SV_CALL) {
                    // Masked, or no more urgent than the running exception: a fault.
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

    /// Runs until this cycle; a breakpoint instruction is a fault, as without a debugger.
    pub fn run_on(&mut self, cycle: u64) -> Result<(), CoreError> {
        while self.run_until(cycle)?.is_some() {
            self.fault(Cause::Program(super::core::Fault::Undefined), self.pc)?;
        }
        Ok(())
    }

    /// A debugger halts the core for so many cycles from now on; the chip goes on but for what
    /// it freezes. A reset ends it.
    pub fn halt(&mut self, cycles: u64) {
        let now = self.now();
        self.halted = Some(now + cycles);
        self.chip_mut().halt(cycles, now);
    }

    /// Passes time while a debugger halts the core, up to this cycle at most; false if none does.
    fn stays_halted(&mut self, cycle: u64) -> bool {
        let Some(end) = self.halted else { return false };
        let now = self.now();
        if now < end {
            let next = self.chip().deadline().min(end).min(cycle).max(now + 1);
            self.core.pass(next - now);
            return true;
        }
        self.halted = None;
        self.chip_mut().resume(now);
        false
    }

    /// Books the polls that have begun and ended.
    fn note_tasks(&mut self) {
        self.core.take_marks(&mut self.marks);
        for mark in self.marks.drain(..) {
            let at = Clock { cycles: mark.cycles, waits: mark.waits };
            match self.tasks.begins(mark.address, mark.r0) {
                Some(task) => self.profile.begin(task, at),
                None => self.profile.end(at),
            }
        }
    }

    /// Runs to this address, anywhere in the code, or to the cycle; true if it got to the
    /// address.
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

    /// Does everything of the chip that is due.
    fn advance_chip(&mut self) -> Result<(), CoreError> {
        let now = self.now();
        if self.chip().deadline() > now {
            return Ok(());
        }
        if let Some(guards) = self.chip_mut().system.mpu.take_change() {
            self.core.set_guards(guards)?;
        }
        self.chip_mut().advance(now);
        while let Some(due) = self.chip().next_move() {
            let found = self.carry(due)?;
            self.chip_mut().moved(due.channel, found);
        }
        if let Some(place) = self.chip().flash.needs() {
            let mut before = [0; 8];
            self.core.read(place, &mut before)?;
            self.chip_mut().flash.found(before, now);
            self.chip_mut().advance(now);
        }
        if let Some(change) = self.chip_mut().flash.take_change() {
            self.apply(change)?;
            self.chip_mut().advance(now);
        }
        if let Some(cause) = self.chip_mut().reset.take() {
            self.restart(cause)?;
        }
        Ok(())
    }

    /// Applies a change by the flash's interface to the memory.
    fn apply(&mut self, change: Change) -> Result<(), CoreError> {
        match change {
            Change::Programmed { address, bytes } => self.core.write(address, &bytes)?,
            Change::Erased { address, size } => {
                self.core.write(address, &vec![0xFF; size as usize])?;
            }
        }
        self.core.set_spoilt(self.core.bus().flash.spoilt())
    }

    /// Moves a word for DMA; false if an address holds nothing.
    fn carry(&mut self, due: super::peripherals::dma::Move) -> Result<bool, CoreError> {
        let now = self.now();
        let (memory, bytes) = due.memory;
        let (address, size) = due.peripheral;
        let access = Access { address, size, pc: 0, now };
        let word = self.chip_mut().read(access).to_le_bytes();
        Ok(self.core.write(memory, &word[..bytes as usize]).is_ok())
    }

    fn fall_asleep(&mut self, how: Asleep) {
        self.asleep = Some(how);
        let now = self.clock();
        self.profile.sleep(now);
    }

    /// Wakes, or passes time up to the next event, `cycle` at most.
    fn sleep(&mut self, cycle: u64) {
        let exceptions = &mut self.core.bus_mut().system.exceptions;
        let wakes = match self.asleep {
            // An exception wakes the core even if PRIMASK masks it.
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
            self.profile.wake(self.clock());
            return;
        }
        let next = self.chip().deadline().clamp(now, cycle);
        self.core.pass(next - now);
    }
}
