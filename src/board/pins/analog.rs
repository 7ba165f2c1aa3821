//! The two analogue sensors: one converter and one DMA channel each, so that
//! neither waits for the other.
//!
//! Each converts without end and DMA puts its codes into a ring; who samples takes the
//! latest, by the channel's own count, and goes on. Nothing is started and nothing waited
//! for, so that a sample costs no interrupt and no second turn of its task.

use embassy_stm32::adc::{
    Adc, AdcChannel, AdcConfig, CONTINUOUS, DefaultInstance, Resolution, RingBufferedAdc, Rovsm,
    RxDma, SampleTime, Trovs,
};
use embassy_stm32::interrupt::typelevel::Binding;
use embassy_stm32::pac::adc::Adc as Registers;
use embassy_stm32::pac::adc::vals::Exten;
use embassy_stm32::pac::bdma::Ch as Channel;
use embassy_stm32::{Peri, dma};
use embassy_time::{Duration, Timer};
use interstage::hal::AnalogInput;
use interstage::sense::raw::{AdcCode, BusFault};
use static_cell::StaticCell;

use crate::board::Irqs;

/// `OVSR` for 256 conversions a code.
const RATIO_256: u8 = 7;

/// 12 bits summed 256 times are 20 bits; four off leave 16, left-justified.
const SHIFT: u8 = 4;

/// A code takes 256 x (12.5 + 12.5) / 42.5 MHz = 151 us; what is not there after
/// three times that will not come.
const LIMIT: Duration = Duration::from_micros(500);

/// Codes in a ring: 9.6 ms of them, so that a count which stands still between two samples
/// has not gone round.
const RING: usize = 64;

/// Where DMA puts the codes of a sensor.
pub(crate) struct Ring(StaticCell<[u16; RING]>);

impl Ring {
    /// An empty one.
    pub(crate) const fn new() -> Self {
        Self(StaticCell::new())
    }
}

/// What DMA writes, to be read from one task.
struct Written(*const u16);

// SAFETY: it points to a static that nobody but DMA writes, and is only read.
unsafe impl Send for Written {}

/// One sensor on its converter.
pub(crate) struct Analog<T: DefaultInstance> {
    registers: Registers,
    channel: Channel,
    written: Written,
    /// The channel's count when the latest code was taken.
    left: u16,
    /// Dropped, it would stop.
    _converter: RingBufferedAdc<'static, T>,
}

impl<T: DefaultInstance> Analog<T> {
    /// Calibrates the converter with these registers and has it convert `pin` from now
    /// on, by the DMA channel of these. Each ring serves once.
    pub(crate) fn new<D: RxDma<T>>(
        (adc, registers): (Peri<'static, T>, Registers),
        pin: impl AdcChannel<T> + 'static,
        (dma, channel): (Peri<'static, D>, Channel),
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
        let written = Written(ring.as_ptr());
        let mut converter = Adc::new(adc, config).into_ring_buffered(
            dma,
            ring,
            Irqs,
            sequence.into_iter(),
            CONTINUOUS,
            Exten::DISABLED,
        );
        converter.start();
        // Nobody waits for the ring's half or its end.
        channel.cr().modify(|w| {
            w.set_htie(false);
            w.set_tcie(false);
        });
        Self { registers, channel, written, left: RING as u16, _converter: converter }
    }

    /// The latest code, if one has come since this was last asked.
    fn latest(&mut self) -> Option<AdcCode> {
        let left = self.channel.ndtr().read().ndt();
        if left == self.left {
            return None;
        }
        self.left = left;
        // The count is that of the codes up to the ring's end, and full again behind it.
        let latest = (2 * RING - 1 - usize::from(left)) % RING;
        // SAFETY: within the ring, which is static; DMA has written this code and comes
        // back to it after 63 others.
        Some(AdcCode::new(unsafe { self.written.0.add(latest).read_volatile() }))
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
