//! A timer with four PWM channels and a break input: TIM1 and TIM8.
//!
//! Source: RM0440, advanced-control timers; the lock is in `TIMx_BDTR`.

use super::encoder::filter_cycles;
use super::registers::{Kept, Registers};
use super::{Peripheral, Write};
use crate::rules::Rule;

const CR1: u32 = 0x00;
const SR: u32 = 0x10;
const EGR: u32 = 0x14;
const CCMR1: u32 = 0x18;
const CCER: u32 = 0x20;
const CNT: u32 = 0x24;
const PSC: u32 = 0x28;
const ARR: u32 = 0x2C;
const CCR1: u32 = 0x34;
const BDTR: u32 = 0x44;
const AF1: u32 = 0x60;

const ENABLE: u32 = 1;
/// Counting up, edge-aligned, not one-shot.
const PLAIN: u32 = ENABLE | 1 << 1 | 1 << 2 | 1 << 7;
const ALL: u32 = u32::MAX;
const MOE: u32 = 1 << 15;
const BREAK_ENABLE: u32 = 1 << 12;
const BREAK_HIGH: u32 = 1 << 13;
const BREAK_FLAG: u32 = 1 << 7;

/// Of `BDTR`: the level of the lock, and the fields that level 1 and level 2 protect.
const LOCK: u32 = 3 << 8;
const LOCKED: [u32; 2] = [0x3FFF_70FF, 0xC00];

const REGISTERS: [Kept; 15] = [
    Kept { offset: CR1, reset: 0, mask: PLAIN | 0x300 },
    Kept { offset: 0x04, reset: 0, mask: 0x7F77 },
    Kept { offset: CCMR1, reset: 0, mask: 0x0101_FFFF },
    Kept { offset: CCMR1 + 4, reset: 0, mask: 0x0101_FFFF },
    Kept { offset: CCER, reset: 0, mask: 0x33_FFFF },
    Kept { offset: PSC, reset: 0, mask: 0xFFFF },
    Kept { offset: ARR, reset: 0xFFFF, mask: 0xFFFF },
    Kept { offset: 0x30, reset: 0, mask: 0xFFFF },
    Kept { offset: CCR1, reset: 0, mask: 0xFFFF },
    Kept { offset: CCR1 + 4, reset: 0, mask: 0xFFFF },
    Kept { offset: CCR1 + 8, reset: 0, mask: 0xFFFF },
    Kept { offset: CCR1 + 12, reset: 0, mask: 0xFFFF },
    Kept { offset: BDTR, reset: 0, mask: 0x0FFF_FFFF },
    Kept { offset: AF1, reset: 1, mask: 0x201 },
    Kept { offset: 0x64, reset: 1, mask: 0x201 },
];

/// The timer.
#[derive(Clone, Debug)]
pub struct Pwm {
    registers: Registers,
    flags: u32,
    /// Cycle at which the counter was zero, while it runs.
    origin: u64,
    /// In use until the next update: prescaler, period, compares.
    prescaler: u64,
    period: u64,
    compares: [u32; 4],
    /// Cycle of the next update event.
    update: u64,
    /// `BDTR` has been written: `LOCK` stays as it is.
    lock_settled: bool,
    broken: Option<Rule>,
    /// Level at the break input.
    pin: bool,
    /// Cycle at which the filter takes the break input for active.
    breaks: u64,
    /// A break by the chip itself: core locked up, supply low, flash damaged. It is not filtered.
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
            prescaler: 1,
            period: 0x1_0000,
            compares: [0; 4],
            update: u64::MAX,
            lock_settled: false,
            broken: None,
            pin,
            breaks: u64::MAX,
            system: false,
            frozen: false,
        }
    }

    fn runs(&self) -> bool {
        self.registers.get(CR1) & ENABLE != 0
    }

    /// Bits of a register that the lock protects.
    fn locked(&self, offset: u32) -> u32 {
        let level = self.registers.get(BDTR) >> 8 & 3;
        let from = |least: u32, bits: u32| if level >= least { bits } else { 0 };
        match offset {
            // Idle states of the outputs.
            0x04 => from(1, 0x0005_FF00),
            BDTR => from(1, LOCKED[0]) | from(2, LOCKED[1]),
            AF1 | 0x64 => from(1, ALL),
            // Polarities.
            CCER => from(2, 0x0022_AAAA),
            // Modes and preloads of the compares.
            CCMR1 | 0x1C => from(3, 0x0101_7878),
            _ => 0,
        }
    }

    fn mode(&self, channel: u32) -> u32 {
        let word = self.registers.get(CCMR1 + channel / 2 * 4) >> (channel % 2 * 8);
        word >> 4 & 7 | word >> 13 & 8
    }

    fn is_preloaded(&self, channel: u32) -> bool {
        let word = self.registers.get(CCMR1 + channel / 2 * 4);
        word >> (channel % 2 * 8 + 3) & 1 != 0
    }

    /// Part of the period in which channel `channel` (from 0) is high at its pin.
    pub fn duty(&self, channel: u32) -> f64 {
        let enable = self.registers.get(CCER) >> (4 * channel);
        if self.frozen || self.registers.get(BDTR) & MOE == 0 || enable & 1 == 0 {
            return 0.0;
        }
        let part = f64::from(self.compares[channel as usize]) / self.period as f64;
        let high = match (self.mode(channel), self.runs()) {
            (5, _) => 1.0,
            (6, true) => part.min(1.0),
            (7, true) => 1.0 - part.min(1.0),
            _ => 0.0,
        };
        if enable & 2 == 0 { high } else { 1.0 - high }
    }

    /// Sets the level at the break input's pin.
    pub fn set_break(&mut self, pin: bool, now: u64) {
        self.pin = pin;
        self.rearm(now);
    }

    /// Stands still, without an output, or goes on after so many cycles of that.
    pub const fn freeze(&mut self, frozen: bool, cycles: u64) {
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

    /// Loads the preloaded values: an update event.
    fn load(&mut self) {
        self.prescaler = u64::from(self.registers.get(PSC)) + 1;
        self.period = u64::from(self.registers.get(ARR)) + 1;
        for channel in 0..4 {
            self.compares[channel as usize] = self.registers.get(CCR1 + 4 * channel);
        }
        self.update = u64::MAX;
    }

    fn next_update(&self, now: u64) -> u64 {
        let cycles = self.prescaler * self.period;
        self.origin + ((now - self.origin) / cycles + 1) * cycles
    }

    /// Applies a write to period or compare, at once or with the next update.
    fn renew(&mut self, offset: u32, now: u64) {
        let channel = offset.wrapping_sub(CCR1) / 4;
        let waits = match offset {
            PSC => true,
            ARR => self.registers.get(CR1) >> 7 & 1 != 0,
            _ => self.is_preloaded(channel),
        };
        if waits {
            if self.runs() {
                self.update = self.next_update(now);
            }
        } else if offset == ARR {
            self.period = u64::from(self.registers.get(ARR)) + 1;
        } else {
            self.compares[channel as usize] = self.registers.get(offset);
        }
    }
}

