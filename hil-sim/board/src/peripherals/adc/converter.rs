//! One converter: its registers, and its conversions in their times.

use crate::description::{ADC1, Field, adc1::*, bits};
use crate::peripherals::registers::Registers;
use crate::peripherals::{HZ, Why, Write};
use crate::rules::Rule;

/// Converter clocks that a calibration takes, from its end to the enabling, and from the enabling
/// to `ADRDY`: a conversion.
const CALIBRATION: u64 = 116;
const REST: u64 = 4;
const STABILISATION: u64 = 15;
/// Core cycles that the regulator takes to start: 20 us.
const REGULATOR_START: u64 = 20 * (HZ / 1_000_000);
/// Highest clock of a converter, Hz.
const HIGHEST_CLOCK: u64 = 60_000_000;

/// Registers that the model has whole.
const WHOLE: [u32; 22] = [
    ISR, IER, CR, CFGR, CFGR2, SMPR1, SMPR2, TR1, TR2, TR3, SQR1, SQR2, SQR3, SQR4, DR, JSQR, JDR1,
    JDR2, JDR3, JDR4, DIFSEL, CALFACT,
];

/// Commands under way, of the control register.
const CONVERTS: u32 = bits(&[cr::ADSTART, cr::JADSTART]);

/// What is added to the voltage at an input at a cycle, parts of 2^16 of the reference.
pub type Errors<'a> = &'a dyn Fn(u64) -> i32;

#[derive(Clone, Debug)]
pub(super) struct Converter {
    pub(super) registers: Registers,
    /// Cycle at which the current calibration or conversion is done.
    pub(super) done: u64,
    /// The current injected conversion: rank, and cycle at which it is done.
    pub(super) injected: Option<(usize, u64)>,
    /// Cycles at which the regulator has started, a rest after the calibration is over, and the
    /// converter is ready; never while it is off.
    pub(super) regulated: u64,
    pub(super) rested: u64,
    pub(super) ready: u64,
    pub(super) calibrated: bool,
}

impl Converter {
    pub(super) fn new() -> Self {
        Self {
            registers: Registers::of(ADC1, &WHOLE, &[], &[AWD2CR, AWD3CR]),
            done: u64::MAX,
            injected: None,
            regulated: u64::MAX,
            rested: 0,
            ready: u64::MAX,
            calibrated: false,
        }
    }

    pub(super) fn is_enabled(&self) -> bool {
        self.registers.has(cr::ADEN)
    }

    fn converts(&self) -> bool {
        self.registers.get(CR) & CONVERTS != 0
    }

    /// The rule that these commands would break.
    fn broken_command(&self, ones: u32, clock: u64, now: u64) -> Option<Rule> {
        let enabling = cr::ADEN.is_in(ones) && !self.is_enabled();
        let calibrating = cr::ADCAL.is_in(ones);
        let starting = ones & CONVERTS & !self.registers.get(CR) != 0;
        if (enabling || calibrating) && now < self.regulated {
            Some(Rule::AdcRegulator)
        } else if calibrating && self.is_enabled() || enabling && !self.calibrated {
            Some(Rule::AdcCalibration)
        } else if enabling && (self.registers.has(cr::ADCAL) || now < self.rested) {
            Some(Rule::AdcEnable)
        } else if starting && (!self.is_enabled() || now < self.ready) {
            Some(Rule::AdcReady)
        } else if cr::ADDIS.is_in(ones) && self.converts() {
            Some(Rule::AdcDisable)
        } else if starting && HZ / clock > HIGHEST_CLOCK {
            Some(Rule::AdcClock)
        } else {
            None
        }
    }

