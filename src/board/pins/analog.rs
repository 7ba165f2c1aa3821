//! An analogue sensor: one converter and one DMA channel each, so that none waits for another.
//!
//! Each converts continuously, and DMA writes its codes into a ring; a sample is the latest of
//! them, by the channel's own count. Nothing is started or awaited, so that a sample needs no
//! interrupt and no second poll of its task. The library's `read_latest` counts the ring's rounds
//! in an interrupt.

use embassy_stm32::adc::{
    Adc, AdcChannel, AdcConfig, CONTINUOUS, DefaultInstance, Resolution, Rovsm, RxDma, SampleTime,
    Trovs,
};
use embassy_stm32::interrupt::typelevel::{Binding, Interrupt};
use embassy_stm32::{Peri, dma};
use embassy_time::{Duration, Timer};
use interstage::hal::AnalogInput;
use interstage::sense::raw::{AdcCode, BusFault};
use static_cell::StaticCell;

use super::Irqs;
use crate::board::registers::{Adc as Registers, DmaChannel as Channel, Exten};

/// `OVSR` for 256 conversions a code.
const RATIO_256: u8 = 7;

/// 12 bits summed 256 times are 20 bits; four off leave 16, left-justified.
const SHIFT: u8 = 4;

/// A code takes 256 x (12.5 + 12.5) / 42.5 MHz = 151 us; after three times that none will come.
const LIMIT: Duration = Duration::from_micros(500);

/// Codes in a ring: 9.6 ms of them, so that an unchanged count between two samples means no new
/// code.
const RING: usize = 64;

/// Ring for the codes of a sensor.
pub(crate) type Ring = StaticCell<[u16; RING]>;

/// The ring, as one task reads it.
struct Written(*const u16);

// SAFETY: it points to a static that only DMA writes, and is only read.
unsafe impl Send for Written {}

pub(crate) struct Analog {
    registers: Registers,
    channel: Channel,
    written: Written,
    /// The channel's count when the latest code was taken.
    left: u16,
}

impl Analog {
    /// Calibrates the converter and starts converting `pin` through this DMA channel, both with
    /// their registers. Each ring serves once.
    pub(super) fn new<T: DefaultInstance, D: RxDma<T>>(
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
        // The amplifiers are buffered: the shortest sampling time of the slow channels suffices.
        let sequence = [(pin.degrade_adc(), SampleTime::CYCLES12_5)];
        let ring: *mut [u16; RING] = ring.init([0; RING]);
        let written = Written(ring.cast());
        // SAFETY: the only reference to it. The driver lends its memory to DMA and looks at none of
        // it, so that it is read through `written` alone.
        let ring = unsafe { &mut *ring };
        let mut converter = Adc::new(adc, config).into_ring_buffered(
            dma,
            ring,
            Irqs,
            sequence.into_iter(),
            CONTINUOUS,
            Exten::DISABLED,
        );
        converter.start();
        // Dropping it would stop the conversions.
        core::mem::forget(converter);
        // No interrupt at the ring's half or end. The channel's own switches must not be written
        // while it is enabled, which it is since before the driver gave it back.
        D::Interrupt::disable();
        Self { registers, channel, written, left: RING as u16 }
    }

    /// The latest code, if one has arrived since the last call.
    fn latest(&mut self) -> Option<AdcCode> {
        let left = self.channel.ndtr().read().ndt();
        if left == self.left {
            return None;
        }
        self.left = left;
        // The channel counts the codes left to the ring's end, from full down.
        let latest = (2 * RING - 1 - usize::from(left)) % RING;
        // SAFETY: within the static ring; DMA has written this code and overwrites it after 63
        // others.
        Some(AdcCode::new(unsafe { self.written.0.add(latest).read_volatile() }))
    }
}

impl AnalogInput for Analog {
    async fn sample(&mut self) -> Result<AdcCode, BusFault> {
        if let Some(code) = self.latest() {
            return Ok(code);
        }
        // Just started, or an overrun: the converter stops until its flag is cleared.
        self.registers.isr().write(|w| w.set_ovr(true));
        Timer::after(LIMIT).await;
        self.latest().ok_or(BusFault::Timeout)
    }
}
