//! Power control: the core's voltage stands as soon as it is asked for; and the supply, which
//! may fall, with the detector that tells of it.
//!
//! The detector compares at once: below its threshold, whichever is set, the supply is low,
//! and the chip goes on until the supply is gone.
//!
//! Source: RM0440, 6.2.2 (programmable voltage detector) and 6.4 (registers).

use super::registers::{Kept, Registers};
use super::{HZ, Peripheral, Write};

const CR2: u32 = 0x04;
const SR2: u32 = 0x14;

/// Of CR2: the detector is on.
const DETECTS: u32 = 1;
/// Of SR2: the supply is below the threshold.
const IS_LOW: u32 = 1 << 11;

/// Cycles for which the board's capacitors carry the chip from the detector's threshold to the
/// reset, at least; what the wiring has to hold to.
pub const HOLDS: u64 = HZ / 1000;

/// CR1 to CR4, CR5 (with the boost of the main regulator), and the status registers,
/// which report no change under way. Pull-ups in standby are not used.
const REGISTERS: [Kept; 7] = [
    Kept { offset: 0x00, reset: 0x200, mask: 0x4707 },
    Kept { offset: CR2, reset: 0, mask: 0xFFFF },
    Kept { offset: 0x08, reset: 0x8000, mask: 0xFFFF },
    Kept { offset: 0x0C, reset: 0, mask: 0xFFFF },
    Kept { offset: 0x10, reset: 0, mask: 0 },
    Kept { offset: SR2, reset: 0, mask: 0 },
    Kept { offset: 0x80, reset: 0x100, mask: 0x100 },
];

/// How it goes on with a supply that has fallen below the threshold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Then {
    /// It is gone.
    Gone,
    /// It comes back.
    Back,
}

/// Power control.
#[derive(Clone, Debug)]
pub struct Pwr {
    registers: Registers,
    /// The supply is low, up to this cycle, and then.
    low: Option<(u64, Then)>,
}

impl Default for Pwr {
    fn default() -> Self {
        Self { registers: Registers::new(&REGISTERS), low: None }
    }
}

impl Pwr {
    /// The supply falls below the threshold, for so long.
    pub const fn fall(&mut self, until: u64, then: Then) {
        self.low = Some((until, then));
    }

    /// Line of the detector: on, and the supply low.
    #[must_use]
    pub fn tells(&self) -> bool {
        self.low.is_some() && self.registers.get(CR2) & DETECTS != 0
    }

    /// Whether the supply is gone.
    #[must_use]
    pub fn is_gone(&self, now: u64) -> bool {
        self.low.is_some_and(|(until, then)| until <= now && then == Then::Gone)
    }

    /// What a reset of the chip makes of it; only a supply that is gone comes back by that.
    #[must_use]
    pub fn after_reset(&self, now: u64) -> Self {
        let low = self.low.filter(|_| !self.is_gone(now));
        Self { low, ..Self::default() }
    }
}

impl Peripheral for Pwr {
    fn read(&mut self, offset: u32, _: u64) -> Option<u32> {
        let kept = self.registers.read(offset)?;
        Some(if offset == SR2 && self.tells() { kept | IS_LOW } else { kept })
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
    fn a_low_supply_is_told_while_the_detector_is_on() {
        let mut power = Pwr::default();
        power.fall(100, Then::Back);
        assert_eq!(power.read(SR2, 0), Some(0));
        power.write(CR2, Write { value: DETECTS, mask: u32::MAX }, 0).expect("modelled");
        assert!(power.tells());
        assert_eq!((power.read(SR2, 0), power.deadline()), (Some(IS_LOW), 100));
        power.advance(100);
        assert!(!power.tells() && !power.is_gone(100));
    }

    #[test]
    fn a_supply_that_is_gone_comes_back_with_the_reset_alone() {
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
