//! Entry to and return from exceptions.

use super::{Asleep, Machine, frame};
use crate::core::{CoreError, Register};
use crate::exceptions::number::HARD_FAULT;
use crate::peripherals::system::Cause;

/// Cycles of an exception's entry and return, and of tail-chaining.
const ENTRY: u64 = 12;
const EXIT: u64 = 10;
const CHAIN: u64 = 6;

impl Machine {
    /// The exception to be taken now.
    pub(super) fn takeable(&self) -> Option<u8> {
        let (number, priority) = self.chip().system.exceptions.urgent()?;
        self.core.unmasked(priority).then_some(number)
    }

    /// Takes an exception that returns to `back`. `chained`: directly after another one, with
    /// its frame.
    pub(super) fn enter(&mut self, number: u8, back: u32, chained: bool) -> Result<(), CoreError> {
        if chained {
            frame::change_handler(&mut self.core, number)?;
            return self.start_handler(number, CHAIN);
        }
        let (base, bytes) = frame::next(&self.core)?;
        if self.core.is_guarded(base, bytes) {
            self.core.set_register(Register::Sp, base)?;
            return self.stacking_failed(number, back, Cause::GuardedStacking);
        }
        if !frame::push(&mut self.core, back)? {
            return self.stacking_failed(number, back, Cause::Stacking);
        }
        let depth = self.chip().system.exceptions.depth();
        frame::go_to_handler(&mut self.core, number, depth > 0)?;
        self.start_handler(number, ENTRY)
    }

    /// Continues with the handler of an exception after so many cycles.
    fn start_handler(&mut self, number: u8, cycles: u64) -> Result<(), CoreError> {
        let now = self.clock();
        self.core.pass(cycles);
        self.chip_mut().system.exceptions.enter(number);
        self.profile.enter(now);
        let vector = self.chip().system.control.vector(number);
        self.pc = self.word(vector)? & !1;
        Ok(())
    }

    /// Returns from the exception that runs.
    pub(super) fn leave(&mut self, value: u32) -> Result<(), CoreError> {
        let left = self.chip_mut().system.exceptions.leave();
        self.profile.leave(self.clock());
        if left == HARD_FAULT {
            self.core.set_register(Register::Faultmask, 0)?;
        }
        if let Some(next) = self.takeable() {
            // The frame stays on the stack.
            self.core.set_register(Register::Lr, value)?;
            return self.enter(next, 0, true);
        }
        self.core.pass(EXIT);
        let depth = self.chip().system.exceptions.depth();
        match frame::pop(&mut self.core, value)? {
            Some(pc) => self.pc = pc,
            None => return self.fault(Cause::Unstacking, value),
        }
        if depth == 0 && self.chip().system.control.sleeps_on_exit() {
            self.fall_asleep(Asleep::Interrupt);
        }
        Ok(())
    }

    /// The program caused a fault at `at`.
    pub(super) fn fault(&mut self, cause: Cause, at: u32) -> Result<(), CoreError> {
        let masked = self.core.register(Register::Primask)? & 1 != 0;
        match self.chip_mut().system.fault(cause, masked) {
            Some(number) => {
                self.chip_mut().system.exceptions.pend(number);
                self.enter(number, at, false)
            }
            None => {
                self.pc = at;
                self.lock_up();
                Ok(())
            }
        }
    }

    /// There is no memory for the frame of exception `number`.
    fn stacking_failed(&mut self, number: u8, back: u32, cause: Cause) -> Result<(), CoreError> {
        let fault = self.chip_mut().system.fault(cause, true);
        if number == HARD_FAULT || fault.is_none() {
            self.pc = back;
            self.lock_up();
            return Ok(());
        }
        // The hard fault is taken without a frame: it does not return.
        let depth = self.chip().system.exceptions.depth();
        frame::go_to_handler(&mut self.core, HARD_FAULT, depth > 0)?;
        self.start_handler(HARD_FAULT, ENTRY)
    }

    pub(super) fn lock_up(&mut self) {
        let now = self.now();
        self.chip_mut().lock_up(now);
        self.fall_asleep(Asleep::Locked);
    }
}
