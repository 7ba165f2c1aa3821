//! The system control block: vectors, faults and their status, reset by software.

use super::{Why, Write};
use crate::core::Fault;
use crate::exceptions::Exceptions;
use crate::exceptions::number::{
    BUS_FAULT, HARD_FAULT, MEM_MANAGE, PEND_SV, SYS_TICK, USAGE_FAULT,
};
use crate::peripherals::registers::Registers;

const CPUID: u32 = 0xD00;
const ICSR: u32 = 0xD04;
const VTOR: u32 = 0xD08;
const AIRCR: u32 = 0xD0C;
const SCR: u32 = 0xD10;
const CCR: u32 = 0xD14;
const SHCSR: u32 = 0xD24;
const CFSR: u32 = 0xD28;
const HFSR: u32 = 0xD2C;
const DFSR: u32 = 0xD30;
const MMFAR: u32 = 0xD34;
const BFAR: u32 = 0xD38;
const AFSR: u32 = 0xD3C;
const CPACR: u32 = 0xD88;
const DEMCR: u32 = 0xDFC;
const FPCCR: u32 = 0xF34;
const FPDSCR: u32 = 0xF3C;

/// A fault with the bit of the status register that names it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    /// What the core met in the program.
    Program(Fault),
    /// Stacking at the entry of an exception.
    Stacking,
    /// The same where the memory protection unit allows no access.
    GuardedStacking,
    /// Unstacking at its return.
    Unstacking,
}

impl Cause {
    const fn status(self) -> u32 {
        match self {
            // UNDEFINSTR, IBUSERR, PRECISERR.
            Self::Program(Fault::Undefined) => 1 << 16,
            Self::Program(Fault::Fetch) => 1 << 8,
            Self::Program(Fault::Read | Fault::Write | Fault::Other) => 1 << 9,
            // DACCVIOL, MSTKERR.
            Self::Program(Fault::Guarded) => 1 << 1,
            Self::GuardedStacking => 1 << 4,
            // STKERR, UNSTKERR.
            Self::Stacking => 1 << 12,
            Self::Unstacking => 1 << 11,
        }
    }
}

/// Registers that keep what is written: values after reset, and bits that can be changed. The
/// engine does not report the address of a fault. The status of debug events is cleared by a probe
/// whenever it asks for the core's status (probe-rs 0.32, armv7m.rs).
const REGISTERS: [(u32, u32, u32); 13] = [
    (CPUID, 0x410F_C241, 0),
    (VTOR, 0, !0x7F),
    (SCR, 0, 0x16),
    (CCR, 0x200, u32::MAX),
    (SHCSR, 0, 0x7 << 16),
    (DFSR, 0, 0),
    (MMFAR, 0, 0),
    (BFAR, 0, 0),
    (AFSR, 0, 0),
    (CPACR, 0, u32::MAX),
    (DEMCR, 0, u32::MAX),
    (FPCCR, 0xC000_0000, u32::MAX),
    (FPDSCR, 0, u32::MAX),
];

/// The system control block.
#[derive(Clone, Debug)]
pub struct Control {
    registers: Registers,
    /// Status of configurable faults and of the hard fault.
    faults: u32,
    hard: u32,
    /// The program requests a reset.
    pub wants_reset: bool,
}

impl Control {
    pub(super) fn new(vectors: u32) -> Self {
        let mut registers = Registers::default();
        for (offset, reset, mask) in REGISTERS {
            registers.add(offset, reset, mask);
        }
        registers.set(VTOR, vectors);
        Self { registers, faults: 0, hard: 0, wants_reset: false }
    }

    /// Address of an exception's vector.
    pub fn vector(&self, number: u8) -> u32 {
        self.registers.get(VTOR) + 4 * u32::from(number)
    }

    /// `SLEEPONEXIT`: back in thread mode the core sleeps.
    pub(crate) fn sleeps_on_exit(&self) -> bool {
        self.registers.get(SCR) & 2 != 0
    }