    /// Writes to a configuration register.
    pub(super) fn configure(&mut self, offset: u32, write: Write) -> Result<(), Why> {
        let old = self.registers.read(offset).ok_or(Why::NoModel)?;
        let changes = write.onto(old) != old;
        let broken = match offset {
            DR | JDR1..=JDR4 => return Err(Why::NoModel),
            // The queue of injected conversions is not written while they run.
            JSQR if changes && self.registers.has(cr::JADSTART) => Some(Rule::AdcConfiguration),
            // Interrupts, the queue and calibration factors have rules of their own.
            IER | JSQR | CALFACT => None,
            DIFSEL if changes && self.is_enabled() => Some(Rule::AdcDisabledOnly),
            _ if changes && self.converts() => Some(Rule::AdcConfiguration),
            _ => None,
        };
        broken.map_or_else(|| self.registers.write(offset, write), |rule| Err(Why::Broken(rule)))
    }

    /// Channel of the regular conversion, or of the injected one of this rank.
    pub(super) fn channel(&self, rank: Option<usize>) -> u32 {
        const INJECTED: [Field; 4] = [jsqr::JSQ1, jsqr::JSQ2, jsqr::JSQ3, jsqr::JSQ4];
        self.registers.field(rank.map_or(sqr1::SQ1, |rank| INJECTED[rank]))
    }

    /// Whether a code is made of several conversions.
    pub(super) fn is_oversampled(&self, rank: Option<usize>) -> bool {
        self.registers.has(if rank.is_some() { cfgr2::JOVSE } else { cfgr2::ROVSE })
    }

