//! Reset and clock control: oscillators and PLL with the times that they take to start, clock and
//! reset switches, and the cause of the last reset.
//!
//! The core runs at its full clock from the start; the clocks that the program sets up are
//! checked, see [`Rcc::broken_rule`].
//!
//! Source: RM0440, 7.2 (clocks) and 7.4 (registers); times: DS12288, clock source
//! characteristics.

use super::registers::{Kept, Registers};
use super::{HZ, Peripheral, Write};
use crate::rules::Rule;

const CR: u32 = 0x00;
/// `CFGR`, which selects the system clock.
pub(crate) const CFGR: u32 = 0x08;
const PLLCFGR: u32 = 0x0C;
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
/// Register, bit that starts a source of clock, bit that reports it ready, longest time that it
/// takes, us: HSI, HSE (typical; a crystal), PLL, LSE (typical), LSI, HSI48.
const SOURCES: [(u32, u32, u32, u64); 6] = [
    (CR, 1 << 8, 1 << 10, 2),
    (CR, 1 << 16, 1 << 17, 2_000),
    (CR, 1 << 24, 1 << 25, 40),
    (BDCR, 1, 1 << 1, 2_000_000),
    (CSR, 1, 1 << 1, 130),
    (CRRCR, 1, 1 << 1, 6),
];

/// Values of `SW` and the sources that they select: HSI, HSE, PLL.
const SELECTED: [(u32, usize); 3] = [(1, 0), (2, 1), (3, 2)];

/// Frequencies of HSI and of the board's crystal, Hz.
const OSCILLATORS: [u64; 2] = [16_000_000, 24_000_000];

/// Most MHz for 0 to 4 wait states, without and with the boost of range 1. Source: RM0440, 3.3.3.
const WAIT_STATES: [[u64; 5]; 2] = [[30, 60, 90, 120, 150], [34, 68, 102, 136, 170]];

/// Flags of ready clocks: none requests an interrupt.
const READY: [u32; 2] = [0x1C, 0x20];
/// CR, ICSCR, CFGR, PLLCFGR; the other clock enables; BDCR, CSR, CRRCR.
const REGISTERS: [Kept; 15] = [
    Kept { offset: CR, reset: 0x100, mask: 0x010D_0300 },
    kept(0x04, 0x4000_0000),
    Kept { offset: CFGR, reset: 0x1, mask: 0x7F00_3FF3 },
    kept(PLLCFGR, 0x1000),
    kept(0x48, 0x100),
    kept(0x58, 0x400),
    kept(0x68, 0x130F),
    kept(0x6C, 0x050F_667F),
    kept(0x70, 0x101),
    kept(0x78, 0xD2FE_CD3F),
    kept(0x7C, 0x103),
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
    /// Cycle at which each source is ready; never while it is off.
    ready: [u64; SOURCES.len()],
    /// `SW` of the source in use.
    used: u32,
    broken: Option<Rule>,
}

