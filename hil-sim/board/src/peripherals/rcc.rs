//! Reset and clock control: oscillators that are ready at once, clock and reset switches, and
//! the cause of the last reset. The core runs at its full clock from the start.

use super::registers::{Kept, Registers};
use super::{Peripheral, Write};

const CR: u32 = 0x00;
const CFGR: u32 = 0x08;
const BDCR: u32 = 0x90;
const CSR: u32 = 0x94;
const CRRCR: u32 = 0x98;

const ALL: u32 = u32::MAX;

const fn kept(offset: u32, reset: u32) -> Kept {
    Kept { offset, reset, mask: ALL }
}

/// CIER; resets of the buses; clock enables that are zero after reset; CCIPR, CCIPR2.
const WORDS: [u32; 13] =
    [0x18, 0x28, 0x2C, 0x30, 0x38, 0x3C, 0x40, 0x4C, 0x50, 0x5C, 0x60, 0x88, 0x9C];
/// Flags of ready clocks: none requests an interrupt.
const READY: [u32; 2] = [0x1C, 0x20];
/// CR, ICSCR, CFGR, PLLCFGR; the other clock enables; BDCR, CSR, CRRCR.
const REGISTERS: [Kept; 15] = [
    Kept { offset: CR, reset: 0x500, mask: 0x010D_0500 },
    kept(0x04, 0x4000_0000),
    Kept { offset: CFGR, reset: 0x5, mask: 0x7F00_3FF3 },
    kept(0x0C, 0x1000),
    kept(0x48, 0x100),
    kept(0x58, 0x400),
    kept(0x68, 0x130F),
    kept(0x6C, 0x0505_677F),
    kept(0x70, 0x111),
    kept(0x78, 0xD2FE_CD3F),
    kept(0x7C, 0x105),
    kept(0x80, 0x0437_F801),
    Kept { offset: BDCR, reset: 0, mask: 0x0301_837D },
    Kept { offset: CSR, reset: 0, mask: 1 },
    Kept { offset: CRRCR, reset: 0, mask: 1 },
];

/// Why the chip started, as flags of `CSR`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    /// Power-up, or a supply that was too low.
    Power,
    /// The independent watchdog.
    Watchdog,
    /// The program or a debugger requested it.
    Software,
    /// The reset pin was pulled from outside.
    Pin,
}

impl Cause {
    const fn flags(self) -> u32 {
        // A reset of the chip's own also pulls the reset pin.
        match self {
            Self::Power => 1 << 27 | 1 << 26,
            Self::Watchdog => 1 << 29 | 1 << 26,
            Self::Software => 1 << 28 | 1 << 26,
            Self::Pin => 1 << 26,
        }
    }
}

/// Reset and clock control.
#[derive(Clone, Debug)]
pub struct Rcc {
    registers: Registers,
    flags: u32,
}

impl Rcc {
    /// After a reset; `earlier` are the flags that were not cleared.
    pub fn new(cause: Cause, earlier: u32) -> Self {
        Self {
            registers: Registers::new(&REGISTERS, &WORDS, &READY),
            flags: cause.flags() | earlier,
        }
    }

    /// Flags of earlier resets that were not cleared.
    pub const fn flags(&self) -> u32 {
        self.flags
    }

    /// Whether the clock of a peripheral is on: bit of the enable register at `offset`.
    pub fn is_clocked(&self, offset: u32, bit: u32) -> bool {
        self.registers.get(offset) >> bit & 1 != 0
    }
}

impl Peripheral for Rcc {
    fn read(&mut self, offset: u32, _: u64) -> Option<u32> {
        let value = self.registers.read(offset)?;
        Some(match offset {
            // HSI, HSE and PLL are ready when they are on.
            CR => value | (value & 0x0101_0100 & !0x100) << 1 | (value & 0x100) << 2,
            // A selected clock is in use at once.
            CFGR => value | (value & 3) << 2,
            BDCR | CRRCR => value | (value & 1) << 1,
            CSR => value | (value & 1) << 1 | self.flags,
            _ => value,
        })
    }

    fn write(&mut self, offset: u32, write: Write, _: u64) -> Option<()> {
        self.registers.write(offset, write)?;
        if offset == CSR && write.ones() >> 23 & 1 != 0 {
            self.flags = 0;
        }
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn write(rcc: &mut Rcc, offset: u32, value: u32) {
        rcc.write(offset, Write { value, mask: ALL }, 0).expect("modelled");
    }

    #[test]
    fn what_is_switched_on_is_ready() {
        let mut rcc = Rcc::new(Cause::Power, 0);
        write(&mut rcc, CR, 1 << 24 | 1 << 16 | 1 << 8);
        assert_eq!(rcc.read(CR, 0), Some(1 << 25 | 1 << 24 | 1 << 17 | 1 << 16 | 1 << 10 | 1 << 8));
        write(&mut rcc, CFGR, 3);
        assert_eq!(rcc.read(CFGR, 0), Some(0xF));
    }

    #[test]
    fn causes_of_resets_gather_until_they_are_cleared() {
        let power = Rcc::new(Cause::Power, 0);
        let mut rcc = Rcc::new(Cause::Watchdog, power.flags());
        assert_eq!(rcc.read(CSR, 0), Some(1 << 29 | 1 << 27 | 1 << 26));
        write(&mut rcc, CSR, 1 << 23);
        assert_eq!(rcc.read(CSR, 0), Some(0));
    }
}