    /// Notes a fault and returns its exception: its own if that is enabled and preempts the
    /// running one, else the hard fault. `None` if the hard fault is active: the core locks up.
    pub fn fault(&mut self, cause: Cause, exceptions: &Exceptions, masked: bool) -> Option<u8> {
        self.faults |= cause.status();
        let (own, enable) = match cause {
            Cause::Program(Fault::Undefined) => (USAGE_FAULT, 1 << 18),
            Cause::Program(Fault::Guarded) | Cause::GuardedStacking => (MEM_MANAGE, 1 << 16),
            _ => (BUS_FAULT, 1 << 17),
        };
        let priority = i16::from(exceptions.priority_set(own));
        if self.registers.get(SHCSR) & enable != 0 && !masked && priority < exceptions.level() {
            return Some(own);
        }
        if exceptions.level() <= -1 {
            return None;
        }
        // FORCED.
        self.hard |= 1 << 30;
        Some(HARD_FAULT)
    }

    pub(super) fn read(&self, offset: u32, exceptions: &Exceptions) -> Option<u32> {
        Some(match offset {
            ICSR => {
                let next = exceptions.urgent().map_or(0, |(number, _)| u32::from(number));
                let pending = (0..4).any(|word| exceptions.pending(word) != 0);
                u32::from(exceptions.running())
                    | u32::from(exceptions.depth() <= 1) << 11
                    | next << 12
                    | u32::from(pending) << 22
                    | u32::from(exceptions.is_pending(SYS_TICK)) << 26
                    | u32::from(exceptions.is_pending(PEND_SV)) << 28
            }
            AIRCR => 0xFA05_0000 | u32::from(exceptions.group()) << 8,
            CFSR => self.faults,
            HFSR => self.hard,
            _ => self.registers.read(offset)?,
        })
    }

    pub(super) fn write(
        &mut self,
        offset: u32,
        write: Write,
        exceptions: &mut Exceptions,
    ) -> Result<(), Why> {
        match offset {
            ICSR => {
                for (bit, number) in [(28, PEND_SV), (26, SYS_TICK)] {
                    if write.ones() >> bit & 1 != 0 {
                        exceptions.pend(number);
                    } else if write.ones() >> (bit - 1) & 1 != 0 {
                        exceptions.clear(number);
                    }
                }
            }
            AIRCR => {
                if write.value >> 16 == 0x05FA {
                    exceptions.set_group((write.value >> 8 & 7) as u8);
                    self.wants_reset |= write.value & 4 != 0;
                }
            }
            CFSR => self.faults &= !write.ones(),
            HFSR => self.hard &= !write.ones(),
            DFSR => {}
            CPUID | MMFAR | BFAR | AFSR => return Err(Why::NoModel),
            _ => self.registers.write(offset, write)?,
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exceptions::number::INTERRUPT;

    const UNDEFINED: Cause = Cause::Program(Fault::Undefined);

    fn write(control: &mut Control, exceptions: &mut Exceptions, offset: u32, value: u32) {
        let all = Write { value, mask: u32::MAX };
        control.write(offset, all, exceptions).expect("modelled");
    }

    #[test]
    fn a_fault_takes_its_handler_or_the_hard_fault_or_locks_up() {
        let (mut control, mut exceptions) = (Control::new(0), Exceptions::default());
        assert_eq!(control.fault(UNDEFINED, &exceptions, false), Some(HARD_FAULT));
        assert_eq!((control.faults, control.hard), (1 << 16, 1 << 30));
        write(&mut control, &mut exceptions, SHCSR, 7 << 16);
        assert_eq!(control.fault(UNDEFINED, &exceptions, false), Some(USAGE_FAULT));
        assert_eq!(control.fault(UNDEFINED, &exceptions, true), Some(HARD_FAULT));
        // An equally urgent one runs.
        exceptions.enter(INTERRUPT);
        assert_eq!(control.fault(UNDEFINED, &exceptions, false), Some(HARD_FAULT));
        exceptions.enter(HARD_FAULT);
        assert_eq!(control.fault(UNDEFINED, &exceptions, false), None);
    }

    #[test]
    fn a_reset_takes_the_key() {
        let (mut control, mut exceptions) = (Control::new(0), Exceptions::default());
        write(&mut control, &mut exceptions, AIRCR, 4);
        assert!(!control.wants_reset);
        write(&mut control, &mut exceptions, AIRCR, 0x05FA_0004);
        assert!(control.wants_reset);
    }
}
