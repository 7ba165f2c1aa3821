//! The registers that the library's drivers leave to us, through its unstable access to them:
//! all of it passes through here.
//!
//! | block | what the library lacks |
//! |---|---|
//! | ADC1 to ADC3, DMA1 | the ring's place without an interrupt, the flag of injected results |
//! | TIM1, TIM8 | one pulse of some periods; a duty without a check that can panic in the tick; a break's flags; the cut of both bridges from a handler |
//! | TIM5 | the encoder's input filter |
//! | SPI1 | a frame of which no step waits for a flag without end |
//! | FLASH | prefetch, option bytes, error correction; writes before and after the tasks |
//! | PWR, EXTI | the supply's detector; the boost, see [`super::init`] |
//! | SYSCFG, DBGMCU | breaks of the timers by the chip itself, what freezes with the core |
//! | IWDG | whether its time-out has been taken over; in the loop's image its feeding while a plan is made |
//! | RCC, GPIOA, GPIOC | causes of a reset; the light and the bridges' lines before anything runs |

use embassy_stm32::pac;
use embassy_stm32::peripherals;

pub(crate) use pac::adc::Adc;
pub(crate) use pac::adc::vals::Exten;
pub(crate) use pac::bdma::Ch as DmaChannel;
pub(crate) use pac::gpio::vals::Moder;
#[cfg(feature = "hil")]
pub(crate) use pac::iwdg::vals::Key as IwdgKey;
pub(crate) use pac::pwr::regs::Cr5;
pub(crate) use pac::timer::TimAdv;
pub(crate) use pac::timer::vals::{FilterValue, Ocm};
pub(crate) use pac::{
    DBGMCU, EXTI, FLASH, GPIOA, GPIOC, IWDG, PWR, RCC, SPI1, SYSCFG, TIM1, TIM5, TIM8,
};

/// A peripheral that the library hands out once, and its registers.
pub(crate) trait Peripheral {
    /// Kind of its registers.
    type Registers;
    /// They themselves.
    fn registers() -> Self::Registers;
}

macro_rules! peripherals {
    ($($name:ident: $kind:ty = $registers:expr;)*) => {$(
        impl Peripheral for peripherals::$name {
            type Registers = $kind;

            fn registers() -> $kind {
                $registers
            }
        }
    )*};
}

peripherals! {
    ADC1: Adc = pac::ADC1;
    ADC2: Adc = pac::ADC2;
    ADC3: Adc = pac::ADC3;
    DMA1_CH1: DmaChannel = pac::DMA1.ch(0);
    DMA1_CH2: DmaChannel = pac::DMA1.ch(1);
    TIM1: TimAdv = TIM1;
    TIM8: TimAdv = TIM8;
}