impl Peripheral for Pwm {
    fn read(&mut self, offset: u32, now: u64) -> Option<u32> {
        match offset {
            SR => Some(self.flags),
            EGR => Some(0),
            CNT if self.runs() => Some(((now - self.origin) / self.prescaler % self.period) as u32),
            CNT => Some(0),
            _ => self.registers.read(offset),
        }
    }

    fn write(&mut self, offset: u32, mut write: Write, now: u64) -> Option<()> {
        if let Some(old) = self.registers.read(offset) {
            let changed = write.onto(old) ^ old;
            let locked = self.locked(offset);
            let settled = if offset == BDTR && self.lock_settled { LOCK } else { 0 };
            self.broken = match (changed & locked != 0, changed & settled != 0) {
                (true, _) => Some(Rule::TimerLock),
                (_, true) => Some(Rule::TimerLockOnce),
                _ => None,
            };
            write.mask &= !(locked | settled);
            self.lock_settled |= offset == BDTR;
        }
        match offset {
            SR => self.flags &= !(write.mask & !write.value),
            CNT => self.origin = now.wrapping_sub(u64::from(write.value) * self.prescaler),
            EGR if write.ones() & !1 == 0 => {
                if write.ones() & 1 != 0 {
                    self.load();
                    self.origin = now;
                }
            }
            CR1 if write.ones() & !(PLAIN | 0x300) == 0 => {
                let ran = self.runs();
                self.registers.write(CR1, write)?;
                if self.runs() && !ran {
                    self.origin = now;
                    self.update = self.next_update(now);
                }
            }
            EGR | CR1 => return None,
            BDTR => {
                let held = self.registers.get(BDTR) & MOE;
                self.registers.write(BDTR, write)?;
                let broken = self.is_break_active() && self.breaks <= now;
                let active = self.is_system_break() || broken;
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
            PSC | ARR | 0x34..=0x40 => {
                self.registers.write(offset, write)?;
                self.renew(offset, now);
            }
            _ => self.registers.write(offset, write)?,
        }
        Some(())
    }

    fn take_broken_rule(&mut self) -> Option<Rule> {
        self.broken.take()
    }

    fn deadline(&self) -> u64 {
        let trips = self.registers.get(BDTR) & MOE != 0;
        self.update.min(if trips { self.breaks } else { u64::MAX })
    }

    fn advance(&mut self, now: u64) {
        if self.update <= now {
            self.load();
        }
        if self.breaks <= now && self.registers.get(BDTR) & MOE != 0 {
            self.registers.set(BDTR, self.registers.get(BDTR) & !MOE);
            self.flags |= BREAK_FLAG;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD: u64 = 8500;

    fn write(timer: &mut Pwm, offset: u32, value: u32, now: u64) {
        timer.write(offset, Write { value, mask: ALL }, now).expect("modelled");
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
        timer.advance(timer.deadline());
        write(&mut timer, CCR1, 2125, 3 * PERIOD + 100);
        assert_eq!(timer.duty(0), 0.0);
        assert_eq!(timer.deadline(), 4 * PERIOD);
        timer.advance(4 * PERIOD);
        assert_eq!(timer.duty(0), 0.25);
        assert_eq!(timer.duty(1), 0.0, "another channel");
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
        assert_eq!(timer.duty(0), 0.0);
    }
}
