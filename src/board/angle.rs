//! The arm's angle sensor, an AS5048A: 16-bit frames on SPI1, mode 1.

use embassy_stm32::Peri;
use embassy_stm32::gpio::{AnyPin, Level, Output, Pull, Speed};
use embassy_stm32::mode::Async;
use embassy_stm32::peripherals::{DMA1_CH3, DMA1_CH4, PA6, PA7, PB3, SPI1};
use embassy_stm32::spi::mode::Master;
use embassy_stm32::spi::{Config, MODE_1, Spi};
use embassy_stm32::time::Hertz;
use embassy_time::{Duration, with_timeout};
use interstage::hal::AngleBus;
use interstage::sense::raw::{AngleFrame, BusFault};

use super::Irqs;

/// Read, register 0x3FFF (angle), even parity.
const READ_ANGLE: u16 = 0xFFFF;

/// 170 MHz / 32. The sensor takes 10 MHz; the next divider would give 10.6.
const CLOCK: Hertz = Hertz(5_312_500);

/// A frame takes 3 us.
const LIMIT: Duration = Duration::from_micros(200);

/// Core cycles of 350 ns: least time from select to clock, and between frames.
const SELECT_CYCLES: u32 = 60;

/// The sensor on its bus.
pub(crate) struct Angle {
    bus: Spi<'static, Async, Master>,
    select: Output<'static>,
}

impl Angle {
    /// The bus with its pins (clock, controller out, controller in), its DMA
    /// channels (out, in) and the select line.
    pub(crate) fn new(
        spi: Peri<'static, SPI1>,
        (clock, out, input): (Peri<'static, PB3>, Peri<'static, PA7>, Peri<'static, PA6>),
        (dma_out, dma_in): (Peri<'static, DMA1_CH4>, Peri<'static, DMA1_CH3>),
        select: Peri<'static, AnyPin>,
    ) -> Self {
        let mut config = Config::default();
        config.mode = MODE_1;
        config.frequency = CLOCK;
        config.gpio_speed = Speed::Medium;
        // An absent sensor then reads 0xFFFF, which carries the error flag;
        // 0x0000 would pass for an angle of zero with right parity.
        config.miso_pull = Pull::Up;
        Self {
            bus: Spi::new(spi, clock, out, input, dma_out, dma_in, Irqs, config),
            select: Output::new(select, Level::High, Speed::Medium),
        }
    }

    /// Sends the read command and returns what comes back meanwhile: the answer
    /// to the command before.
    async fn exchange(&mut self) -> Result<u16, BusFault> {
        let mut word = [READ_ANGLE];
        self.select.set_low();
        cortex_m::asm::delay(SELECT_CYCLES);
        let done = with_timeout(LIMIT, self.bus.transfer_in_place(&mut word)).await;
        self.select.set_high();
        match done {
            Ok(Ok(())) => Ok(word[0]),
            Ok(Err(_)) => Err(BusFault::Transfer),
            Err(_) => Err(BusFault::Timeout),
        }
    }
}

impl AngleBus for Angle {
    async fn frame(&mut self) -> Result<AngleFrame, BusFault> {
        // Two frames, because the answer to the last call's command is a whole
        // sampling period old.
        self.exchange().await?;
        cortex_m::asm::delay(SELECT_CYCLES);
        self.exchange().await.map(AngleFrame::new)
    }
}
