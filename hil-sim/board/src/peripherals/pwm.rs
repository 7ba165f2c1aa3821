//! A timer with PWM on channel 1 and a break input: TIM1 and TIM8.
//!
//! Source: RM0440, advanced-control timers: repetition counter, one-pulse mode, PWM modes, break
//! function.

use super::encoder::filter_cycles;
use super::registers::Registers;
use super::{Peripheral, Why, Write};
use crate::description::{TIM1, bits, tim1::*};

/// Registers that the model has in part: counting up and edge-aligned, compares without dithering,
/// a break input from the pin alone, no lock.
const PARTS: [(u32, u32); 9] = [
    (CR1, bits(&[cr1::CEN, cr1::UDIS, cr1::URS, cr1::OPM, cr1::ARPE, cr1::CKD])),
    (ARR, 0xFFFF),
    (CCR1, 0xFFFF),
    (CCR2, 0xFFFF),
    (CCR3, 0xFFFF),
    (CCR4, 0xFFFF),
    (BDTR, !bits(&[bdtr::LOCK, bdtr::BKBID, bdtr::BK2ID])),
    (AF1, bits(&[af1::BKINE, af1::BKINP])),
    (AF2, bits(&[af2::BKINE, af2::BK2INP])),
];

/// The timer.
#[derive(Clone, Debug)]
pub struct Pwm {
    registers: Registers,
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
        let whole = [SR, CCMR1_OUTPUT, CCMR2_OUTPUT, CCER, PSC, RCR];
        let mut registers = Registers::of(TIM1, &whole, &PARTS, &[CR2, SMCR, DIER, EGR]);
        // By RM0440, TIMx_AFx; the description has 0.
        registers.put(af1::BKINE, 1);
        registers.put(af2::BKINE, 1);
        Self {
            registers,
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
        self.registers.has(cr1::CEN)
    }

    fn counter(&self, now: u64) -> u64 {
        if self.runs() { (now - self.origin) / self.prescaler % self.period } else { self.stopped }
    }

