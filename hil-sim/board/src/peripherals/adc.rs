//! A pair of analogue converters, ADC1 and ADC2 or ADC3 and ADC4, with their common
//! registers.
//!
//! Modelled: regulator, calibration, software start, regular conversions of one channel,
//! single or continuous, with sampling time and oversampling, DMA requests, overrun; on a
//! converter without regular ones, injected conversions of up to four channels. The code is
//! that of the voltage at the end of the conversion.
//!
//! Source: RM0440, 21.4.6 to 21.4.10 (what may follow what) and the registers; DS12288, ADC
//! characteristics (times).

use super::registers::{Kept, Registers};
use super::{HZ, Peripheral, Write};
use crate::rules::Rule;

const ISR: u32 = 0x00;
const CR: u32 = 0x08;
const CFGR: u32 = 0x0C;
const CFGR2: u32 = 0x10;
const SMPR1: u32 = 0x14;
const SQR1: u32 = 0x30;
const JSQR: u32 = 0x4C;
/// First of the four data registers of the injected conversions.
const JDR: u32 = 0x80;
/// Data register.
pub(crate) const DR: u32 = 0x40;
const COMMON: u32 = 0x300;
const CCR: u32 = 0x308;

const ALL: u32 = u32::MAX;

/// Of the configuration: DMA, keep the newest code, one conversion after the other.
const DMA: u32 = 1;
const OVERWRITE: u32 = 1 << 12;
const CONTINUOUS: u32 = 1 << 13;

const ENABLE: u32 = 1;
const DISABLE: u32 = 1 << 1;
const START: u32 = 1 << 2;
const INJECT: u32 = 1 << 3;
const STOP: u32 = 1 << 4;
const REGULATOR: u32 = 1 << 28;
const DEEP: u32 = 1 << 29;
const CALIBRATE: u32 = 1 << 31;
const READY: u32 = 1;
const END: u32 = 1 << 2;
const END_OF_SEQUENCE: u32 = 1 << 3;
const OVERRUN: u32 = 1 << 4;
const INJECTED: u32 = 1 << 5;
const INJECTED_SEQUENCE: u32 = 1 << 6;
/// Oversampling of regular and of injected conversions.
const OVERSAMPLED: u32 = 1;
const INJECTED_OVERSAMPLED: u32 = 1 << 1;
/// Converter clocks that a calibration takes, from its end to the enabling, and from the enabling
/// to `ADRDY`: a conversion.
const CALIBRATION: u64 = 116;
const REST: u64 = 4;
const STABILISATION: u64 = 15;
/// Core cycles that the regulator takes to start: 20 us.
const REGULATOR_START: u64 = 20 * (HZ / 1_000_000);
/// Highest clock of a converter, Hz.
const HIGHEST_CLOCK: u64 = 60_000_000;

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

/// One converter.
#[derive(Clone, Debug)]
struct Converter {
    registers: Registers,
    control: u32,
    flags: u32,
    data: u32,
    /// Cycle at which the current calibration or conversion is done.
    done: u64,
    /// The current injected conversion: rank, and cycle at which it is done.
    injected: Option<(usize, u64)>,
    injected_data: [u32; 4],
    /// Cycles at which the regulator has started, a rest after the calibration is over, and the
    /// converter is ready; never while it is off.
    regulated: u64,
    rested: u64,
    ready: u64,
    calibrated: bool,
    broken: Option<Rule>,
}

