//! The NUCLEO-G474RE behind the traits of [`interstage::hal`]: one driver a file. Its pins are
//! listed in `docs/HARDWARE.md`.

pub(crate) mod config;
mod console;
mod flash;
pub(crate) mod flash_page;
pub(crate) mod guard;
#[cfg(feature = "hil")]
pub(crate) mod hil;
pub(crate) mod image;
pub(crate) mod light;
mod line;
#[cfg(not(feature = "hil"))]
mod pins;
#[cfg_attr(
    feature = "hil",
    expect(unused_imports, reason = "the loop's image has no drivers of sensors")
)]
pub(crate) mod registers;
mod retained;
pub(crate) mod rtt;
pub(crate) mod safety;
mod stack;
pub(crate) mod start;
pub(crate) mod supply;
mod text_log;

pub(crate) use console::Console;
pub(crate) use flash::ParameterFlash;
pub(crate) use guard::Guard;
#[cfg(feature = "hil")]
pub(crate) use hil::{Analog, Angle, Bridges, Button, Wheel, paused, split};
pub(crate) use light::Lamp;
pub(crate) use line::HostLine;
#[cfg(not(feature = "hil"))]
pub(crate) use pins::{Analog, Angle, Bridges, Button, Wheel, paused, split};
pub(crate) use text_log::TextLog;

use embassy_stm32::interrupt::{Interrupt, InterruptExt, Priority};
use embassy_stm32::{
    Config, Peripherals, bind_interrupts, exti, flash as flash_driver, interrupt, rcc,
};
use interstage::sense::raw::SensorId;
use interstage::tasks::Exchange;
use registers::{Cr5, PWR};

/// What all tasks share.
pub(crate) static EXCHANGE: Exchange = Exchange::new();

/// The board taken apart: each task owns what it uses and nothing else.
pub(crate) struct Parts {
    pub(crate) wheel_encoder: Wheel,
    /// By [`SensorId::ANALOG`].
    pub(crate) analog: [Analog; SensorId::ANALOG.len()],
    pub(crate) arm_angle: Angle,
    pub(crate) motors: Bridges,
    pub(crate) watchdog: Guard,
    pub(crate) button: Button,
    pub(crate) console: Console,
    pub(crate) journal: TextLog,
    pub(crate) light: Lamp,
}

bind_interrupts!(pub(crate) struct Irqs {
    FLASH => flash_driver::InterruptHandler;
    EXTI15_10 => exti::InterruptHandler<interrupt::typelevel::EXTI15_10>;
});

/// The core's clock, Hz.
const SYSCLK_HZ: u32 = 170_000_000;

/// [`SYSCLK_HZ`] from the internal oscillator: 16 MHz / 4 x 85 / 2. Its 1 % suffices: positions
/// come from the encoder, and every step is planned again.
fn clocks() -> Config {
    let mut config = Config::default();
    config.rcc.pll = Some(rcc::Pll {
        source: rcc::PllSource::HSI,
        prediv: rcc::PllPreDiv::DIV4,
        mul: rcc::PllMul::MUL85,
        divp: None,
        divq: None,
        divr: Some(rcc::PllRDiv::DIV2),
    });
    config.rcc.sys = rcc::Sysclk::PLL1_R;
    // Above 150 MHz the core needs its higher voltage, see `init`.
    config.rcc.boost = true;
    // All converters from the system clock; the driver divides it by four.
    config.rcc.mux.adc12sel = rcc::mux::Adcsel::SYS;
    config.rcc.mux.adc345sel = rcc::mux::Adcsel::SYS;
    config
}

/// Guards the stack and starts the chip, at its slow clock first: the regulator's boost comes
/// before more than 150 MHz (RM0440, 6.1.5).
///
/// The driver's own switch for it does not reach the chip: stm32-metapac 21 has `R1MODE` at bit
/// 0 of `PWR_CR5`, the manual and ST's headers have it at bit 8.
pub(crate) fn init() -> Peripherals {
    stack::guard();
    let mut config = Config::default();
    config.bdma_interrupt_priority = Priority::P1;
    let mut p = embassy_stm32::init(config);
    // The system timer, of the highest priority, ends a hang in any of these.
    for interrupt in [Interrupt::TIM2, Interrupt::FLASH, Interrupt::EXTI15_10] {
        interrupt.set_priority(Priority::P1);
    }
    PWR.cr5().write_value(Cr5(0));
    rcc::reinit(clocks().rcc, &mut p.RCC);
    // At four wait states the core would wait at every line of code that the cache lacks. All
    // code is in bank 1: the chip's prefetch may fail where code branches between the banks.
    registers::FLASH.acr().modify(|w| w.set_prften(true));
    p
}
