//! The peripherals that the firmware uses, one a file, from the register descriptions
//! of the reference manual (ST, RM0440).
//!
//! A peripheral answers accesses to its registers and says by itself when something of
//! its own is due. What leads from one to another (interrupt lines, DMA requests, pins)
//! is [`super::chip`]'s.
//!
//! To add one: implement [`Peripheral`] in a file here (`read` and `write` by offset; `deadline` and
//! `advance` if something happens by itself; registers that only keep what is written go into
//! [`registers::Registers`], by the names of [`crate::description`]). Add a field in `Chip`, a line in `chip/map.rs`; its interrupt line,
//! deadline and DMA requests in `Chip::settle_lines`; its pins in `chip/pins.rs` and `chip/levels.rs`. Test it against the
//! register description; in a run `unmodelled` must stay empty.

pub mod adc;
pub mod dma;
pub mod encoder;
pub mod exti;
pub mod flash;
pub mod gpio;
pub mod iwdg;
pub mod pwm;
pub mod pwr;
pub mod rcc;
pub mod registers;
pub mod spi;
pub mod syscfg;
pub mod system;
pub mod time_base;

use serde::Serialize;

use crate::rules::Rule;

/// The core's clock, Hz.
pub const HZ: u64 = 170_000_000;

/// A write to a register: the word with the bytes in place, and which of them count.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Write {
    /// The word.
    pub value: u32,
    /// Bits that were written.
    pub mask: u32,
}

impl Write {
    /// The register afterwards.
    pub(crate) const fn onto(self, old: u32) -> u32 {
        old & !self.mask | self.value & self.mask
    }

    /// The bits written as 0.
    pub const fn zeros(self) -> u32 {
        !self.value & self.mask
    }

    /// The bits written as 1, for registers in which the others do nothing.
    pub const fn ones(self) -> u32 {
        self.value & self.mask
    }
}

/// What is wrong with an access.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, thiserror::Error)]
#[serde(rename_all = "snake_case")]
pub enum Why {
    /// No model implements the register, or this use of it.
    #[error("not modelled")]
    NoModel,
    /// The peripheral's clock is off.
    #[error("clock off")]
    NoClock,
    /// These bits, written as 1, are reserved.
    #[error("reserved bits {0:#x}")]
    Reserved(u32),
    /// The access broke a rule of the chip.
    #[error("{0}")]
    Broken(Rule),
}

/// A block of registers.
///
/// What a write may change is the chip's to know: it drops bits that are reserved or only read
/// before the model sees them.
pub trait Peripheral {
    /// Reads the word at this offset; `None` if no model has it.
    fn read(&mut self, offset: u32, now: u64) -> Option<u32>;

    /// Writes to the word at this offset, unless no model has it, or not this use of it, or that
    /// breaks a rule.
    fn write(&mut self, offset: u32, write: Write, now: u64) -> Result<(), Why>;

    /// Cycle at which something is due by itself.
    fn deadline(&self) -> u64 {
        u64::MAX
    }

    /// Does what is due.
    fn advance(&mut self, _now: u64) {}
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Writes a word that the model takes.
    pub(super) fn write(model: &mut impl Peripheral, offset: u32, value: u32, now: u64) {
        model.write(offset, Write { value, mask: u32::MAX }, now).expect("modelled");
    }
}
