//! Sensors, bridges and button at the board's pins.

mod analog;
mod angle;
mod bridge;
mod button;
mod readback;
mod wheel;

use embassy_stm32::gpio::AnyPin;
use embassy_stm32::peripherals::{DMA1_CH1, DMA1_CH2};
use embassy_stm32::{Peri, Peripherals, bind_interrupts, dma};
use interstage::sense::raw::SensorId;
use rtt_target::DownChannel;

use super::registers::{ADCS, DMA1, TIM1, TIM8};
use super::rtt::Frames;
use super::{Console, Guard, Lamp, ParameterFlash, Parts, TextLog};
pub(crate) use analog::Analog;
use analog::Ring;
pub(crate) use angle::Angle;
use bridge::Bridge;
pub(crate) use bridge::Bridges;
pub(crate) use button::Button;
use readback::Readback;
pub(crate) use wheel::Wheel;

bind_interrupts!(struct Irqs {
    DMA1_CHANNEL1 => dma::InterruptHandler<DMA1_CH1>;
    DMA1_CHANNEL2 => dma::InterruptHandler<DMA1_CH2>;
});

static RINGS: [Ring; SensorId::ANALOG.len()] = [const { Ring::new() }; SensorId::ANALOG.len()];

/// In a pause of a plan: ticks go on beside it, and feed the watchdog.
pub(crate) const fn paused() {}

/// Assigns peripherals and pins; the bridges come up off.
pub(crate) fn split(
    p: Peripherals,
    console: DownChannel,
    frames: Frames,
) -> (Parts, Peri<'static, AnyPin>, ParameterFlash) {
    let parts = Parts {
        wheel_encoder: Wheel::new(p.TIM5, p.PA0, p.PA1),
        analog: [
            Analog::new((p.ADC1, ADCS[0]), p.PC2, (p.DMA1_CH1, DMA1.ch(0)), &RINGS[0]),
            Analog::new((p.ADC2, ADCS[1]), p.PC3, (p.DMA1_CH2, DMA1.ch(1)), &RINGS[1]),
        ],
        arm_angle: Angle::new(p.SPI1, (p.PB3, p.PA7, p.PA6), p.PB10),
        motors: Bridges {
            drive: Bridge::new((p.TIM1, TIM1), p.PA8, p.PA9.into(), p.PA10.into(), p.PB12),
            preload: Bridge::new((p.TIM8, TIM8), p.PC6, p.PC8.into(), p.PC9.into(), p.PB7),
            readback: Readback::new((p.ADC3, ADCS[2]), p.PB0, p.PB1),
        },
        watchdog: Guard::new(p.IWDG, p.TIM7),
        button: Button::new(p.PC13, p.EXTI13),
        console: Console(console),
        journal: TextLog::new(frames),
        light: Lamp,
    };
    (parts, p.PA5.into(), ParameterFlash::new(p.FLASH))
}
