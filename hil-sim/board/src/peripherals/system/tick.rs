//! The core's two counters: the system timer, and the cycle counter of the data watchpoint unit.

use super::super::{Peripheral, Why, Write};

const CSR: u32 = 0x10;
const RVR: u32 = 0x14;
const CVR: u32 = 0x18;
const CALIB: u32 = 0x1C;

const ENABLE: u32 = 1;
const INTERRUPT: u32 = 2;
const CORE_CLOCK: u32 = 4;

/// A counter of 24 bits that counts down.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SysTick {
    control: u32,
    reload: u32,
    /// Cycle at which it next counts from 1 to 0.
    zero: u64,
    /// It has reached 0 since the control register was last read.
    reached: bool,
}

impl Default for SysTick {
    fn default() -> Self {
        Self { control: 0, reload: 0, zero: u64::MAX, reached: false }
    }
}

impl SysTick {
    /// Stands still for so many cycles, as the core does.
    pub const fn freeze(&mut self, cycles: u64) {
        self.zero = self.zero.saturating_add(cycles);
    }

    /// Cycles of the core in a count.
    const fn step(&self) -> u64 {
        if self.control & CORE_CLOCK != 0 { 1 } else { 8 }
    }

    fn period(&self) -> u64 {
        (u64::from(self.reload) + 1) * self.step()
    }

    const fn runs(&self) -> bool {
        self.control & ENABLE != 0 && self.reload != 0
    }

    pub(super) fn read(&mut self, offset: u32, now: u64) -> Option<u32> {
        Some(match offset {
            CSR => {
                let reached = std::mem::take(&mut self.reached);
                self.control | u32::from(reached) << 16
            }
            RVR => self.reload,
            CVR if self.runs() => (self.zero.saturating_sub(now) / self.step()) as u32,
            CVR => 0,
            // No reference clock is calibrated.
            CALIB => 1 << 31 | 1 << 30,
            _ => return None,
        })
    }

    pub(super) fn write(&mut self, offset: u32, write: Write, now: u64) -> Result<(), Why> {
        let ran = self.runs();
        match offset {
            CSR => self.control = write.onto(self.control) & 7,
            RVR => self.reload = write.onto(self.reload) & 0x00FF_FFFF,
            CVR => self.reached = false,
            CALIB => {}
            _ => return Err(Why::NoModel),
        }
        if !self.runs() {
            self.zero = u64::MAX;
        } else if !ran || offset == CVR {
            self.zero = now + self.period();
        }
        Ok(())
    }

    pub(super) fn deadline(&self) -> u64 {
        if self.control & INTERRUPT != 0 { self.zero } else { u64::MAX }
    }

    /// Updates it; returns whether it requests its exception.
    pub(super) fn advance(&mut self, now: u64) -> bool {
        if self.zero > now {
            return false;
        }
        self.reached = true;
        self.zero += ((now - self.zero) / self.period() + 1) * self.period();
        self.control & INTERRUPT != 0
    }
}

const CTRL: u32 = 0x0;
const CYCCNT: u32 = 0x4;

/// The cycle counter; the rest of its unit is not modelled.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counter {
    on: bool,
    origin: u64,
    held: u32,
}

impl Counter {
    /// Stands still for so many cycles, as the core does.
    pub const fn freeze(&mut self, cycles: u64) {
        self.origin = self.origin.wrapping_add(cycles);
    }
}

impl Peripheral for Counter {
    fn read(&mut self, offset: u32, now: u64) -> Option<u32> {
        match offset {
            // Four comparators, and whether it counts.
            CTRL => Some(4 << 28 | u32::from(self.on)),
            CYCCNT if self.on => Some(now.wrapping_sub(self.origin) as u32),
            CYCCNT => Some(self.held),
            _ => None,
        }
    }

    fn write(&mut self, offset: u32, write: Write, now: u64) -> Result<(), Why> {
        let value = self.read(CYCCNT, now).ok_or(Why::NoModel)?;
        match offset {
            // The unit's features are read-only.
            CTRL if write.ones() & !(1 | 0xFF << 24) == 0 => {
                self.on = write.onto(u32::from(self.on)) & 1 != 0;
                self.held = value;
            }
            CYCCNT => self.held = write.onto(value),
            _ => return Err(Why::NoModel),
        }
        self.origin = now.wrapping_sub(u64::from(self.held));
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::peripherals::tests::write;

    fn all(value: u32) -> Write {
        Write { value, mask: u32::MAX }
    }

    #[test]
    fn the_system_timer_requests_its_exception_every_period() {
        let mut tick = SysTick::default();
        tick.write(RVR, all(999), 0).expect("modelled");
        tick.write(CSR, all(ENABLE | INTERRUPT | CORE_CLOCK), 100).expect("modelled");
        assert_eq!(tick.deadline(), 1100);
        assert_eq!(tick.read(CVR, 600), Some(500));
        assert!(!tick.advance(1099));
        assert!(tick.advance(1100));
        assert_eq!(tick.deadline(), 2100);
        assert_eq!(tick.read(CSR, 1100).map(|csr| csr >> 16), Some(1));
        assert_eq!(tick.read(CSR, 1100).map(|csr| csr >> 16), Some(0));
    }

    #[test]
    fn the_cycle_counter_counts_while_it_is_on() {
        let mut counter = Counter::default();
        assert_eq!(counter.read(CYCCNT, 500), Some(0));
        write(&mut counter, CTRL, 4 << 28 | 1, 1000);
        assert_eq!(counter.read(CYCCNT, 1250), Some(250));
        write(&mut counter, CYCCNT, 7, 2000);
        assert_eq!(counter.read(CYCCNT, 2003), Some(10));
        write(&mut counter, CTRL, 0, 2010);
        assert_eq!(counter.read(CYCCNT, 9999), Some(17));
    }
}
