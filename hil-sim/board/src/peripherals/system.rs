//! The core's own registers: interrupt controller, system control, system timer, cycle
//! counter.
//!
//! Source: ARMv7-M Architecture Reference Manual, B3 and C1.

mod control;
mod mpu;
mod tick;

use super::{Peripheral, Why, Write};
use crate::exceptions::Exceptions;
use crate::exceptions::number::{INTERRUPT, SYS_TICK};

pub use control::{Cause, Control};
pub use mpu::Mpu;
pub use tick::{Counter, SysTick};

/// The system control space from 0xE000_E000 on.
#[derive(Clone, Debug)]
pub struct System {
    pub exceptions: Exceptions,
    /// System control block.
    pub control: Control,
    /// System timer.
    pub tick: SysTick,
    /// Memory protection unit.
    pub mpu: Mpu,
}

impl System {
    /// After reset, with the vectors at `vectors`.
    pub fn new(vectors: u32) -> Self {
        Self {
            exceptions: Exceptions::default(),
            control: Control::new(vectors),
            tick: SysTick::default(),
            mpu: Mpu::default(),
        }
    }

    /// Notes a fault, see [`Control::fault`].
    pub fn fault(&mut self, cause: Cause, masked: bool) -> Option<u8> {
        self.control.fault(cause, &self.exceptions, masked)
    }

    /// Priorities of four exceptions from `first` on, as a word.
    fn priorities(&self, first: u32) -> u32 {
        (0..4).fold(0, |word, byte| {
            let number = (first + byte).min(127) as u8;
            word | u32::from(self.exceptions.priority_set(number)) << (8 * byte)
        })
    }

    fn set_priorities(&mut self, first: u32, write: Write) {
        for byte in 0..4 {
            if write.mask >> (8 * byte) & 0xFF != 0 {
                let number = (first + byte).min(127) as u8;
                self.exceptions.set_priority(number, (write.value >> (8 * byte)) as u8);
            }
        }
    }

    /// Changes each interrupt whose bit is set in a word of the registers.
    fn each(&mut self, word: u32, set: u32, change: impl Fn(&mut Exceptions, u8)) {
        for bit in (0..32).filter(|bit| set >> bit & 1 != 0) {
            change(&mut self.exceptions, INTERRUPT + (32 * word + bit) as u8);
        }
    }
}

impl Peripheral for System {
    fn read(&mut self, offset: u32, now: u64) -> Option<u32> {
        let word = (offset & 0x7F) / 4;
        Some(match offset {
            // Four words of interrupts.
            0x004 => 3,
            0x008 => 0,
            0x010..=0x01C => self.tick.read(offset, now)?,
            0x100..=0x10C | 0x180..=0x18C => self.exceptions.enabled(word & 3),
            0x200..=0x20C | 0x280..=0x28C => self.exceptions.pending(word & 3),
            0x300..=0x30C => self.exceptions.active(word & 3),
            0x400..=0x464 => self.priorities(u32::from(INTERRUPT) + offset - 0x400),
            0xD18..=0xD20 => self.priorities(4 + offset - 0xD18),
            0xD90..=0xDA0 => self.mpu.read(offset)?,
            _ => self.control.read(offset, &self.exceptions)?,
        })
    }

    fn write(&mut self, offset: u32, write: Write, now: u64) -> Result<(), Why> {
        let (word, ones) = ((offset & 0x7F) / 4, write.ones());
        match offset {
            0x010..=0x01C => self.tick.write(offset, write, now)?,
            0x100..=0x10C => self.exceptions.enable(word & 3, ones, true),
            0x180..=0x18C => self.exceptions.enable(word & 3, ones, false),
            0x200..=0x20C => self.each(word & 3, ones, Exceptions::pend),
            0x280..=0x28C => self.each(word & 3, ones, Exceptions::clear),
            0x400..=0x464 => self.set_priorities(u32::from(INTERRUPT) + offset - 0x400, write),
            0xD18..=0xD20 => self.set_priorities(4 + offset - 0xD18, write),
            0xD90..=0xDA0 => self.mpu.write(offset, write)?,
            // Software trigger: the number of an interrupt.
            0xF00 => self.exceptions.pend(INTERRUPT.saturating_add((ones & 0x1FF) as u8)),
            _ => self.control.write(offset, write, &mut self.exceptions)?,
        }
        Ok(())
    }

    fn deadline(&self) -> u64 {
        // A change of the protection acts before the next block.
        if self.mpu.has_changed() { 0 } else { self.tick.deadline() }
    }

    fn advance(&mut self, now: u64) {
        if self.tick.advance(now) {
            self.exceptions.pend(SYS_TICK);
        }
    }
}
