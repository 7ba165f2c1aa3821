//! A counter with four compare registers that keeps time: TIM2; and the same without them: TIM7.
//!
//! It counts up with prescaler and reload, and sets a flag when it reaches a compare
//! register or overflows. The registers of TIM2 are 32 bits wide, of TIM7 16.

use super::registers::Registers;
use super::{Peripheral, Why, Write};
use crate::description::{TIM2, TIM7, bits, tim2::*};

/// Directions, one-pulse mode, alternate clocks: none of them modelled.
const PLAIN: u32 = bits(&[cr1::CEN, cr1::UDIS, cr1::URS, cr1::ARPE]);
/// Interrupts of update and compares, in the order of the flags.
const INTERRUPTS: u32 = bits(&[dier::UIE, dier::CC1IE, dier::CC2IE, dier::CC3IE, dier::CC4IE]);

/// The timer.
#[derive(Clone, Debug)]
pub struct TimeBase {
    registers: Registers,
    /// Flags: one, and one for each compare register.
    flags: u32,
    /// Cycle at which the counter was zero, while it runs.
    origin: u64,
    /// Count up to which the flags are up to date.
    seen: u64,
    /// Prescaler in use: a new one is active from the next overflow or update event.
    prescaler: u64,
    /// Cycle at which the next cleared flag is set.
    flag_due: u64,
    /// The same of flags that request the interrupt.
    due: u64,
}

impl Default for TimeBase {
    fn default() -> Self {
        Self {
            registers: Registers::of(
                TIM2,
                &[SR, PSC, ARR, CCR1, CCR2, CCR3, CCR4],
                &[(CR1, PLAIN), (DIER, INTERRUPTS)],
                &[CR2, SMCR, EGR, CCMR1_OUTPUT, CCMR2_OUTPUT],
            ),
            flags: 5,
            origin: 0,
            seen: 0,
            prescaler: 1,
            flag_due: u64::MAX,
            due: u64::MAX,
        }
    }
}

impl TimeBase {
    /// Without compare registers.
    pub(crate) fn basic() -> Self {
        let parts = [(CR1, PLAIN), (DIER, dier::UIE.mask), (ARR, 0xFFFF)];
        let registers = Registers::of(TIM7, &[SR, PSC], &parts, &[CR2, EGR]);
        Self { registers, flags: 1, ..Self::default() }
    }

    fn runs(&self) -> bool {
        self.registers.has(cr1::CEN)
    }

    fn period(&self) -> u64 {
        u64::from(self.registers.get(ARR)) + 1
    }

    /// Counts since the origin.
    fn counts(&self, now: u64) -> u64 {
        if self.runs() { (now - self.origin) / self.prescaler } else { self.seen }
    }

    /// The first count after `after` at which the counter shows `value`.
    fn meets(&self, after: u64, value: u32) -> Option<u64> {
        let (period, value) = (self.period(), u64::from(value));
        if value >= period {
            return None;
        }
        let first = after / period * period + value;
        Some(if first > after { first } else { first + period })
    }

    /// Value that sets flag `bit`: zero for the overflow, or a compare.
    fn value_of(&self, bit: u32) -> u32 {
        if bit == 0 { 0 } else { self.registers.get(CCR1 + 4 * (bit - 1)) }
    }

    /// Brings the flags up to date.
    fn update(&mut self, now: u64) {
        let counts = self.counts(now);
        if now >= self.flag_due {
            let met = |bit: &u32| {
                self.meets(self.seen, self.value_of(*bit)).is_some_and(|at| at <= counts)
            };
            let met = (0..self.flags).filter(met).fold(0, |flags, bit| flags | 1 << bit);
            self.registers.set(SR, self.registers.get(SR) | met);
            self.seen = counts;
            self.schedule();
        }
        self.seen = counts;
    }

    /// Computes when the next flags are set.
    fn schedule(&mut self) {
        let next = |flags: u32| {
            let bits = (0..self.flags).filter(|bit| flags >> bit & 1 != 0);
            let counts = bits.filter_map(|bit| self.meets(self.seen, self.value_of(bit))).min();
            counts.map_or(u64::MAX, |count| self.origin.wrapping_add(count * self.prescaler))
        };
        let cleared = !self.registers.get(SR);
        (self.flag_due, self.due) = if self.runs() {
            (next(cleared), next(self.registers.get(DIER) & cleared))
        } else {
            (u64::MAX, u64::MAX)
        };
    }

