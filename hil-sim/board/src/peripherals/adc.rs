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

mod converter;

use super::{Peripheral, Why, Write};
use crate::description::adc1::{CR, ISR};
use crate::description::adc12_common::{self, ccr};
use crate::rules::Rule;

use converter::Converter;
pub use converter::Errors;

/// Offset of the second converter, and of the common registers.
const STRIDE: u32 = 0x100;
const COMMON: u32 = 0x300;
const CCR: u32 = COMMON + adc12_common::CCR;

/// The pair.
#[derive(Clone, Debug)]
pub struct Adc {
    converters: [Converter; 2],
    common: u32,
    /// Codes of 16 bits at the inputs: converter, channel.
    inputs: [[u16; 20]; 2],
}

impl Default for Adc {
    fn default() -> Self {
        let converters = [Converter::new(), Converter::new()];
        Self { converters, common: 0, inputs: [[0; 20]; 2] }
    }
}

impl Adc {
    /// Sets the voltage at a converter's input, in parts of 2^16 of the reference.
    pub(crate) fn set_input(&mut self, converter: usize, channel: usize, sixteen: u16) {
        self.inputs[converter][channel] = sixteen;
    }

    pub(crate) fn wants_dma(&self, converter: usize) -> bool {
        self.converters[converter].wants_dma()
    }

    /// Cycles of the core in a clock of the converters.
    fn clock(&self) -> u64 {
        const PRESCALERS: [u64; 12] = [1, 2, 4, 6, 8, 10, 12, 16, 32, 64, 128, 256];
        match ccr::CKMODE.of(self.common) {
            0 => PRESCALERS.get(ccr::PRESC.of(self.common) as usize).copied().unwrap_or(256),
            mode => 1 << (mode - 1),
        }
    }

    /// As [`Peripheral::advance`], with errors at the inputs.
    pub(crate) fn advance_with(&mut self, now: u64, errors: Option<Errors<'_>>) {
        let clock = self.clock();
        for (converter, inputs) in self.converters.iter_mut().zip(&self.inputs) {
            while converter.done <= now {
                let channel = converter.channel(None) as usize;
                converter.finish(inputs.get(channel).copied().unwrap_or(0), clock, errors);
            }
            while let Some((rank, done)) = converter.injected.filter(|(_, done)| *done <= now) {
                let channel = converter.channel(Some(rank)) as usize;
                let voltage = inputs.get(channel).copied().unwrap_or(0);
                converter.finish_injected(rank, voltage, (done, clock), errors);
            }
        }
    }
}

impl Peripheral for Adc {
    fn read(&mut self, offset: u32, now: u64) -> Option<u32> {
        match offset {
            CCR => Some(self.common),
            _ => {
                let converter = self.converters.get_mut((offset / STRIDE) as usize)?;
                converter.read(offset % STRIDE, now)
            }
        }
    }

    fn write(&mut self, offset: u32, write: Write, now: u64) -> Result<(), Why> {
        if offset == CCR {
            let next = write.onto(self.common);
            if next != self.common && self.converters.iter().any(Converter::is_enabled) {
                return Err(Why::Broken(Rule::AdcDisabledOnly));
            }
            self.common = next;
            return Ok(());
        }
        let clock = self.clock();
        let converter = self.converters.get_mut((offset / STRIDE) as usize).ok_or(Why::NoModel)?;
        match offset % STRIDE {
            ISR => {
                converter.settle(now);
                converter.registers.clear(ISR, write.ones());
                Ok(())
            }
            CR => converter.write_control(write, clock, now),
            offset => converter.configure(offset, write),
        }
    }

    fn deadline(&self) -> u64 {
        let due = |converter: &Converter| {
            converter.injected.map_or(converter.done, |(_, done)| done.min(converter.done))
        };
        due(&self.converters[0]).min(due(&self.converters[1]))
    }

    fn advance(&mut self, now: u64) {
        self.advance_with(now, None);
    }
}

#[cfg(test)]
mod tests;
