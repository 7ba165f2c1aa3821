//! A timer with PWM on channel 1 and a break input: TIM1 and TIM8.
//!
//! Source: RM0440, advanced-control timers: repetition counter, one-pulse mode, PWM modes, break
//! function.

use super::encoder::filter_cycles;
use super::registers::{Kept, Registers};
use super::{Peripheral, Write};

const CR1: u32 = 0x00;
const SR: u32 = 0x10;
const EGR: u32 = 0x14;
const CCMR1: u32 = 0x18;
const CCER: u32 = 0x20;
const CNT: u32 = 0x24;
const PSC: u32 = 0x28;
const ARR: u32 = 0x2C;
const RCR: u32 = 0x30;
const CCR1: u32 = 0x34;
const BDTR: u32 = 0x44;
const AF1: u32 = 0x60;

const ENABLE: u32 = 1;
/// The next update event stops the counter.
const ONE_PULSE: u32 = 1 << 3;
/// Counting up, edge-aligned.
const PLAIN: u32 = ENABLE | 1 << 1 | 1 << 2 | ONE_PULSE | 1 << 7;
const MOE: u32 = 1 << 15;
const BREAK_ENABLE: u32 = 1 << 12;
const BREAK_HIGH: u32 = 1 << 13;
/// Of `SR`: a break by the pin, and one by the chip itself. The outputs stay off until the latter
/// is cleared, which is possible only once its cause has gone.
const BREAK_FLAG: u32 = 1 << 7;
const SYSTEM_BREAK_FLAG: u32 = 1 << 13;

const REGISTERS: [Kept; 15] = [
    Kept { offset: CR1, reset: 0, mask: PLAIN | 0x300 },
    Kept { offset: 0x04, reset: 0, mask: 0x7F77 },
    Kept { offset: CCMR1, reset: 0, mask: 0x0101_FFFF },
    Kept { offset: CCMR1 + 4, reset: 0, mask: 0x0101_FFFF },
    Kept { offset: CCER, reset: 0, mask: 0x33_FFFF },
    Kept { offset: PSC, reset: 0, mask: 0xFFFF },
    Kept { offset: ARR, reset: 0xFFFF, mask: 0xFFFF },
    Kept { offset: RCR, reset: 0, mask: 0xFFFF },
    Kept { offset: CCR1, reset: 0, mask: 0xFFFF },
    Kept { offset: CCR1 + 4, reset: 0, mask: 0xFFFF },
    Kept { offset: CCR1 + 8, reset: 0, mask: 0xFFFF },
    Kept { offset: CCR1 + 12, reset: 0, mask: 0xFFFF },
    Kept { offset: BDTR, reset: 0, mask: 0x0FFF_FCFF },
    Kept { offset: AF1, reset: 1, mask: 0x201 },
    Kept { offset: 0x64, reset: 1, mask: 0x201 },
];

/// The timer.
#[derive(Clone, Debug)]
pub struct Pwm {
    registers: Registers,
    flags: u32,
    /// Cycle at which the counter was zero and the repetition counter at `repeats`, while it runs.
    origin: u64,
    /// Value of the counter while it does not.
    stopped: u64,
    /// In use until the next update: prescaler, period, compare, repetitions.
    prescaler: u64,
    period: u64,
    compare: u64,
    repeats: u64,
    /// Cycle of the next update event that loads something or stops the counter.
    update: u64,
    /// Cycles for which the output was high up to the cycle `since`.
    high: u64,
    since: u64,
    /// Level at the break input.
    pin: bool,
    /// Cycle at which the filter takes the break input for active.
    breaks: u64,
    /// A break by the chip itself: core locked up, flash damaged. It is not filtered.
    system: bool,
    /// It stands still with the core: no output is on.
    frozen: bool,
}

impl Pwm {
    /// After reset, with this level at the break input.
    pub fn new(pin: bool) -> Self {
        Self {
            registers: Registers::new(&REGISTERS, &[], &[0x08, 0x0C]),
            flags: 0,
            origin: 0,
            stopped: 0,
            prescaler: 1,
            period: 0x1_0000,
            compare: 0,
            repeats: 0,
            update: u64::MAX,
            high: 0,
            since: 0,
            pin,
            breaks: u64::MAX,
            system: false,
            frozen: false,
        }
    }

