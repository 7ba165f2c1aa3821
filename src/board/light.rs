//! LD2. A task drives the pin, because blinking takes time; the indicator only signals it.

use embassy_stm32::Peri;
use embassy_stm32::gpio::{AnyPin, Level, Output, Speed};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::{Duration, with_timeout};
use interstage::hal::{Indicator, Light};

use super::registers::{GPIOA, GPIOC, Moder, RCC};

/// Half a period of 4 Hz.
const HALF_PERIOD: Duration = Duration::from_millis(125);

static WANTED: Signal<CriticalSectionRawMutex, Light> = Signal::new();

/// Switches it on by registers alone, before anything else runs.
pub(super) fn glow() {
    RCC.ahb2enr().modify(|w| w.set_gpioaen(true));
    GPIOA.bsrr().write(|w| w.set_bs(5, true));
    GPIOA.moder().modify(|w| w.set_moder(5, Moder::OUTPUT));
}

/// Drives PWM, direction and enable of both bridges low by registers alone, before anything else
/// runs: a reset leaves zeros to put out.
pub(super) fn hold_bridges() {
    RCC.ahb2enr().modify(|w| {
        w.set_gpioaen(true);
        w.set_gpiocen(true);
    });
    for (port, pins) in [(GPIOA, [8, 9, 10]), (GPIOC, [6, 8, 9])] {
        port.moder().modify(|w| pins.map(|pin| w.set_moder(pin, Moder::OUTPUT)));
    }
}

/// Signals [`show`].
pub(crate) struct Lamp;

impl Indicator for Lamp {
    fn show(&mut self, light: Light) {
        WANTED.signal(light);
    }
}

/// Shows on `pin` what [`Lamp`] asks for.
#[embassy_executor::task]
pub(crate) async fn show(pin: Peri<'static, AnyPin>) -> ! {
    let mut pin = Output::new(pin, Level::Low, Speed::Low);
    let mut light = Light::Off;
    loop {
        light = match light {
            Light::Off | Light::On => {
                pin.set_level((light == Light::On).into());
                WANTED.wait().await
            }
            Light::Alarm => {
                pin.toggle();
                with_timeout(HALF_PERIOD, WANTED.wait()).await.unwrap_or(light)
            }
        };
    }
}