    /// Conversions that make one code.
    pub(super) fn ratio(&self, rank: Option<usize>) -> u64 {
        if self.is_oversampled(rank) { 2 << self.registers.field(cfgr2::OVSR) } else { 1 }
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

    /// The code of `sixteen`, the voltage at the pin in parts of 2^16 of the reference, whose
    /// conversions end at `done`.
    ///
    /// The noise at a real pin exceeds a step of 12 bits, so that the mean of many conversions
    /// has a finer resolution; here the sum is exact to one part of 2^16. With `errors` there is no
    /// such noise: each conversion has 12 bits of the voltage and its error as sampling ends.
    pub(super) fn code(
        &self,
        rank: Option<usize>,
        sixteen: u16,
        (done, clock): (u64, u64),
        errors: Option<Errors<'_>>,
    ) -> u32 {
        let sum = match errors {
            None => u64::from(sixteen) * self.ratio(rank) / 16,
            Some(errors) => (0..self.ratio(rank))
                .map(|later| {
                    let half_clocks = later * self.half_clocks(rank) + 25;
                    let error = errors(done.saturating_sub(half_clocks * clock / 2));
                    (i64::from(sixteen) + i64::from(error)).clamp(0, 0xFFFF) as u64 / 16
                })
                .sum(),
        };
        let shift = if self.is_oversampled(rank) { self.registers.field(cfgr2::OVSS) } else { 0 };
        (sum >> shift) as u32 & 0xFFFF
    }

    pub(super) fn write_control(&mut self, write: Write, clock: u64, now: u64) -> Result<(), Why> {
        let ones = write.ones();
        let command = |field: Field| field.is_in(ones);
        // Stopping injected conversions is not modelled.
        if command(cr::JADSTP) {
            return Err(Why::NoModel);
        }
        if let Some(rule) = self.broken_command(ones, clock, now) {
            return Err(Why::Broken(rule));
        }
        let levels = bits(&[cr::ADVREGEN, cr::DEEPPWD, cr::ADCALDIF]);
        self.registers.write(CR, Write { mask: write.mask & levels, ..write })?;
        if self.registers.has(cr::DEEPPWD) {
            self.calibrated = false;
        }
        let ready = self.registers.has(cr::ADVREGEN) && !self.registers.has(cr::DEEPPWD);
        if !ready {
            self.regulated = u64::MAX;
        } else if self.regulated == u64::MAX {
            self.regulated = now + REGULATOR_START;
        }
        let idle = !self.converts() && !self.registers.has(cr::ADCAL);
        if command(cr::ADCAL) && ready && !self.is_enabled() {
            self.registers.put(cr::ADCAL, 1);
            self.done = now + CALIBRATION * clock;
        }
        if command(cr::ADEN) && ready && idle && !self.is_enabled() {
            self.registers.put(cr::ADEN, 1);
            self.ready = now + STABILISATION * clock;
        }
        if command(cr::ADDIS) && idle {
            self.registers.put(cr::ADEN, 0);
            self.ready = u64::MAX;
        }
        if command(cr::ADSTP) {
            self.registers.put(cr::ADSTART, 0);
            self.done = u64::MAX;
        }
        if command(cr::ADSTART) && self.is_enabled() && idle {
            // A sequence of several, or started by hardware, is not modelled.
            if [sqr1::L, cfgr::EXTEN, cfgr::RES].iter().any(|field| self.registers.has(*field)) {
                return Err(Why::NoModel);
            }
            self.registers.put(cr::ADSTART, 1);
            self.done = now + self.cycles(None, clock);
        }
        if command(cr::JADSTART) && self.is_enabled() && !self.registers.has(cr::JADSTART) {
            // Between regular ones, or started by hardware, is not modelled.
            if !idle || self.registers.has(jsqr::JEXTEN) {
                return Err(Why::NoModel);
            }
            self.registers.put(cr::JADSTART, 1);
            self.injected = Some((0, now + self.cycles(Some(0), clock)));
        }
        Ok(())
    }

    pub(super) fn read(&mut self, offset: u32, now: u64) -> Option<u32> {
        self.settle(now);
        if offset == DR {
            self.registers.put(isr::EOC, 0);
        }
        self.registers.read(offset)
    }

    /// Sets `ADRDY` once, when the converter has become ready.
    pub(super) fn settle(&mut self, now: u64) {
        if self.ready <= now && self.ready != 0 {
            self.ready = 0;
            self.registers.put(isr::ADRDY, 1);
        }
    }

    /// The injected conversion of this rank is done, with this at its channel.
    pub(super) fn finish_injected(
        &mut self,
        rank: usize,
        voltage: u16,
        (done, clock): (u64, u64),
        errors: Option<Errors<'_>>,
    ) {
        let code = self.code(Some(rank), voltage, (done, clock), errors);
        self.registers.set(JDR1 + 4 * rank as u32, code);
        self.registers.put(isr::JEOC, 1);
        if rank < self.registers.field(jsqr::JL) as usize {
            self.injected = Some((rank + 1, done + self.cycles(Some(rank + 1), clock)));
        } else {
            self.injected = None;
            self.registers.put(cr::JADSTART, 0);
            self.registers.put(isr::JEOS, 1);
        }
    }

    /// The current calibration or conversion is done, with this voltage at its channel.
    pub(super) fn finish(&mut self, voltage: u16, clock: u64, errors: Option<Errors<'_>>) {
        let done = std::mem::replace(&mut self.done, u64::MAX);
        if self.registers.has(cr::ADCAL) {
            self.registers.put(cr::ADCAL, 0);
            self.calibrated = true;
            self.rested = done + REST * clock;
            return;
        }
        if self.registers.has(cfgr::CONT) {
            self.done = done + self.cycles(None, clock);
        } else {
            self.registers.put(cr::ADSTART, 0);
        }
        if self.registers.has(isr::EOC) {
            self.registers.put(isr::OVR, 1);
            // The old code is kept.
            if !self.registers.has(cfgr::OVRMOD) {
                return;
            }
        }
        self.registers.set(DR, self.code(None, voltage, (done, clock), errors));
        self.registers.put(isr::EOC, 1);
        self.registers.put(isr::EOS, 1);
    }

    /// Whether it requests DMA; after an overrun not until the flag is cleared.
    pub(super) fn wants_dma(&self) -> bool {
        let has = |field| self.registers.has(field);
        has(cfgr::DMAEN) && has(isr::EOC) && !has(isr::OVR)
    }
}
