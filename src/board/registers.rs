//! The registers that the library's drivers leave to us, through its unstable access to them:
//! all of it passes through here.
//!
//! | block | what the library lacks |
//! |---|---|
//! | ADC1 to ADC5, DMA1 | the ring's place without an interrupt, the flag of injected results |
//! | TIM1, TIM8 | one pulse of some periods; a duty without a check that can panic in the tick; a break's flags; the cut of both bridges from a handler |
//! | TIM5 | the encoder's input filter |
//! | SPI1 | a frame of which no step waits for a flag without end |
//! | FLASH | prefetch, option bytes, error correction; writes before and after the tasks |
//! | PWR, EXTI | the supply's detector; the boost, see [`super::init`] |
//! | SYSCFG, DBGMCU | breaks of the timers by the chip itself, what freezes with the core |
//! | IWDG | whether its time-out has been taken over; in the loop's image its feeding while a plan is made |
//! | RCC, GPIOA, GPIOC | causes of a reset; the light and the bridges' lines before anything runs |

use embassy_stm32::pac;

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
    DBGMCU, DMA1, EXTI, FLASH, GPIOA, GPIOC, IWDG, PWR, RCC, SPI1, SYSCFG, TIM1, TIM5, TIM8,
};

/// The chip's converters.
#[cfg(not(feature = "hil"))]
pub(crate) const ADCS: [Adc; 5] = [pac::ADC1, pac::ADC2, pac::ADC3, pac::ADC4, pac::ADC5];
