//! One converter: its registers, and its conversions in their times.

use super::{CFGR, CFGR2, CR, DR, ISR, JDR, JSQR, SMPR1, SQR1};
use crate::peripherals::registers::{Kept, Registers};
use crate::peripherals::{HZ, Write};
use crate::rules::Rule;

const ALL: u32 = u32::MAX;

/// Of the configuration: DMA, keep the newest code, one conversion after the other.
pub(super) const DMA: u32 = 1;
pub(super) const OVERWRITE: u32 = 1 << 12;
pub(super) const CONTINUOUS: u32 = 1 << 13;

pub(super) const ENABLE: u32 = 1;
pub(super) const DISABLE: u32 = 1 << 1;
pub(super) const START: u32 = 1 << 2;
pub(super) const INJECT: u32 = 1 << 3;
pub(super) const STOP: u32 = 1 << 4;
pub(super) const REGULATOR: u32 = 1 << 28;
pub(super) const DEEP: u32 = 1 << 29;
pub(super) const CALIBRATE: u32 = 1 << 31;
pub(super) const READY: u32 = 1;
pub(super) const END: u32 = 1 << 2;
pub(super) const END_OF_SEQUENCE: u32 = 1 << 3;
pub(super) const OVERRUN: u32 = 1 << 4;
pub(super) const INJECTED: u32 = 1 << 5;
pub(super) const INJECTED_SEQUENCE: u32 = 1 << 6;
/// Oversampling of regular and of injected conversions.
pub(super) const OVERSAMPLED: u32 = 1;
pub(super) const INJECTED_OVERSAMPLED: u32 = 1 << 1;
/// Converter clocks that a calibration takes, from its end to the enabling, and from the enabling
/// to `ADRDY`: a conversion.
pub(super) const CALIBRATION: u64 = 116;
pub(super) const REST: u64 = 4;
pub(super) const STABILISATION: u64 = 15;
/// Core cycles that the regulator takes to start: 20 us.
pub(super) const REGULATOR_START: u64 = 20 * (HZ / 1_000_000);
/// Highest clock of a converter, Hz.
pub(super) const HIGHEST_CLOCK: u64 = 60_000_000;

/// IER, CFGR, CFGR2, sampling times, watchdogs, sequences, DIFSEL, CALFACT.
const REGISTERS: [Kept; 14] = [
    Kept { offset: 0x04, reset: 0, mask: 0x7FF },
    Kept { offset: CFGR, reset: 0x8000_0000, mask: ALL },
    Kept { offset: CFGR2, reset: 0, mask: 0x0E0F_07FF },
    Kept { offset: SMPR1, reset: 0, mask: 0xBFFF_FFFF },
    Kept { offset: SMPR1 + 4, reset: 0, mask: 0x07FF_FFFF },
    Kept { offset: 0x20, reset: 0x0FFF_0000, mask: 0x0FFF_7FFF },
    Kept { offset: 0x24, reset: 0x00FF_0000, mask: 0x00FF_00FF },
    Kept { offset: 0x28, reset: 0x00FF_0000, mask: 0x00FF_00FF },
    Kept { offset: SQR1, reset: 0, mask: 0x1F7D_F7CF },
    Kept { offset: SQR1 + 4, reset: 0, mask: 0x1F7D_F7DF },
    Kept { offset: SQR1 + 8, reset: 0, mask: 0x1F7D_F7DF },
    Kept { offset: SQR1 + 12, reset: 0, mask: 0x7DF },
    Kept { offset: 0xB0, reset: 0, mask: 0x0007_FFFF },
    Kept { offset: 0xB4, reset: 0, mask: 0x007F_007F },
];

#[derive(Clone, Debug)]
pub(super) struct Converter {
    pub(super) registers: Registers,
    pub(super) control: u32,
    pub(super) flags: u32,
    pub(super) data: u32,
    /// Cycle at which the current calibration or conversion is done.
    pub(super) done: u64,
    /// The current injected conversion: rank, and cycle at which it is done.
    pub(super) injected: Option<(usize, u64)>,
    pub(super) injected_data: [u32; 4],
    /// Cycles at which the regulator has started, a rest after the calibration is over, and the
    /// converter is ready; never while it is off.
    pub(super) regulated: u64,
    pub(super) rested: u64,
    pub(super) ready: u64,
    pub(super) calibrated: bool,
    pub(super) broken: Option<Rule>,
}

impl Converter {
    pub(super) fn new() -> Self {
        Self {
            registers: Registers::new(&REGISTERS, &[JSQR], &[0xA0, 0xA4]),
            control: DEEP,
            flags: 0,
            data: 0,
            done: u64::MAX,
            injected: None,
            injected_data: [0; 4],
            regulated: u64::MAX,
            rested: 0,
            ready: u64::MAX,
            calibrated: false,
            broken: None,
        }
    }

