//! The two analogue sensors: one converter and one DMA channel each, so that
//! neither waits for the other.

use embassy_stm32::adc::{
    Adc, AdcChannel, AdcConfig, AnyAdcChannel, DefaultInstance, Resolution, Rovsm, RxDma,
    SampleTime, Trovs,
};
use embassy_stm32::interrupt::typelevel::Binding;
use embassy_stm32::{Peri, PeripheralType, dma};
use embassy_time::{Duration, with_timeout};
use interstage::hal::AnalogInput;
use interstage::sense::raw::{AdcCode, BusFault};

use super::Irqs;

/// `OVSR` for 256 conversions a code.
const RATIO_256: u8 = 7;

/// 12 bits summed 256 times are 20 bits; four off leave 16, left-justified.
const SHIFT: u8 = 4;

/// A code takes 256 x (12.5 + 12.5) / 42.5 MHz = 151 us; what is not there after
/// three times that will not come.
const LIMIT: Duration = Duration::from_micros(500);

/// One sensor on its converter.
pub(crate) struct Analog<T: DefaultInstance, D: PeripheralType + 'static> {
    adc: Adc<'static, T>,
    channel: AnyAdcChannel<'static, T>,
    dma: Peri<'static, D>,
}

impl<T: DefaultInstance, D: PeripheralType + 'static> Analog<T, D> {
    /// Calibrates the converter and takes `pin` as its one channel.
    pub(crate) fn new(
        adc: Peri<'static, T>,
        pin: impl AdcChannel<T> + 'static,
        dma: Peri<'static, D>,
    ) -> Self {
        let config = AdcConfig {
            resolution: Some(Resolution::BITS12),
            oversampling_ratio: Some(RATIO_256),
            oversampling_shift: Some(SHIFT),
            oversampling_mode: Some((Rovsm::CONTINUED, Trovs::AUTOMATIC, true)),
            ..AdcConfig::default()
        };
        Self { adc: Adc::new(adc, config), channel: pin.degrade_adc(), dma }
    }
}

impl<T: DefaultInstance, D: RxDma<T>> AnalogInput for Analog<T, D>
where
    Irqs: Binding<D::Interrupt, dma::InterruptHandler<D>>,
{
    async fn sample(&mut self) -> Result<AdcCode, BusFault> {
        let mut code = [0];
        // The amplifiers are buffered: the shortest sampling time that the slow
        // channels allow suffices, and the average counts for more.
        let sequence = [(&mut self.channel, SampleTime::CYCLES12_5)];
        let read = self.adc.read(self.dma.reborrow(), Irqs, sequence.into_iter(), &mut code);
        with_timeout(LIMIT, read).await.map_err(|_| BusFault::Timeout)?;
        Ok(AdcCode::new(code[0]))
    }
}