    fn runs(&self) -> bool {
        self.registers.get(CR1) & ENABLE != 0
    }

    fn counter(&self, now: u64) -> u64 {
        if self.runs() { (now - self.origin) / self.prescaler % self.period } else { self.stopped }
    }

    /// Cycles up to `now` for which channel 1 was high at its pin.
    pub fn high(&self, now: u64) -> u64 {
        let enable = self.registers.get(CCER);
        let passed = now.saturating_sub(self.since);
        if self.frozen || self.registers.get(BDTR) & MOE == 0 || enable & 1 == 0 {
            return self.high;
        }
        // Cycles of a period, and of its first part.
        let (period, first) = (self.period * self.prescaler, self.compare * self.prescaler);
        let in_first = |cycle: u64| {
            let counted = cycle.saturating_sub(self.origin);
            let (full, rest) = (counted / period, counted % period);
            full * first.min(period) + rest.min(first)
        };
        let in_first = if self.runs() {
            in_first(self.since + passed) - in_first(self.since)
        } else if self.stopped < self.compare {
            passed
        } else {
            0
        };
        let word = self.registers.get(CCMR1);
        let active = match word >> 4 & 7 | word >> 13 & 8 {
            5 => passed,
            6 => in_first,
            7 => passed - in_first,
            _ => 0,
        };
        self.high + if enable & 2 == 0 { active } else { passed - active }
    }

    /// Books the output up to `now`, before something changes.
    fn book(&mut self, now: u64) {
        self.high = self.high(now);
        self.since = now;
    }

    /// Sets the level at the break input's pin.
    pub fn set_break(&mut self, pin: bool, now: u64) {
        self.pin = pin;
        self.rearm(now);
    }

    /// Stands still, without an output, or goes on after so many cycles of that.
    pub fn freeze(&mut self, frozen: bool, cycles: u64, now: u64) {
        self.book(now);
        self.frozen = frozen;
        self.origin = self.origin.wrapping_add(cycles);
        self.update = self.update.saturating_add(cycles);
    }

    pub fn set_system_break(&mut self, level: bool, now: u64) {
        self.system = level;
        self.rearm(now);
    }

    fn is_break_active(&self) -> bool {
        let (bdtr, af) = (self.registers.get(BDTR), self.registers.get(AF1));
        let inverted = af >> 9 & 1 != 0;
        let pin = af & 1 != 0 && (self.pin ^ inverted) == (bdtr & BREAK_HIGH != 0);
        bdtr & BREAK_ENABLE != 0 && pin
    }

    fn is_system_break(&self) -> bool {
        self.registers.get(BDTR) & BREAK_ENABLE != 0 && self.system
    }

    /// Starts or ends the wait for the filter.
    fn rearm(&mut self, now: u64) {
        if self.is_system_break() {
            self.breaks = self.breaks.min(now);
        } else if self.is_break_active() {
            let filter = filter_cycles(self.registers.get(BDTR) >> 16);
            self.breaks = self.breaks.min(now + filter);
        } else {
            self.breaks = u64::MAX;
        }
    }

    /// An update event: loads the preloaded values, starts the counters over, and ends a pulse.
    fn load(&mut self, now: u64) {
        self.prescaler = u64::from(self.registers.get(PSC)) + 1;
        self.period = u64::from(self.registers.get(ARR)) + 1;
        self.compare = self.registers.get(CCR1).into();
        self.repeats = self.registers.get(RCR).into();
        (self.origin, self.stopped, self.update) = (now, 0, u64::MAX);
        let control = self.registers.get(CR1);
        if control & ONE_PULSE != 0 {
            self.registers.set(CR1, control & !ENABLE);
        }
    }

    /// Notes the next update event while the counter runs: the counter's overflow with the
    /// repetition counter at zero.
    fn await_update(&mut self, now: u64) {
        self.update = u64::MAX;
        if self.runs() {
            let cycles = self.prescaler * self.period * (self.repeats + 1);
            self.update = self.origin + ((now - self.origin) / cycles + 1) * cycles;
        }
    }