    pub(super) const fn is_enabled(&self) -> bool {
        self.control & ENABLE != 0
    }

    pub(super) const fn converts(&self) -> bool {
        self.control & (START | INJECT) != 0
    }

    /// The rule that these commands would break.
    pub(super) fn broken_command(&self, ones: u32, clock: u64, now: u64) -> Option<Rule> {
        let enabling = ones & ENABLE != 0 && !self.is_enabled();
        let calibrating = ones & CALIBRATE != 0;
        let starting = ones & (START | INJECT) & !self.control != 0;
        if (enabling || calibrating) && now < self.regulated {
            Some(Rule::AdcRegulator)
        } else if calibrating && self.is_enabled() || enabling && !self.calibrated {
            Some(Rule::AdcCalibration)
        } else if enabling && (self.control & CALIBRATE != 0 || now < self.rested) {
            Some(Rule::AdcEnable)
        } else if starting && (!self.is_enabled() || now < self.ready) {
            Some(Rule::AdcReady)
        } else if ones & DISABLE != 0 && self.converts() {
            Some(Rule::AdcDisable)
        } else if starting && HZ / clock > HIGHEST_CLOCK {
            Some(Rule::AdcClock)
        } else {
            None
        }
    }

    /// Writes to a configuration register.
    pub(super) fn configure(&mut self, offset: u32, write: Write) -> Option<()> {
        let old = self.registers.read(offset)?;
        let changes = write.onto(old) != old;
        self.broken = match offset {
            // The queue of injected conversions is not written while they run.
            JSQR if changes && self.control & INJECT != 0 => Some(Rule::AdcConfiguration),
            // Interrupts, the queue and calibration factors have rules of their own.
            0x04 | JSQR | 0xB4 => None,
            0xB0 if changes && self.is_enabled() => Some(Rule::AdcDisabledOnly),
            _ if changes && self.converts() => Some(Rule::AdcConfiguration),
            _ => None,
        };
        if self.broken.is_some() { Some(()) } else { self.registers.write(offset, write) }
    }

    /// Channel of the regular conversion, or of the injected one of this rank.
    pub(super) fn channel(&self, rank: Option<usize>) -> u32 {
        match rank {
            None => self.registers.get(SQR1) >> 6 & 0x1F,
            Some(rank) => self.registers.get(JSQR) >> (9 + 6 * rank) & 0x1F,
        }
    }

    /// Whether a code is made of several conversions.
    pub(super) fn is_oversampled(&self, rank: Option<usize>) -> bool {
        let bit = if rank.is_some() { INJECTED_OVERSAMPLED } else { OVERSAMPLED };
        self.registers.get(CFGR2) & bit != 0
    }

    /// Conversions that make one code.
    pub(super) fn ratio(&self, rank: Option<usize>) -> u64 {
        if self.is_oversampled(rank) { 2 << (self.registers.get(CFGR2) >> 2 & 7) } else { 1 }
    }

    /// Half clocks of the converter that one conversion into 12 bits takes: sampling and
    /// 12.5 clocks.
    pub(super) fn half_clocks(&self, rank: Option<usize>) -> u64 {
        const SAMPLING: [u64; 8] = [5, 13, 25, 49, 95, 185, 495, 1281];
        let channel = self.channel(rank);
        let word = self.registers.get(SMPR1 + channel / 10 * 4);
        SAMPLING[(word >> (channel % 10 * 3) & 7) as usize] + 25
    }

    /// Cycles of the core that a code takes.
    pub(super) fn cycles(&self, rank: Option<usize>, clock: u64) -> u64 {
        (self.ratio(rank) * self.half_clocks(rank) * clock).div_ceil(2)
    }

    /// The code of `sixteen`, the voltage at the pin in parts of 2^16 of the reference.
    ///
    /// The noise at a real pin exceeds a step of 12 bits, so that the mean of many conversions
    /// has a finer resolution; here the sum is exact to one part of 2^16.
    pub(super) fn code(&self, rank: Option<usize>, sixteen: u16) -> u32 {
        let setting = self.registers.get(CFGR2);
        let sum = u64::from(sixteen) * self.ratio(rank) / 16;
        let shift = if self.is_oversampled(rank) { setting >> 5 & 0xF } else { 0 };
        (sum >> shift) as u32 & 0xFFFF
    }