    /// Stands still for so many cycles from `now` on.
    pub fn freeze(&mut self, cycles: u64, now: u64) {
        self.update(now);
        self.origin = self.origin.wrapping_add(cycles);
        self.schedule();
    }

    /// Sets the counter to `value` at `now`.
    fn place(&mut self, value: u64, now: u64) {
        self.origin = now.wrapping_sub(value * self.prescaler);
        self.seen = value;
    }

    /// Changes a register.
    fn put(&mut self, offset: u32, write: Write, now: u64) -> Result<(), Why> {
        self.update(now);
        match offset {
            SR => self.registers.clear(SR, write.zeros()),
            CNT => self.place(u64::from(write.value), now),
            EGR if write.ones() == egr::UG.mask => {
                self.prescaler = u64::from(self.registers.get(PSC)) + 1;
                self.place(0, now);
                // With `URS` only an overflow sets the flag.
                if !self.registers.has(cr1::URS) {
                    self.registers.put(sr::UIF, 1);
                }
            }
            CR1 => {
                let ran = self.runs();
                self.registers.write(CR1, write)?;
                if self.runs() && !ran {
                    self.place(self.seen, now);
                }
            }
            _ => self.registers.write(offset, write)?,
        }
        Ok(())
    }

    /// Whether it requests its interrupt.
    pub fn requests(&self) -> bool {
        self.registers.get(SR) & self.registers.get(DIER) != 0
    }
}

impl Peripheral for TimeBase {
    fn read(&mut self, offset: u32, now: u64) -> Option<u32> {
        self.update(now);
        match offset {
            CNT => Some((self.counts(now) % self.period()) as u32),
            _ => self.registers.read(offset),
        }
    }

    fn write(&mut self, offset: u32, write: Write, now: u64) -> Result<(), Why> {
        let taken = self.put(offset, write, now);
        self.schedule();
        taken
    }

    fn deadline(&self) -> u64 {
        self.due
    }

    fn advance(&mut self, now: u64) {
        self.update(now);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::peripherals::tests::write;

    /// At 1 MHz with 16 bits from cycle 1000 on.
    fn running() -> TimeBase {
        let mut timer = TimeBase::default();
        write(&mut timer, PSC, 169, 0);
        write(&mut timer, ARR, 0xFFFF, 0);
        write(&mut timer, CR1, cr1::URS.mask, 0);
        write(&mut timer, EGR, egr::UG.mask, 0);
        write(&mut timer, CR1, cr1::CEN.mask, 1000);
        timer
    }

    #[test]
    fn it_counts_with_its_prescaler_and_starts_over() {
        let mut timer = running();
        assert_eq!(timer.read(CNT, 1000 + 169), Some(0));
        assert_eq!(timer.read(CNT, 1000 + 170), Some(1));
        assert_eq!(timer.read(CNT, 1000 + 170 * 65_536), Some(0));
        assert_eq!(timer.read(SR, 1000 + 170 * 65_536).map(|flags| flags & 1), Some(1));
    }

    #[test]
    fn a_compare_requests_its_interrupt_when_it_is_reached() {
        let mut timer = running();
        write(&mut timer, CCR2, 500, 1000);
        write(&mut timer, DIER, dier::CC2IE.mask, 1000);
        let due = 1000 + 170 * 500;
        assert_eq!(timer.deadline(), due);
        timer.advance(due - 1);
        assert!(!timer.requests());
        timer.advance(due);
        assert!(timer.requests());
        assert_eq!(timer.deadline(), u64::MAX, "already requested");
        write(&mut timer, SR, !sr::CC2IF.mask, due + 5);
        assert!(!timer.requests());
        assert_eq!(timer.deadline(), due + 170 * 65_536);
    }

    #[test]
    fn a_compare_beyond_the_reload_is_never_met() {
        let mut timer = running();
        write(&mut timer, CCR1, 0x1_0000, 1000);
        write(&mut timer, DIER, dier::CC1IE.mask, 1000);
        assert_eq!(timer.deadline(), u64::MAX);
    }
}
