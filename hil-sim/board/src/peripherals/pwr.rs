//! Power control: the core's voltage settles at once; and the supply, which can fall, with
//! its voltage detector.
//!
//! The detector has no delay. A low supply is below every threshold that can be set; the
//! chip runs until the supply is lost.
//!
//! Source: RM0440, 6.2.2 (programmable voltage detector) and 6.4 (registers).

use super::registers::Registers;
use super::{HZ, Peripheral, Why, Write};
use crate::description::{PWR, pwr::*};

/// Least core cycles for which the board's capacitors supply the chip between the detector's
/// threshold and the reset: a requirement of the wiring.
pub const HOLDS: u64 = HZ / 1000;

/// The status registers report no change in progress. Pull-ups in standby are not used.
const WHOLE: [u32; 7] = [CR1, CR2, CR3, CR4, SR1, SR2, CR5];

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
        Self { registers: Registers::of(PWR, &WHOLE, &[], &[]), low: None }
    }
}

impl Pwr {
    /// The supply is below the threshold until this cycle.
    pub const fn fall(&mut self, until: u64, then: Then) {
        self.low = Some((until, then));
    }

    /// Output of the detector: it is on and the supply is low.
    pub(crate) fn signals_low(&self) -> bool {
        self.low.is_some() && self.registers.has(cr2::PVDE)
    }

    /// Whether the main regulator boosts range 1.
    pub(crate) fn boosts(&self) -> bool {
        !self.registers.has(cr5::R1MODE)
    }

    /// Whether power is lost.
    pub(crate) fn is_gone(&self, now: u64) -> bool {
        self.low.is_some_and(|(until, then)| until <= now && then == Then::Gone)
    }

    /// State after a reset of the chip; a lost supply is back.
    pub(crate) fn after_reset(&self, now: u64) -> Self {
        let low = self.low.filter(|_| !self.is_gone(now));
        Self { low, ..Self::default() }
    }
}

impl Peripheral for Pwr {
    fn read(&mut self, offset: u32, _: u64) -> Option<u32> {
        let kept = self.registers.read(offset)?;
        Some(if offset == SR2 && self.signals_low() { kept | sr2::PVDO.mask } else { kept })
    }

    fn write(&mut self, offset: u32, write: Write, _: u64) -> Result<(), Why> {
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
    use crate::peripherals::tests::write;

    #[test]
    fn a_low_supply_is_reported_while_the_detector_is_on() {
        let mut power = Pwr::default();
        power.fall(100, Then::Back);
        assert_eq!(power.read(SR2, 0), Some(0));
        write(&mut power, CR2, cr2::PVDE.mask, 0);
        assert!(power.signals_low());
        assert_eq!((power.read(SR2, 0), power.deadline()), (Some(sr2::PVDO.mask), 100));
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