impl Converter {
    fn new() -> Self {
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

    const fn is_enabled(&self) -> bool {
        self.control & ENABLE != 0
    }

    const fn converts(&self) -> bool {
        self.control & (START | INJECT) != 0
    }

    /// The rule that these commands would break.
    fn broken_command(&self, ones: u32, clock: u64, now: u64) -> Option<Rule> {
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
    fn configure(&mut self, offset: u32, write: Write) -> Option<()> {
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
    fn channel(&self, rank: Option<usize>) -> u32 {
        match rank {
            None => self.registers.get(SQR1) >> 6 & 0x1F,
            Some(rank) => self.registers.get(JSQR) >> (9 + 6 * rank) & 0x1F,
        }
    }

    /// Whether a code is made of several conversions.
    fn is_oversampled(&self, rank: Option<usize>) -> bool {
        let bit = if rank.is_some() { INJECTED_OVERSAMPLED } else { OVERSAMPLED };
        self.registers.get(CFGR2) & bit != 0
    }

    /// Conversions that make one code.
    fn ratio(&self, rank: Option<usize>) -> u64 {
        if self.is_oversampled(rank) { 2 << (self.registers.get(CFGR2) >> 2 & 7) } else { 1 }
    }

    /// Half clocks of the converter that one conversion into 12 bits takes: sampling and
    /// 12.5 clocks.
    fn half_clocks(&self, rank: Option<usize>) -> u64 {
        const SAMPLING: [u64; 8] = [5, 13, 25, 49, 95, 185, 495, 1281];
        let channel = self.channel(rank);
        let word = self.registers.get(SMPR1 + channel / 10 * 4);
        SAMPLING[(word >> (channel % 10 * 3) & 7) as usize] + 25
    }

    /// Cycles of the core that a code takes.
    fn cycles(&self, rank: Option<usize>, clock: u64) -> u64 {
        (self.ratio(rank) * self.half_clocks(rank) * clock).div_ceil(2)
    }

    /// The code of `sixteen`, the voltage at the pin in parts of 2^16 of the reference.
    ///
    /// The noise at a real pin exceeds a step of 12 bits, so that the mean of many conversions
    /// has a finer resolution; here the sum is exact to one part of 2^16.
    fn code(&self, rank: Option<usize>, sixteen: u16) -> u32 {
        let setting = self.registers.get(CFGR2);
        let sum = u64::from(sixteen) * self.ratio(rank) / 16;
        let shift = if self.is_oversampled(rank) { setting >> 5 & 0xF } else { 0 };
        (sum >> shift) as u32 & 0xFFFF
    }

    fn write_control(&mut self, write: Write, clock: u64, now: u64) -> Option<()> {
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

    fn read(&mut self, offset: u32, now: u64) -> Option<u32> {
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
    const fn settle(&mut self, now: u64) {
        if self.ready <= now && self.ready != 0 {
            self.ready = 0;
            self.flags |= READY;
        }
    }

    /// The injected conversion of this rank is done, with this at its channel.
    fn finish_injected(&mut self, rank: usize, done: u64, voltage: u16, clock: u64) {
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
    fn finish(&mut self, voltage: u16, clock: u64) {
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
    const fn wants_dma(&self, config: u32) -> bool {
        config & DMA != 0 && self.flags & (END | OVERRUN) == END
    }
}

/// The pair.
#[derive(Clone, Debug)]
pub struct Adc {
    converters: [Converter; 2],
    common: u32,
    /// Codes of 16 bits at the inputs: converter, channel.
    inputs: [[u16; 20]; 2],
    broken: Option<Rule>,
}

impl Default for Adc {
    fn default() -> Self {
        let converters = [Converter::new(), Converter::new()];
        Self { converters, common: 0, inputs: [[0; 20]; 2], broken: None }
    }
}

impl Adc {
    /// Sets the voltage at a converter's input, in parts of 2^16 of the reference.
    pub fn set_input(&mut self, converter: usize, channel: usize, sixteen: u16) {
        self.inputs[converter][channel] = sixteen;
    }

    /// Whether a converter requests DMA.
    pub fn wants_dma(&self, converter: usize) -> bool {
        let converter = &self.converters[converter];
        converter.wants_dma(converter.registers.get(CFGR))
    }

    /// Cycles of the core in a clock of the converters.
    fn clock(&self) -> u64 {
        const PRESCALERS: [u64; 12] = [1, 2, 4, 6, 8, 10, 12, 16, 32, 64, 128, 256];
        match self.common >> 16 & 3 {
            0 => PRESCALERS.get((self.common >> 18 & 0xF) as usize).copied().unwrap_or(256),
            mode => 1 << (mode - 1),
        }
    }
}

impl Peripheral for Adc {
    fn read(&mut self, offset: u32, now: u64) -> Option<u32> {
        match offset {
            CCR => Some(self.common),
            0..COMMON => self.converters.get_mut((offset >> 8) as usize)?.read(offset & 0xFF, now),
            _ => None,
        }
    }

    fn write(&mut self, offset: u32, write: Write, now: u64) -> Option<()> {
        if offset == CCR {
            let next = write.onto(self.common);
            if next != self.common && self.converters.iter().any(Converter::is_enabled) {
                self.broken = Some(Rule::AdcDisabledOnly);
            } else {
                self.common = next;
            }
            return Some(());
        }
        let clock = self.clock();
        let converter = self.converters.get_mut((offset >> 8) as usize)?;
        match offset & 0xFF {
            ISR => {
                converter.settle(now);
                converter.flags &= !write.ones();
                Some(())
            }
            CR => converter.write_control(write, clock, now),
            offset => converter.configure(offset, write),
        }
    }

    fn take_broken_rule(&mut self) -> Option<Rule> {
        let own = self.converters.iter_mut().find_map(|converter| converter.broken.take());
        own.or(self.broken.take())
    }

    fn deadline(&self) -> u64 {
        let due = |converter: &Converter| {
            converter.injected.map_or(converter.done, |(_, done)| done.min(converter.done))
        };
        due(&self.converters[0]).min(due(&self.converters[1]))
    }

    fn advance(&mut self, now: u64) {
        let clock = self.clock();
        for (converter, inputs) in self.converters.iter_mut().zip(&self.inputs) {
            while converter.done <= now {
                let channel = converter.channel(None) as usize;
                converter.finish(inputs.get(channel).copied().unwrap_or(0), clock);
            }
            while let Some((rank, done)) = converter.injected.filter(|(_, done)| *done <= now) {
                let channel = converter.channel(Some(rank)) as usize;
                let voltage = inputs.get(channel).copied().unwrap_or(0);
                converter.finish_injected(rank, done, voltage, clock);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn write(adc: &mut Adc, offset: u32, value: u32, now: u64) -> Option<()> {
        adc.write(offset, Write { value, mask: ALL }, now)
    }

    /// A cycle after which a converter that was started at cycle 0 is ready.
    const BEGIN: u64 = 5_000;

    /// Regulator, calibration, enabling, each in its time.
    fn start(adc: &mut Adc, base: u32) {
        write(adc, base + CR, REGULATOR, 0).expect("modelled");
        write(adc, base + CR, REGULATOR | CALIBRATE, REGULATOR_START).expect("modelled");
        adc.advance(adc.deadline());
        let rested = REGULATOR_START + (CALIBRATION + REST) * adc.clock();
        write(adc, base + CR, REGULATOR | ENABLE, rested).expect("modelled");
        assert_eq!(adc.take_broken_rule(), None);
        let flags = adc.read(base + ISR, BEGIN).expect("modelled");
        assert_eq!(flags & READY, READY);
    }

    /// ADC2 on channel 9, 256 conversions of 12.5 + 12.5 clocks at a quarter of the
    /// core's, DMA on.
    fn ready() -> Adc {
        let mut adc = Adc::default();
        write(&mut adc, CCR, 2 << 18, 0).expect("modelled");
        start(&mut adc, 0x100);
        for (offset, value) in [
            (0x100 + CFGR, 1),
            (0x100 + CFGR2, 0x9D),
            (0x100 + SMPR1, 2 << 27),
            (0x100 + SQR1, 9 << 6),
        ] {
            write(&mut adc, offset, value, BEGIN).expect("modelled");
        }
        adc
    }

    #[test]
    fn a_code_is_the_mean_of_its_conversions_and_takes_their_time() {
        let mut adc = ready();
        adc.set_input(1, 9, 51_234);
        write(&mut adc, 0x100 + CR, REGULATOR | START, BEGIN).expect("modelled");
        let due = BEGIN + 256 * 25 * 4;
        assert_eq!(adc.deadline(), due);
        adc.advance(due - 1);
        assert!(!adc.wants_dma(1));
        adc.advance(due);
        assert!(adc.wants_dma(1) && !adc.wants_dma(0));
        assert_eq!(adc.read(0x100 + DR, due), Some(51_234));
        assert!(!adc.wants_dma(1));
    }

    #[test]
    fn without_oversampling_there_are_twelve_bits() {
        let mut adc = ready();
        write(&mut adc, 0x100 + CFGR2, 0, 0).expect("modelled");
        adc.set_input(1, 9, 51_234);
        write(&mut adc, 0x100 + CR, REGULATOR | START, BEGIN).expect("modelled");
        adc.advance(adc.deadline());
        assert_eq!(adc.read(0x100 + DR, 0), Some(51_234 / 16));
    }

    #[test]
    fn a_code_that_is_not_read_is_kept_and_the_next_is_lost() {
        let mut adc = ready();
        for code in [1600, 3200] {
            adc.set_input(1, 9, code);
            write(&mut adc, 0x100 + CR, REGULATOR | START, BEGIN).expect("modelled");
            adc.advance(adc.deadline());
        }
        assert_eq!(adc.read(0x100 + ISR, 0).map(|flags| flags & OVERRUN), Some(OVERRUN));
        assert_eq!(adc.read(0x100 + DR, 0), Some(1600));
    }

    #[test]
    fn without_end_one_code_follows_the_other() {
        let mut adc = ready();
        write(&mut adc, 0x100 + CFGR, DMA | CONTINUOUS, 0).expect("modelled");
        write(&mut adc, 0x100 + CR, REGULATOR | START, BEGIN).expect("modelled");
        for round in 1..4 {
            let due = BEGIN + round * 256 * 25 * 4;
            assert_eq!(adc.deadline(), due);
            adc.set_input(1, 9, 100 * round as u16);
            // A delayed update does not delay the next code.
            adc.advance(due + 17);
            assert_eq!(adc.read(0x100 + DR, due), Some(100 * round as u32));
        }
        write(&mut adc, 0x100 + CR, REGULATOR | STOP, 90_000).expect("modelled");
        assert_eq!(adc.deadline(), u64::MAX);
    }

    #[test]
    fn after_an_overrun_it_requests_dma_only_when_the_flag_is_cleared() {
        let mut adc = ready();
        write(&mut adc, 0x100 + CFGR, DMA | CONTINUOUS, 0).expect("modelled");
        write(&mut adc, 0x100 + CR, REGULATOR | START, BEGIN).expect("modelled");
        adc.advance(adc.deadline());
        assert!(adc.wants_dma(1));
        adc.advance(adc.deadline());
        assert!(!adc.wants_dma(1));
        write(&mut adc, 0x100 + ISR, OVERRUN, 0).expect("modelled");
        assert!(adc.wants_dma(1));
    }

    #[test]
    fn calibration_wants_the_regulator_and_its_time() {
        let mut adc = Adc::default();
        write(&mut adc, CR, CALIBRATE | DEEP, 0).expect("modelled");
        assert_eq!(adc.read(CR, 0).map(|control| control & CALIBRATE), Some(0));
        write(&mut adc, CR, REGULATOR, 0).expect("modelled");
        write(&mut adc, CR, REGULATOR | CALIBRATE, BEGIN).expect("modelled");
        assert_eq!(adc.deadline(), BEGIN + CALIBRATION);
        adc.advance(BEGIN + CALIBRATION);
        assert_eq!(adc.read(CR, 0), Some(REGULATOR));
    }

    #[test]
    fn injected_conversions_follow_one_another_into_registers_of_their_own() {
        let mut adc = Adc::default();
        write(&mut adc, CCR, 2 << 18, 0).expect("modelled");
        start(&mut adc, 0);
        for (offset, value) in [
            (CFGR2, 8 << 5 | 7 << 2 | INJECTED_OVERSAMPLED),
            (SMPR1, 2 << 3),
            (SMPR1 + 4, 2 << 6),
            (JSQR, 12 << 9 | 1 << 15 | 1),
        ] {
            write(&mut adc, offset, value, 0).expect("modelled");
        }
        adc.set_input(0, 12, 4095 << 4);
        adc.set_input(0, 1, 1234 << 4);
        write(&mut adc, CR, REGULATOR | INJECT, BEGIN).expect("modelled");
        let each = 256 * 25 * 4;
        assert_eq!(adc.deadline(), BEGIN + each);
        adc.advance(BEGIN + each);
        let flags = |adc: &mut Adc| adc.read(ISR, 0).map(|f| f & (INJECTED | INJECTED_SEQUENCE));
        assert_eq!(flags(&mut adc), Some(INJECTED));
        adc.advance(adc.deadline());
        assert_eq!(flags(&mut adc), Some(INJECTED | INJECTED_SEQUENCE));
        assert_eq!((adc.read(JDR, 0), adc.read(JDR + 4, 0)), (Some(4095), Some(1234)));
        assert_eq!(adc.read(CR, 0).map(|control| control & INJECT), Some(0));
        assert_eq!(adc.deadline(), u64::MAX);
        write(&mut adc, ISR, INJECTED_SEQUENCE, 0).expect("modelled");
        assert_eq!(flags(&mut adc), Some(INJECTED));
        // Beside regular ones they are not modelled.
        write(&mut adc, CFGR, CONTINUOUS, 0).expect("modelled");
        write(&mut adc, CR, REGULATOR | START, BEGIN).expect("modelled");
        assert_eq!(write(&mut adc, CR, REGULATOR | INJECT, BEGIN), None);
    }

    #[test]
    fn a_sequence_is_not_modelled() {
        let mut adc = ready();
        write(&mut adc, 0x100 + SQR1, 9 << 6 | 1, 0).expect("modelled");
        assert_eq!(write(&mut adc, 0x100 + CR, REGULATOR | START, BEGIN), None);
    }
}
