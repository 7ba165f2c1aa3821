//! The two analogue sensors: one converter and one DMA channel each, so that
//! neither waits for the other.
//!
//! Each converts without end and DMA puts its codes into a ring; who samples takes the
//! latest and goes on. Nothing is started and nothing waited for, so that a sample costs
//! no interrupt and no second turn of its task.

use embassy_stm32::adc::{
    Adc, AdcChannel, AdcConfig, CONTINUOUS, DefaultInstance, Resolution, RingBufferedAdc, Rovsm,
    RxDma, SampleTime, Trovs,
};
use embassy_stm32::interrupt::typelevel::Binding;
use embassy_stm32::pac::adc::Adc as Registers;
use embassy_stm32::pac::adc::vals::Exten;
use embassy_stm32::{Peri, dma};
use embassy_time::{Duration, Timer};
use interstage::hal::AnalogInput;
use interstage::sense::raw::{AdcCode, BusFault};
use static_cell::StaticCell;

use super::Irqs;

/// `OVSR` for 256 conversions a code.
const RATIO_256: u8 = 7;

/// 12 bits summed 256 times are 20 bits; four off leave 16, left-justified.
const SHIFT: u8 = 4;

/// A code takes 256 x (12.5 + 12.5) / 42.5 MHz = 151 us; what is not there after
/// three times that will not come.
const LIMIT: Duration = Duration::from_micros(500);

/// Codes in a ring: 9.6 ms of them. DMA interrupts twice in that time.
const RING: usize = 64;

/// Where DMA puts the codes of a sensor.
pub(crate) struct Ring(StaticCell<[u16; RING]>);

impl Ring {
    /// An empty one.
    pub(crate) const fn new() -> Self {
        Self(StaticCell::new())
    }
}

/// One sensor on its converter.
pub(crate) struct Analog<T: DefaultInstance> {
    registers: Registers,
    codes: RingBufferedAdc<'static, T>,
}

impl<T: DefaultInstance> Analog<T> {
    /// Calibrates the converter with these registers and has it convert `pin` from now
    /// on. Each ring serves once.
    pub(crate) fn new<D: RxDma<T>>(
        (adc, registers): (Peri<'static, T>, Registers),
        pin: impl AdcChannel<T> + 'static,
        dma: Peri<'static, D>,
        ring: &'static Ring,
    ) -> Self
    where
        Irqs: Binding<D::Interrupt, dma::InterruptHandler<D>>,
    {
        let config = AdcConfig {
            resolution: Some(Resolution::BITS12),
            oversampling_ratio: Some(RATIO_256),
            oversampling_shift: Some(SHIFT),
            oversampling_mode: Some((Rovsm::CONTINUED, Trovs::AUTOMATIC, true)),
            ..AdcConfig::default()
        };
        // The amplifiers are buffered: the shortest sampling time that the slow
        // channels allow suffices, and the average counts for more.
        let sequence = [(pin.degrade_adc(), SampleTime::CYCLES12_5)];
        let ring = ring.0.init([0; RING]);
        let mut codes = Adc::new(adc, config).into_ring_buffered(
            dma,
            ring,
            Irqs,
            sequence.into_iter(),
            CONTINUOUS,
            Exten::DISABLED,
        );
        codes.start();
        Self { registers, codes }
    }

    /// The latest code, if one has come since this was last asked.
    fn latest(&mut self) -> Option<AdcCode> {
        let mut code = [0];
        (self.codes.read_latest(&mut code) == 1).then(|| AdcCode::new(code[0]))
    }
}

impl<T: DefaultInstance> AnalogInput for Analog<T> {
    async fn sample(&mut self) -> Result<AdcCode, BusFault> {
        if let Some(code) = self.latest() {
            return Ok(code);
        }
        // Just started, or DMA did not keep up: after an overrun the converter keeps its
        // codes to itself until told that it was seen.
        self.registers.isr().write(|w| w.set_ovr(true));
        Timer::after(LIMIT).await;
        self.latest().ok_or(BusFault::Timeout)
    }
}