    /// Applies a write to period, compare or repetitions, at once or with the next update.
    fn renew(&mut self, offset: u32, now: u64) {
        let value = u64::from(self.registers.get(offset));
        match offset {
            ARR if self.registers.get(CR1) >> 7 & 1 == 0 => self.period = value + 1,
            CCR1 if self.registers.get(CCMR1) >> 3 & 1 == 0 => self.compare = value,
            _ => self.await_update(now),
        }
    }
}

impl Peripheral for Pwm {
    fn read(&mut self, offset: u32, now: u64) -> Option<u32> {
        match offset {
            SR => Some(self.flags),
            EGR => Some(0),
            CNT => Some(self.counter(now) as u32),
            _ => self.registers.read(offset),
        }
    }

    fn write(&mut self, offset: u32, write: Write, now: u64) -> Option<()> {
        self.advance(now);
        match offset {
            SR => {
                let kept = if self.is_system_break() { SYSTEM_BREAK_FLAG } else { 0 };
                self.flags &= !(write.mask & !write.value & !kept);
            }
            CNT => {
                self.stopped = write.value.into();
                self.origin = now.wrapping_sub(self.stopped * self.prescaler);
            }
            EGR if write.ones() == 1 => self.load(now),
            EGR if write.ones() == 0 => {}
            CR1 if write.ones() & !(PLAIN | 0x300) == 0 => {
                let (ran, counter) = (self.runs(), self.counter(now));
                self.registers.write(CR1, write)?;
                match (ran, self.runs()) {
                    (false, true) => self.origin = now.wrapping_sub(counter * self.prescaler),
                    (true, false) => self.stopped = counter,
                    _ => {}
                }
                self.await_update(now);
            }
            EGR | CR1 => return None,
            BDTR => {
                let held = self.registers.get(BDTR) & MOE;
                self.registers.write(BDTR, write)?;
                let broken = self.is_break_active() && self.breaks <= now;
                let flagged = self.flags & SYSTEM_BREAK_FLAG != 0;
                let active = flagged || self.is_system_break() || broken;
                if active && held == 0 {
                    // While the break is active the outputs stay off.
                    self.registers.set(BDTR, self.registers.get(BDTR) & !MOE);
                }
                self.rearm(now);
            }
            AF1 => {
                self.registers.write(AF1, write)?;
                self.rearm(now);
            }
            PSC | ARR | RCR | CCR1 => {
                self.registers.write(offset, write)?;
                self.renew(offset, now);
            }
            _ => self.registers.write(offset, write)?,
        }
        Some(())
    }

    fn deadline(&self) -> u64 {
        let trips = self.registers.get(BDTR) & MOE != 0;
        self.update.min(if trips { self.breaks } else { u64::MAX })
    }

