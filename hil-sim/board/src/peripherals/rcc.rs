//! Reset and clock control: oscillators and PLL with the times that they take to start, clock and
//! reset switches, and the cause of the last reset.
//!
//! The core runs at the clock that is in use; timers count the full one from the start. The clocks
//! that the program sets up are checked, see `Rcc::broken_rule`.
//!
//! Source: RM0440, 7.2 (clocks) and 7.4 (registers); times: DS12288, clock source
//! characteristics.

use super::registers::Registers;
use super::{HZ, Peripheral, Why, Write};
use crate::description::{Field, RCC, bits, rcc::*};
use crate::rules::Rule;

/// What starts a source of clock, what reports it ready, longest time that it takes, us; of HSE (a
/// crystal) and LSE the typical one.
const SOURCES: [(Field, Field, u64); 6] = [
    (cr::HSION, cr::HSIRDY, 2),
    (cr::HSEON, cr::HSERDY, 2_000),
    (cr::PLLON, cr::PLLRDY, 40),
    (bdcr::LSEON, bdcr::LSERDY, 2_000_000),
    (csr::LSION, csr::LSIRDY, 130),
    (crrcr::HSI48ON, crrcr::HSI48RDY, 6),
];

/// Values of `SW` and the sources that they select: HSI, HSE, PLL.
const SELECTED: [(u32, usize); 3] = [(1, 0), (2, 1), (3, 2)];

/// Frequencies of HSI and of the board's crystal, Hz.
const OSCILLATORS: [u64; 2] = [16_000_000, 24_000_000];

/// Most MHz for 0 to 4 wait states, without and with the boost of range 1. Source: RM0440, 3.3.3.
const WAIT_STATES: [[u64; 5]; 2] = [[30, 60, 90, 120, 150], [34, 68, 102, 136, 170]];

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
        let own = match self {
            Self::Power => csr::BORRSTF,
            Self::Watchdog => csr::IWDGRSTF,
            Self::Software => csr::SFTRSTF,
            Self::Pin => csr::PINRSTF,
        };
        own.mask | csr::PINRSTF.mask
    }
}

/// Reset and clock control.
#[derive(Clone, Debug)]
pub struct Rcc {
    registers: Registers,
    /// Cycle at which each source is ready; never while it is off.
    ready: [u64; SOURCES.len()],
    /// `SW` of the source in use.
    used: u32,
    /// The core's clock, Hz, while it is slower than [`HZ`].
    pub slow_hz: Option<u64>,
}

impl Rcc {
    /// After a reset; `earlier` are the flags that were not cleared.
    pub fn new(cause: Cause, earlier: u32) -> Self {
        // The flags of ready clocks request no interrupt.
        let mut registers = Registers::all(RCC, &[CIFR, CICR]);
        // By RM0440, RCC_CR; the description has bits that are no fields.
        registers.set(CR, cr::HSION.mask);
        registers.set(CFGR, cfgr::SW.at(1));
        registers.set(CSR, cause.flags() | earlier);
        let ready = [0, u64::MAX, u64::MAX, u64::MAX, u64::MAX, u64::MAX];
        Self { registers, ready, used: 1, slow_hz: Some(OSCILLATORS[0]) }
    }

    /// Flags of earlier resets that were not cleared.
    pub fn flags(&self) -> u32 {
        self.registers.get(CSR) & !csr::LSION.mask
    }

    /// Whether the clock of a peripheral is on, by its enable bit.
    pub(crate) fn is_clocked(&self, enable: Field) -> bool {
        self.registers.has(enable)
    }

    /// A selected clock is in use once it is ready.
    fn settle(&mut self, now: u64) {
        let selected = self.registers.field(cfgr::SW);
        let ready = SELECTED.iter().any(|(sw, at)| *sw == selected && self.ready[*at] <= now);
        self.used = if ready { selected } else { self.used };
        self.slow_hz = self.hclk(self.in_use()).filter(|hz| *hz < HZ);
    }

    /// `CFGR` with the source in use.
    fn in_use(&self) -> u32 {
        self.registers.get(CFGR) & !cfgr::SW.mask | cfgr::SW.at(self.used)
    }