    pub(super) fn write_control(&mut self, write: Write, clock: u64, now: u64) -> Option<()> {
        let ones = write.ones();
        let known = ENABLE | DISABLE | START | INJECT | STOP | REGULATOR | DEEP | 1 << 30;
        if ones & !(known | CALIBRATE) != 0 {
            return None;
        }
        self.broken = self.broken_command(ones, clock, now);
        if self.broken.is_some() {
            return Some(());
        }
        let level = REGULATOR | DEEP | 1 << 30;
        self.control = self.control & !level | write.onto(self.control) & level;
        if self.control & DEEP != 0 {
            self.calibrated = false;
        }
        if self.control & (REGULATOR | DEEP) != REGULATOR {
            self.regulated = u64::MAX;
        } else if self.regulated == u64::MAX {
            self.regulated = now + REGULATOR_START;
        }
        let ready = self.control & REGULATOR != 0 && self.control & DEEP == 0;
        let idle = self.control & (START | INJECT | CALIBRATE) == 0;
        if ones & CALIBRATE != 0 && ready && self.control & ENABLE == 0 {
            self.control |= CALIBRATE;
            self.done = now + CALIBRATION * clock;
        }
        if ones & ENABLE != 0 && ready && idle && !self.is_enabled() {
            self.control |= ENABLE;
            self.ready = now + STABILISATION * clock;
        }
        if ones & DISABLE != 0 && idle {
            self.control &= !ENABLE;
            self.ready = u64::MAX;
        }
        if ones & STOP != 0 {
            self.control &= !START;
            self.done = u64::MAX;
        }
        if ones & START != 0 && self.control & ENABLE != 0 && idle {
            // A sequence of several, or started by hardware, is not modelled.
            let (sequence, config) = (self.registers.get(SQR1), self.registers.get(CFGR));
            if sequence & 0xF != 0 || config & (3 << 10 | 3 << 3) != 0 {
                return None;
            }
            self.control |= START;
            self.done = now + self.cycles(None, clock);
        }
        if ones & INJECT != 0 && self.control & (ENABLE | INJECT) == ENABLE {
            // Between regular ones, or started by hardware, is not modelled.
            if !idle || self.registers.get(JSQR) & (3 << 7) != 0 {
                return None;
            }
            self.control |= INJECT;
            self.injected = Some((0, now + self.cycles(Some(0), clock)));
        }
        Some(())
    }

    pub(super) fn read(&mut self, offset: u32, now: u64) -> Option<u32> {
        self.settle(now);
        match offset {
            ISR => Some(self.flags),
            CR => Some(self.control),
            DR => {
                self.flags &= !END;
                Some(self.data)
            }
            JDR..=0x8C => self.injected_data.get((offset - JDR) as usize / 4).copied(),
            _ => self.registers.read(offset),
        }
    }

    /// Sets `ADRDY` once, when the converter has become ready.
    pub(super) const fn settle(&mut self, now: u64) {
        if self.ready <= now && self.ready != 0 {
            self.ready = 0;
            self.flags |= READY;
        }
    }

    /// The injected conversion of this rank is done, with this at its channel.
    pub(super) fn finish_injected(&mut self, rank: usize, done: u64, voltage: u16, clock: u64) {
        self.injected_data[rank] = self.code(Some(rank), voltage);
        self.flags |= INJECTED;
        let last = self.registers.get(JSQR) as usize & 3;
        if rank < last {
            self.injected = Some((rank + 1, done + self.cycles(Some(rank + 1), clock)));
        } else {
            self.injected = None;
            self.control &= !INJECT;
            self.flags |= INJECTED_SEQUENCE;
        }
    }

    /// The current calibration or conversion is done, with this voltage at its channel.
    pub(super) fn finish(&mut self, voltage: u16, clock: u64) {
        let done = std::mem::replace(&mut self.done, u64::MAX);
        if self.control & CALIBRATE != 0 {
            self.control &= !CALIBRATE;
            self.calibrated = true;
            self.rested = done + REST * clock;
            return;
        }
        let config = self.registers.get(CFGR);
        if config & CONTINUOUS != 0 {
            self.done = done + self.cycles(None, clock);
        } else {
            self.control &= !START;
        }
        if self.flags & END != 0 {
            self.flags |= OVERRUN;
            // Without `OVRMOD` the old code is kept.
            if config & OVERWRITE == 0 {
                return;
            }
        }
        self.data = self.code(None, voltage);
        self.flags |= END | END_OF_SEQUENCE;
    }

    /// Whether it requests DMA; after an overrun not until the flag is cleared.
    pub(super) const fn wants_dma(&self, config: u32) -> bool {
        config & DMA != 0 && self.flags & (END | OVERRUN) == END
    }
}
