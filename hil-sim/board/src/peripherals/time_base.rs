//! A counter with four compare registers that keeps time: TIM2; and the same without them: TIM7.
//!
//! It counts up with prescaler and reload, and sets a flag when it reaches a compare
//! register or overflows. The registers of TIM2 are 32 bits wide, of TIM7 16.

use super::registers::{Kept, Registers};
use super::{Peripheral, Write};

const CR1: u32 = 0x00;
const DIER: u32 = 0x0C;
const SR: u32 = 0x10;
const EGR: u32 = 0x14;
const CNT: u32 = 0x24;
const PSC: u32 = 0x28;
const ARR: u32 = 0x2C;
const CCR1: u32 = 0x34;

const ALL: u32 = u32::MAX;
const ENABLE: u32 = 1;
/// `URS`: only an overflow sets the update flag.
const OVERFLOW_ONLY: u32 = 1 << 2;
/// Update and the four compares.
const FLAGS: u32 = 0x1F;
/// Directions, one-pulse mode, alternate clocks: none of them modelled.
const PLAIN: u32 = ENABLE | 1 << 1 | OVERFLOW_ONLY | 1 << 7;

const fn registers(flags: u32, reload: u32) -> [Kept; 4] {
    [
        Kept { offset: CR1, reset: 0, mask: PLAIN },
        Kept { offset: DIER, reset: 0, mask: flags },
        Kept { offset: PSC, reset: 0, mask: 0xFFFF },
        Kept { offset: ARR, reset: reload, mask: reload },
    ]
}

/// The timer.
#[derive(Clone, Debug)]
pub struct TimeBase {
    registers: Registers,
    /// Flags: one, and one for each compare register.
    bits: u32,
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
            registers: Registers::new(
                &registers(FLAGS, ALL),
                &[CCR1, CCR1 + 4, CCR1 + 8, CCR1 + 12],
                &[0x04, 0x08, 0x18, 0x1C],
            ),
            bits: 5,
            flags: 0,
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
    pub fn basic() -> Self {
        let registers = Registers::new(&registers(1, 0xFFFF), &[], &[0x04]);
        Self { registers, bits: 1, ..Self::default() }
    }

    fn runs(&self) -> bool {
        self.registers.get(CR1) & ENABLE != 0
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
            for bit in 0..self.bits {
                if self.meets(self.seen, self.value_of(bit)).is_some_and(|at| at <= counts) {
                    self.flags |= 1 << bit;
                }
            }
            self.seen = counts;
            self.schedule();
        }
        self.seen = counts;
    }

    /// Computes when the next flags are set.
    fn schedule(&mut self) {
        let next = |flags: u32| {
            let bits = (0..self.bits).filter(|bit| flags >> bit & 1 != 0);
            let counts = bits.filter_map(|bit| self.meets(self.seen, self.value_of(bit))).min();
            counts.map_or(u64::MAX, |count| self.origin.wrapping_add(count * self.prescaler))
        };
        (self.flag_due, self.due) = if self.runs() {
            (next(!self.flags), next(self.registers.get(DIER) & !self.flags))
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
    fn put(&mut self, offset: u32, write: Write, now: u64) -> Option<()> {
        self.update(now);
        match offset {
            SR => self.flags &= !(write.mask & !write.value),
            CNT => self.place(u64::from(write.value), now),
            EGR if write.ones() & !1 == 0 => {
                if write.ones() & 1 != 0 {
                    self.prescaler = u64::from(self.registers.get(PSC)) + 1;
                    self.place(0, now);
                    if self.registers.get(CR1) & OVERFLOW_ONLY == 0 {
                        self.flags |= 1;
                    }
                }
            }
            CR1 if write.ones() & !PLAIN == 0 => {
                let ran = self.runs();
                self.registers.write(CR1, write)?;
                if self.runs() && !ran {
                    self.place(self.seen, now);
                }
            }
            CR1 | EGR => return None,
            _ => self.registers.write(offset, write)?,
        }
        Some(())
    }

    /// Whether it requests its interrupt.
    pub fn requests(&self) -> bool {
        self.flags & self.registers.get(DIER) != 0
    }
}

impl Peripheral for TimeBase {
    fn read(&mut self, offset: u32, now: u64) -> Option<u32> {
        self.update(now);
        match offset {
            CNT => Some((self.counts(now) % self.period()) as u32),
            SR => Some(self.flags),
            EGR => Some(0),
            _ => self.registers.read(offset),
        }
    }

    fn write(&mut self, offset: u32, write: Write, now: u64) -> Option<()> {
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

    fn write(timer: &mut TimeBase, offset: u32, value: u32, now: u64) {
        timer.write(offset, Write { value, mask: ALL }, now).expect("modelled");
    }

    /// At 1 MHz with 16 bits from cycle 1000 on.
    fn running() -> TimeBase {
        let mut timer = TimeBase::default();
        write(&mut timer, PSC, 169, 0);
        write(&mut timer, ARR, 0xFFFF, 0);
        write(&mut timer, CR1, OVERFLOW_ONLY, 0);
        write(&mut timer, EGR, 1, 0);
        write(&mut timer, CR1, ENABLE, 1000);
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
        write(&mut timer, CCR1 + 4, 500, 1000);
        write(&mut timer, DIER, 1 << 2, 1000);
        let due = 1000 + 170 * 500;
        assert_eq!(timer.deadline(), due);
        timer.advance(due - 1);
        assert!(!timer.requests());
        timer.advance(due);
        assert!(timer.requests());
        assert_eq!(timer.deadline(), u64::MAX, "already requested");
        write(&mut timer, SR, !(1 << 2), due + 5);
        assert!(!timer.requests());
        assert_eq!(timer.deadline(), due + 170 * 65_536);
    }

    #[test]
    fn a_compare_beyond_the_reload_is_never_met() {
        let mut timer = running();
        write(&mut timer, CCR1, 0x1_0000, 1000);
        write(&mut timer, DIER, 1 << 1, 1000);
        assert_eq!(timer.deadline(), u64::MAX);
    }

    #[test]
    fn counting_down_is_not_modelled() {
        let mut timer = TimeBase::default();
        assert_eq!(timer.write(CR1, Write { value: 1 << 4, mask: ALL }, 0), None);
    }
}