    fn advance(&mut self, now: u64) {
        if self.update <= now {
            let at = self.update;
            self.book(at);
            self.load(at);
        }
        self.book(now);
        if self.is_system_break() {
            self.flags |= SYSTEM_BREAK_FLAG;
        }
        if self.breaks <= now && self.registers.get(BDTR) & MOE != 0 {
            self.registers.set(BDTR, self.registers.get(BDTR) & !MOE);
            self.flags |= if self.is_system_break() { 0 } else { BREAK_FLAG };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD: u64 = 8500;

    fn write(timer: &mut Pwm, offset: u32, value: u32, now: u64) {
        timer.write(offset, Write { value, mask: u32::MAX }, now).expect("modelled");
    }

    fn moe(timer: &mut Pwm) -> bool {
        timer.read(BDTR, 0).is_some_and(|value| value & MOE != 0)
    }

    /// 20 kHz on channel 1 from cycle 0 on, break armed, emergency stop closed.
    fn running() -> Pwm {
        let mut timer = Pwm::new(false);
        write(&mut timer, ARR, PERIOD as u32 - 1, 0);
        write(&mut timer, CCMR1, 0x68, 0);
        write(&mut timer, CCER, 1, 0);
        write(&mut timer, EGR, 1, 0);
        write(&mut timer, CR1, ENABLE | 1 << 7, 0);
        write(&mut timer, BDTR, 0xFB400, 0);
        timer
    }

    #[test]
    fn a_preloaded_compare_acts_with_the_next_period() {
        let mut timer = running();
        timer.advance(PERIOD);
        write(&mut timer, CCR1, 2125, 3 * PERIOD + 100);
        assert_eq!(timer.high(4 * PERIOD), 0);
        assert_eq!(timer.deadline(), 4 * PERIOD);
        timer.advance(4 * PERIOD);
        assert_eq!(timer.high(5 * PERIOD + 100), 2125 + 100);
        assert_eq!(timer.high(5 * PERIOD + 8000), 2 * 2125);
    }

    /// One pulse of 50 periods at a duty of three quarters in this PWM mode, begun at cycle 0.
    fn pulse(mode: u32) -> Pwm {
        let mut timer = running();
        write(&mut timer, CCMR1, mode << 4 | 8, 0);
        write(&mut timer, CCR1, 2125, 0);
        write(&mut timer, RCR, 49, 0);
        write(&mut timer, CR1, 1 << 7 | ONE_PULSE, 0);
        write(&mut timer, EGR, 1, 0);
        write(&mut timer, CR1, 1 << 7 | ONE_PULSE | ENABLE, 0);
        timer
    }

    #[test]
    fn one_pulse_ends_after_its_repetitions_with_the_counter_at_zero() {
        let end = 50 * PERIOD;
        // Mode 1 leaves the output high: the counter at zero is below the compare.
        for (mode, high, after) in [(7, 50 * 6375, 0), (6, 50 * 2125, 1000)] {
            let mut timer = pulse(mode);
            assert_eq!(timer.deadline(), end);
            timer.advance(end);
            assert_eq!(timer.read(CR1, end).map(|word| word & ENABLE), Some(0), "{mode}");
            assert_eq!((timer.read(CNT, end + 9), timer.high(end)), (Some(0), high), "{mode}");
            assert_eq!(timer.high(end + 1000), high + after, "{mode}");
        }
    }

    #[test]
    fn an_update_by_software_begins_the_pulse_and_its_period_again() {
        let mut timer = pulse(7);
        let again = 20 * PERIOD + 1000;
        write(&mut timer, EGR, 1, again);
        assert_eq!(timer.read(CR1, again).map(|word| word & ENABLE), Some(0), "an update ends it");
        write(&mut timer, CR1, 1 << 7 | ONE_PULSE | ENABLE, again);
        assert_eq!(timer.deadline(), again + 50 * PERIOD);
        assert_eq!(timer.high(again + PERIOD), 21 * 6375);
    }

    #[test]
    fn a_break_by_the_chip_keeps_the_outputs_off_until_its_flag_is_cleared() {
        let mut timer = running();
        timer.set_system_break(true, 500);
        timer.advance(500);
        write(&mut timer, SR, 0, 600);
        assert_eq!(timer.read(SR, 600), Some(SYSTEM_BREAK_FLAG), "its cause is still there");
        timer.set_system_break(false, 700);
        write(&mut timer, BDTR, 0xFB400, 800);
        assert!(!moe(&mut timer), "flagged");
        write(&mut timer, SR, !SYSTEM_BREAK_FLAG, 900);
        write(&mut timer, BDTR, 0xFB400, 1000);
        assert!(moe(&mut timer));
    }

    #[test]
    fn an_open_emergency_stop_disables_the_outputs_until_they_are_enabled_again() {
        let mut timer = running();
        timer.advance(PERIOD);
        timer.set_break(true, 10_000);
        timer.advance(10_255);
        assert!(moe(&mut timer), "shorter than the filter");
        timer.advance(10_256);
        assert!(!moe(&mut timer));
        assert_eq!(timer.read(SR, 0), Some(BREAK_FLAG));
        write(&mut timer, BDTR, 0xFB400, 10_300);
        assert!(!moe(&mut timer), "still open");
        timer.set_break(false, 20_000);
        timer.advance(30_000);
        assert!(!moe(&mut timer), "closing gives nothing back");
        write(&mut timer, BDTR, 0xFB400, 40_000);
        assert!(moe(&mut timer));
    }

    #[test]
    fn a_bounce_does_not_stop_it() {
        let mut timer = running();
        timer.set_break(true, 10_000);
        timer.set_break(false, 10_200);
        timer.advance(11_000);
        assert!(moe(&mut timer));
    }

    #[test]
    fn a_locked_up_core_stops_it() {
        let mut timer = running();
        timer.set_system_break(true, 500);
        timer.advance(500);
        assert!(!moe(&mut timer));
    }
}
