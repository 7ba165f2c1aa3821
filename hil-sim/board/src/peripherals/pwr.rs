//! Power control: the core's voltage settles at once; and the supply, which can fall, with
//! its voltage detector.
//!
//! The detector has no delay. A low supply is below every threshold that can be set; the
//! chip runs until the supply is lost.
//!
//! Source: RM0440, 6.2.2 (programmable voltage detector) and 6.4 (registers).

use super::registers::{Kept, Registers};
use super::{HZ, Peripheral, Write};

/// `CR2`, with the detector's settings.
pub(crate) const CR2: u32 = 0x04;
const SR2: u32 = 0x14;
/// `CR5`.
pub(crate) const CR5: u32 = 0x80;
/// Of CR5: without the boost of range 1.
pub(crate) const R1MODE: u32 = 1 << 8;

/// Of CR2: the detector is on.
const DETECTS: u32 = 1;
/// Of SR2: the supply is below the threshold.
const IS_LOW: u32 = 1 << 11;

/// Least core cycles for which the board's capacitors supply the chip between the detector's
/// threshold and the reset: a requirement of the wiring.
pub const HOLDS: u64 = HZ / 1000;

/// CR1 to CR4, CR5 (with the boost of the main regulator), and the status registers,
/// which report no change in progress. Pull-ups in standby are not used.
const REGISTERS: [Kept; 5] = [
    Kept { offset: 0x00, reset: 0x200, mask: 0x470F },
    Kept { offset: CR2, reset: 0, mask: 0xFFFF },
    Kept { offset: 0x08, reset: 0x8000, mask: 0xFFFF },
    Kept { offset: 0x0C, reset: 0, mask: 0xFFFF },
    Kept { offset: CR5, reset: R1MODE, mask: R1MODE },
];

/// What follows when the supply has been below the threshold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Then {
    /// Power is lost.
    Gone,
    /// It comes back.
    Back,
}

/// Power control.
#[derive(Clone, Debug)]
pub struct Pwr {
    registers: Registers,
    /// The supply is low until this cycle, and what follows.
    low: Option<(u64, Then)>,
}

impl Default for Pwr {
    fn default() -> Self {
        Self { registers: Registers::new(&REGISTERS, &[], &[0x10, SR2]), low: None }
    }
}

impl Pwr {
    /// The supply is below the threshold until this cycle.
    pub const fn fall(&mut self, until: u64, then: Then) {
        self.low = Some((until, then));
    }

    /// Output of the detector: it is on and the supply is low.
    pub fn signals_low(&self) -> bool {
        self.low.is_some() && self.registers.get(CR2) & DETECTS != 0
    }

    /// Whether power is lost.
    pub fn is_gone(&self, now: u64) -> bool {
        self.low.is_some_and(|(until, then)| until <= now && then == Then::Gone)
    }

    /// State after a reset of the chip; a lost supply is back.
    pub fn after_reset(&self, now: u64) -> Self {
        let low = self.low.filter(|_| !self.is_gone(now));
        Self { low, ..Self::default() }
    }
}

impl Peripheral for Pwr {
    fn read(&mut self, offset: u32, _: u64) -> Option<u32> {
        let kept = self.registers.read(offset)?;
        Some(if offset == SR2 && self.signals_low() { kept | IS_LOW } else { kept })
    }

    fn write(&mut self, offset: u32, write: Write, _: u64) -> Option<()> {
        self.registers.write(offset, write)
    }

    fn deadline(&self) -> u64 {
        self.low.map_or(u64::MAX, |(until, _)| until)
    }

    fn advance(&mut self, now: u64) {
        if self.low.is_some_and(|(until, then)| until <= now && then == Then::Back) {
            self.low = None;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_low_supply_is_reported_while_the_detector_is_on() {
        let mut power = Pwr::default();
        power.fall(100, Then::Back);
        assert_eq!(power.read(SR2, 0), Some(0));
        power.write(CR2, Write { value: DETECTS, mask: u32::MAX }, 0).expect("modelled");
        assert!(power.signals_low());
        assert_eq!((power.read(SR2, 0), power.deadline()), (Some(IS_LOW), 100));
        power.advance(100);
        assert!(!power.signals_low() && !power.is_gone(100));
    }

    #[test]
    fn a_lost_supply_comes_back_with_the_reset_only() {
        let mut power = Pwr::default();
        power.fall(100, Then::Gone);
        power.advance(99);
        assert!(!power.is_gone(99));
        let pulled = power.after_reset(50);
        assert_eq!(pulled.deadline(), 100, "a pulled pin gives no supply");
        power.advance(100);
        assert!(power.is_gone(100));
        assert_eq!(power.after_reset(100).deadline(), u64::MAX);
    }
}
