//! Readback of the bridges' outputs: one converter for both, in injected conversions.
//!
//! Taking the results, once a tick, starts the next conversions, which end long before the next
//! tick. Each has its own result register: neither DMA nor an interrupt is needed. The library's
//! `InjectedAdc` reads the results without saying whether they are complete, and takes a trigger
//! of the hardware; its oversampled ring would take a DMA channel more.

use embassy_stm32::Peri;
use embassy_stm32::adc::{Adc, AdcChannel, AdcConfig, SampleTime};
use embassy_stm32::peripherals::ADC3;
use interstage::sense::raw::{BridgeCode, BridgeCodes};

use crate::board::registers::Adc as Registers;

/// `OVSR` for 256 conversions a code: 151 us, three periods of the bridges' PWM.
const RATIO_256: u8 = 7;

/// Their sum becomes a mean of 12 bits.
const SHIFT: u8 = 8;

pub(crate) struct Readback {
    registers: Registers,
}

impl Readback {
    /// Calibrates the converter, which has these registers, and starts the first conversions.
    pub(crate) fn new(
        (adc, registers): (Peri<'static, ADC3>, Registers),
        drive: impl AdcChannel<ADC3> + 'static,
        preload: impl AdcChannel<ADC3> + 'static,
    ) -> Self {
        // Dropping the driver leaves the converter on and calibrated.
        let _ = Adc::new(adc, AdcConfig::default());
        let channels = [drive.degrade_adc(), preload.degrade_adc()].map(|pin| pin.get_hw_channel());
        registers.cfgr2().modify(|w| {
            w.set_ovsr(RATIO_256);
            w.set_ovss(SHIFT);
            w.set_jovse(true);
        });
        for channel in channels {
            // The difference amplifiers drive the pins: as for the other analogue inputs.
            let time = SampleTime::CYCLES12_5;
            if channel < 10 {
                registers.smpr().modify(|w| w.set_smp(channel.into(), time));
            } else {
                registers.smpr2().modify(|w| w.set_smp((channel - 10).into(), time));
            }
        }
        registers.jsqr().write(|w| {
            w.set_jl(1);
            w.set_jsq(0, channels[0]);
            w.set_jsq(1, channels[1]);
        });
        let readback = Self { registers };
        readback.start();
        readback
    }

    fn start(&self) {
        // The other bits of this register act only when one is written, except the regulator's,
        // which stay as they are.
        self.registers.cr().modify(|w| w.set_jadstart(true));
    }

    /// The codes converted since the last call, if both are complete; starts the next ones.
    pub(crate) fn take(&mut self) -> Option<BridgeCodes> {
        if !self.registers.isr().read().jeos() {
            return None;
        }
        // Written with a one, the flag is cleared, and no other.
        self.registers.isr().write(|w| w.set_jeos(true));
        let code = |rank: usize| BridgeCode::new(self.registers.jdr(rank).read().jdata());
        let codes = BridgeCodes { drive: code(0), pretightener: code(1) };
        self.start();
        Some(codes)
    }
}