impl Rcc {
    /// After a reset; `earlier` are the flags that were not cleared.
    pub fn new(cause: Cause, earlier: u32) -> Self {
        Self {
            registers: Registers::new(&REGISTERS, &WORDS, &READY),
            flags: cause.flags() | earlier,
            ready: [0, u64::MAX, u64::MAX, u64::MAX, u64::MAX, u64::MAX],
            used: 1,
            broken: None,
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

    /// A selected clock is in use once it is ready.
    fn settle(&mut self, now: u64) {
        let selected = self.registers.get(CFGR) & 3;
        let ready = SELECTED.iter().any(|(sw, at)| *sw == selected && self.ready[*at] <= now);
        self.used = if ready { selected } else { self.used };
    }

    /// Frequency of the core, Hz, for this content of `CFGR`; none if nothing is selected.
    fn hclk(&self, cfgr: u32) -> Option<u64> {
        let sysclk = match cfgr & 3 {
            3 => {
                let pll = self.registers.get(PLLCFGR);
                let field = |lowest: u32, bits: u32| u64::from(pll >> lowest & ((1 << bits) - 1));
                let source = OSCILLATORS.get((field(0, 2) as usize).checked_sub(2)?)?;
                source / (field(4, 4) + 1) * field(8, 7) / (2 * (field(25, 2) + 1))
            }
            other => *OSCILLATORS.get((other as usize).checked_sub(1)?)?,
        };
        let halvings = match cfgr >> 4 & 0xF {
            setting @ 8..=11 => setting - 7,
            // A division by 32 is left out.
            setting @ 12..=15 => setting - 6,
            _ => 0,
        };
        Some(sysclk >> halvings)
    }

    /// The rule that this write to `CFGR` would break, with these wait states of the flash and
    /// the regulator's boost on or off.
    pub fn broken_rule(
        &mut self,
        write: Write,
        wait_states: u32,
        boosts: bool,
        now: u64,
    ) -> Option<Rule> {
        self.settle(now);
        let old = self.registers.get(CFGR);
        let (before, after) = (self.hclk(old & !3 | self.used)?, self.hclk(write.onto(old))?);
        let most = WAIT_STATES[usize::from(boosts)].get(wait_states as usize);
        if after > 150_000_000 && !boosts {
            Some(Rule::Boost)
        } else if most.is_some_and(|most| after > most * 1_000_000) {
            Some(Rule::WaitStates)
        } else if write.onto(old) & 3 == 3 && after != HZ && after != HZ / 2 {
            Some(Rule::EmulatedClock)
        } else if before < 80_000_000 && after > 80_000_000 && after != HZ / 2 {
            Some(Rule::ClockStep)
        } else {
            None
        }
    }

    /// The rule that a write of `next` over `old` at an offset would break.
    fn own_rule(&self, offset: u32, old: u32, next: u32) -> Option<Rule> {
        let off = old & !next;
        let runs = |bit: u32| self.registers.get(CR) & bit != 0;
        match offset {
            // `PLLPEN`, `PLLQEN` and `PLLREN` may be switched at any time.
            PLLCFGR if runs(1 << 24) && (old ^ next) & !(1 << 16 | 1 << 20 | 1 << 24) != 0 => {
                Some(Rule::PllOn)
            }
            CR => {
                let used = SELECTED.iter().find(|(sw, _)| *sw == self.used)?;
                let (_, on, ..) = SOURCES[used.1];
                (off & on != 0).then_some(Rule::ClockInUse)
            }
            _ => None,
        }
    }
}

impl Peripheral for Rcc {
    fn read(&mut self, offset: u32, now: u64) -> Option<u32> {
        self.settle(now);
        let value = self.registers.read(offset)?;
        let sources = SOURCES.iter().zip(self.ready);
        let ready = sources.filter(|((register, ..), at)| *register == offset && *at <= now);
        let value = ready.fold(value, |value, ((_, _, bit, _), _)| value | bit);
        Some(match offset {
            CFGR => value | self.used << 2,
            CSR => value | self.flags,
            _ => value,
        })
    }

    fn write(&mut self, offset: u32, write: Write, now: u64) -> Option<()> {
        self.settle(now);
        let mut write = write;
        if offset == CSR {
            if write.ones() >> 23 & 1 != 0 {
                self.flags = 0;
            }
            write.mask &= 1;
        }
        let old = self.registers.get(offset);
        self.broken = self.own_rule(offset, old, write.onto(old));
        if self.broken.is_some() {
            return Some(());
        }
        self.registers.write(offset, write)?;
        for ((register, on, _, us), ready) in SOURCES.iter().zip(&mut self.ready) {
            if *register == offset {
                let (was, is) = (old & on != 0, self.registers.get(offset) & on != 0);
                *ready = match (was, is) {
                    (false, true) => now + us * (HZ / 1_000_000),
                    (_, false) => u64::MAX,
                    _ => *ready,
                };
            }
        }
        self.settle(now);
        Some(())
    }

    fn take_broken_rule(&mut self) -> Option<Rule> {
        self.broken.take()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn write(rcc: &mut Rcc, offset: u32, value: u32) {
        rcc.write(offset, Write { value, mask: ALL }, 0).expect("modelled");
    }

    #[test]
    fn a_selected_clock_is_used_once_it_is_ready() {
        let mut rcc = Rcc::new(Cause::Power, 0);
        write(&mut rcc, CR, 1 << 24 | 1 << 8);
        assert_eq!(rcc.read(CR, 0), Some(1 << 24 | 1 << 10 | 1 << 8));
        write(&mut rcc, CFGR, 3);
        let locked = 40 * (HZ / 1_000_000);
        assert_eq!(rcc.read(CFGR, locked - 1), Some(1 << 2 | 3));
        assert_eq!(rcc.read(CR, locked), Some(1 << 25 | 1 << 24 | 1 << 10 | 1 << 8));
        assert_eq!(rcc.read(CFGR, locked), Some(0xF));
    }

    #[test]
    fn the_prescaler_of_the_bus_divides_by_powers_of_two_without_32() {
        let rcc = Rcc::new(Cause::Power, 0);
        for (setting, divider) in [(0, 1), (8, 2), (11, 16), (12, 64), (15, 512)] {
            assert_eq!(rcc.hclk(setting << 4 | 1), Some(16_000_000 / divider), "{setting}");
        }
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