    /// Frequency of the core, Hz, for this content of `CFGR`; none if nothing is selected.
    fn hclk(&self, cfgr: u32) -> Option<u64> {
        let sysclk = match cfgr::SW.of(cfgr) {
            3 => {
                let field = |field| u64::from(self.registers.field(field));
                let source = (field(pllcfgr::PLLSRC) as usize).checked_sub(2)?;
                let input = OSCILLATORS.get(source)? / (field(pllcfgr::PLLM) + 1);
                input * field(pllcfgr::PLLN) / (2 * (field(pllcfgr::PLLR) + 1))
            }
            other => *OSCILLATORS.get((other as usize).checked_sub(1)?)?,
        };
        let halvings = match cfgr::HPRE.of(cfgr) {
            setting @ 8..=11 => setting - 7,
            // A division by 32 is left out.
            setting @ 12..=15 => setting - 6,
            _ => 0,
        };
        Some(sysclk >> halvings)
    }

    /// The rule that this write to `CFGR` would break, with these wait states of the flash and
    /// the regulator's boost on or off.
    pub(crate) fn broken_rule(
        &mut self,
        write: Write,
        wait_states: u32,
        boosts: bool,
        now: u64,
    ) -> Option<Rule> {
        self.settle(now);
        let old = self.registers.get(CFGR);
        let (before, after) = (self.hclk(self.in_use())?, self.hclk(write.onto(old))?);
        let most = WAIT_STATES[usize::from(boosts)].get(wait_states as usize);
        if after > 150_000_000 && !boosts {
            Some(Rule::Boost)
        } else if most.is_some_and(|most| after > most * 1_000_000) {
            Some(Rule::WaitStates)
        } else if cfgr::SW.of(write.onto(old)) == 3 && after != HZ && after != HZ / 2 {
            Some(Rule::EmulatedClock)
        } else if before < 80_000_000 && after > 80_000_000 && after != HZ / 2 {
            Some(Rule::ClockStep)
        } else {
            None
        }
    }

    /// The rule that a write of `next` over `old` at an offset would break.
    fn own_rule(&self, offset: u32, old: u32, next: u32) -> Option<Rule> {
        // Outputs may be switched at any time.
        let outputs = bits(&[pllcfgr::PLLPEN, pllcfgr::PLLQEN, pllcfgr::PLLREN]);
        match offset {
            PLLCFGR if self.registers.has(cr::PLLON) && (old ^ next) & !outputs != 0 => {
                Some(Rule::PllOn)
            }
            CR => {
                let (_, used) = SELECTED.iter().find(|(sw, _)| *sw == self.used)?;
                SOURCES[*used].0.is_in(old & !next).then_some(Rule::ClockInUse)
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
        let ready = sources.filter(|((_, ready, _), at)| ready.register == offset && *at <= now);
        let value = ready.fold(value, |value, ((_, ready, _), _)| value | ready.mask);
        Some(if offset == CFGR { value | cfgr::SWS.at(self.used) } else { value })
    }

    fn write(&mut self, offset: u32, write: Write, now: u64) -> Result<(), Why> {
        self.settle(now);
        let mut write = write;
        if offset == CSR {
            if csr::RMVF.is_in(write.ones()) {
                self.registers.clear(CSR, !csr::LSION.mask);
            }
            write.mask &= csr::LSION.mask;
        }
        let old = self.registers.get(offset);
        if let Some(rule) = self.own_rule(offset, old, write.onto(old)) {
            return Err(Why::Broken(rule));
        }
        self.registers.write(offset, write)?;
        for ((on, _, us), ready) in SOURCES.iter().zip(&mut self.ready) {
            if on.register == offset {
                *ready = match (on.is_in(old), self.registers.has(*on)) {
                    (false, true) => now + us * (HZ / 1_000_000),
                    (_, false) => u64::MAX,
                    _ => *ready,
                };
            }
        }
        self.settle(now);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::peripherals::tests::write;

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
        write(&mut rcc, CSR, 1 << 23, 0);
        assert_eq!(rcc.read(CSR, 0), Some(0));
    }
}