    /// Cycles up to `now` for which channel 1 was high at its pin.
    pub fn high(&self, now: u64) -> u64 {
        let passed = now.saturating_sub(self.since);
        if self.frozen || !self.registers.has(bdtr::MOE) || !self.registers.has(ccer::CC1E) {
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
        let mode =
            [ccmr1_output::OC1M, ccmr1_output::OC1M_3].map(|part| self.registers.field(part));
        let active = match mode[0] | mode[1] << 3 {
            5 => passed,
            6 => in_first,
            7 => passed - in_first,
            _ => 0,
        };
        self.high + if !self.registers.has(ccer::CC1P) { active } else { passed - active }
    }

    /// The level of channel 1 at `at` and the cycles since its edge, by the period of now: one that
    /// was begun later is taken to have been there before.
    pub fn level(&self, at: u64) -> (bool, u64) {
        let on = [bdtr::MOE, ccer::CC1E, cr1::CEN].iter().all(|field| self.registers.has(*field));
        if self.frozen || !on {
            return (false, u64::MAX);
        }
        let period = (self.period * self.prescaler) as i64;
        let counted = (at as i64 - self.origin as i64).rem_euclid(period) as u64;
        let first = (self.compare * self.prescaler).min(period as u64);
        let in_first = counted < first;
        let high = in_first ^ (self.registers.field(ccmr1_output::OC1M) == 7);
        let constant = first == 0 || first == period as u64;
        let since = if in_first { counted } else { counted - first };
        (high, if constant { u64::MAX } else { since })
    }

    /// Books the output up to `now`, before something changes.
    fn book(&mut self, now: u64) {
        self.high = self.high(now);
        self.since = now;
    }

    /// Sets the level at the break input's pin.
    pub(crate) fn set_break(&mut self, pin: bool, now: u64) {
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

    pub(crate) fn set_system_break(&mut self, level: bool, now: u64) {
        self.system = level;
        self.rearm(now);
    }

    fn is_break_active(&self) -> bool {
        let active = self.pin ^ self.registers.has(af1::BKINP) == self.registers.has(bdtr::BKP);
        self.registers.has(bdtr::BKE) && self.registers.has(af1::BKINE) && active
    }

    fn is_system_break(&self) -> bool {
        self.registers.has(bdtr::BKE) && self.system
    }

    /// Starts or ends the wait for the filter.
    fn rearm(&mut self, now: u64) {
        if self.is_system_break() {
            self.breaks = self.breaks.min(now);
        } else if self.is_break_active() {
            let filter = filter_cycles(self.registers.field(bdtr::BKF));
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
        if self.registers.has(cr1::OPM) {
            self.registers.put(cr1::CEN, 0);
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
            ARR if !self.registers.has(cr1::ARPE) => self.period = value + 1,
            CCR1 if !self.registers.has(ccmr1_output::OC1PE) => self.compare = value,
            _ => self.await_update(now),
        }
    }
}

impl Peripheral for Pwm {
    fn read(&mut self, offset: u32, now: u64) -> Option<u32> {
        match offset {
            CNT => Some(self.counter(now) as u32),
            _ => self.registers.read(offset),
        }
    }

    fn write(&mut self, offset: u32, write: Write, now: u64) -> Result<(), Why> {
        self.advance(now);
        match offset {
            SR => {
                // It can be cleared only once its cause has gone.
                let kept = if self.is_system_break() { sr::SBIF.mask } else { 0 };
                self.registers.clear(SR, write.zeros() & !kept);
            }
            CNT => {
                self.stopped = write.value.into();
                self.origin = now.wrapping_sub(self.stopped * self.prescaler);
            }
            EGR if write.ones() == egr::UG.mask => self.load(now),
            CR1 => {
                let (ran, counter) = (self.runs(), self.counter(now));
                self.registers.write(CR1, write)?;
                match (ran, self.runs()) {
                    (false, true) => self.origin = now.wrapping_sub(counter * self.prescaler),
                    (true, false) => self.stopped = counter,
                    _ => {}
                }
                self.await_update(now);
            }
            BDTR => {
                let were_on = self.registers.has(bdtr::MOE);
                self.registers.write(BDTR, write)?;
                let broken = self.is_break_active() && self.breaks <= now;
                let active = self.registers.has(sr::SBIF) || self.is_system_break() || broken;
                if active && !were_on {
                    // While the break is active, or the chip's own is flagged, the outputs stay off.
                    self.registers.put(bdtr::MOE, 0);
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
        Ok(())
    }

    fn deadline(&self) -> u64 {
        self.update.min(if self.registers.has(bdtr::MOE) { self.breaks } else { u64::MAX })
    }

    fn advance(&mut self, now: u64) {
        if self.update <= now {
            let at = self.update;
            self.book(at);
            self.load(at);
        }
        self.book(now);
        if self.is_system_break() {
            self.registers.put(sr::SBIF, 1);
        }
        if self.breaks <= now && self.registers.has(bdtr::MOE) {
            self.registers.put(bdtr::MOE, 0);
            if !self.is_system_break() {
                self.registers.put(sr::BIF, 1);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::peripherals::tests::write;

    const PERIOD: u64 = 8500;
    const PULSE: u32 = bits(&[cr1::ARPE, cr1::OPM]);

    fn moe(timer: &mut Pwm) -> bool {
        timer.read(BDTR, 0).is_some_and(|word| bdtr::MOE.is_in(word))
    }

    /// 20 kHz on channel 1 from cycle 0 on, break armed, emergency stop closed.
    fn running() -> Pwm {
        let mut timer = Pwm::new(false);
        write(&mut timer, ARR, PERIOD as u32 - 1, 0);
        write(&mut timer, CCMR1_OUTPUT, 0x68, 0);
        write(&mut timer, CCER, 1, 0);
        write(&mut timer, EGR, 1, 0);
        write(&mut timer, CR1, bits(&[cr1::CEN, cr1::ARPE]), 0);
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
        let level = [0, 2124, 2125, 8499].map(|at| timer.level(3 * PERIOD + at));
        assert_eq!(level, [(true, 0), (true, 2124), (false, 0), (false, 6374)]);
    }

    /// One pulse of 50 periods at a duty of three quarters in this PWM mode, begun at cycle 0.
    fn pulse(mode: u32) -> Pwm {
        let mut timer = running();
        write(&mut timer, CCMR1_OUTPUT, mode << 4 | 8, 0);
        write(&mut timer, CCR1, 2125, 0);
        write(&mut timer, RCR, 49, 0);
        write(&mut timer, CR1, PULSE, 0);
        write(&mut timer, EGR, 1, 0);
        write(&mut timer, CR1, PULSE | cr1::CEN.mask, 0);
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
            assert_eq!(timer.read(CR1, end).map(|word| cr1::CEN.of(word)), Some(0), "{mode}");
            assert_eq!((timer.read(CNT, end + 9), timer.high(end)), (Some(0), high), "{mode}");
            assert_eq!(timer.high(end + 1000), high + after, "{mode}");
        }
    }

    #[test]
    fn an_update_by_software_begins_the_pulse_and_its_period_again() {
        let mut timer = pulse(7);
        let again = 20 * PERIOD + 1000;
        write(&mut timer, EGR, 1, again);
        assert_eq!(
            timer.read(CR1, again).map(|word| cr1::CEN.of(word)),
            Some(0),
            "an update ends it"
        );
        write(&mut timer, CR1, PULSE | cr1::CEN.mask, again);
        assert_eq!(timer.deadline(), again + 50 * PERIOD);
        assert_eq!(timer.high(again + PERIOD), 21 * 6375);
    }

    #[test]
    fn a_break_by_the_chip_keeps_the_outputs_off_until_its_flag_is_cleared() {
        let mut timer = running();
        timer.set_system_break(true, 500);
        timer.advance(500);
        assert!(!moe(&mut timer));
        write(&mut timer, SR, 0, 600);
        assert_eq!(timer.read(SR, 600), Some(sr::SBIF.mask), "its cause is still there");
        timer.set_system_break(false, 700);
        write(&mut timer, BDTR, 0xFB400, 800);
        assert!(!moe(&mut timer), "flagged");
        write(&mut timer, SR, !sr::SBIF.mask, 900);
        write(&mut timer, BDTR, 0xFB400, 1000);
        assert!(moe(&mut timer));
    }

    #[test]
    fn an_open_emergency_stop_disables_the_outputs_until_they_are_enabled_again() {
        let mut timer = running();
        timer.advance(PERIOD);
        timer.set_break(true, 9_000);
        timer.set_break(false, 9_200);
        timer.advance(9_900);
        assert!(moe(&mut timer), "a bounce");
        timer.set_break(true, 10_000);
        timer.advance(10_255);
        assert!(moe(&mut timer), "shorter than the filter");
        timer.advance(10_256);
        assert!(!moe(&mut timer));
        assert_eq!(timer.read(SR, 0), Some(sr::BIF.mask));
        write(&mut timer, BDTR, 0xFB400, 10_300);
        assert!(!moe(&mut timer), "still open");
        timer.set_break(false, 20_000);
        timer.advance(30_000);
        assert!(!moe(&mut timer), "closing gives nothing back");
        write(&mut timer, BDTR, 0xFB400, 40_000);
        assert!(moe(&mut timer));
    }
}
