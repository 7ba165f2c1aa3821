//! The NUCLEO-G474RE behind [`interstage::hal::Board`]: one driver a file. Pins
//! are chosen in `main.rs` and listed in `docs/HARDWARE.md`.

pub(crate) mod analog;
pub(crate) mod angle;
pub(crate) mod bridge;
pub(crate) mod button;
pub(crate) mod console;
pub(crate) mod guard;
pub(crate) mod journal;
pub(crate) mod light;
pub(crate) mod rtt;
pub(crate) mod wheel;

use embassy_stm32::peripherals::{ADC1, ADC2, DMA1_CH1, DMA1_CH2, DMA1_CH3, DMA1_CH4};
use embassy_stm32::{Config, bind_interrupts, dma, exti, interrupt, rcc};
use embassy_time::Timer;
use interstage::hal::{Board, Indicator, Light, MotorCommand, Motors, Parts};
use interstage::rig::RigError;

/// The board.
pub(crate) struct Nucleo;

impl Board for Nucleo {
    type Wheel = wheel::Wheel;
    type LoadCell = analog::Analog<ADC1, DMA1_CH1>;
    type Tread = analog::Analog<ADC2, DMA1_CH2>;
    type Arm = angle::Angle;
    type Motors = bridge::Bridges;
    type Watchdog = guard::Guard;
    type Button = button::Button;
    type Console = console::Console;
    type Journal = journal::Lines;
    type Light = light::Lamp;
}

bind_interrupts!(pub(crate) struct Irqs {
    DMA1_CHANNEL1 => dma::InterruptHandler<DMA1_CH1>;
    DMA1_CHANNEL2 => dma::InterruptHandler<DMA1_CH2>;
    DMA1_CHANNEL3 => dma::InterruptHandler<DMA1_CH3>;
    DMA1_CHANNEL4 => dma::InterruptHandler<DMA1_CH4>;
    EXTI15_10 => exti::InterruptHandler<interrupt::typelevel::EXTI15_10>;
});

/// 170 MHz from the internal oscillator: 16 MHz / 4 x 85 / 2. Its 1 % is ample,
/// because positions come from the encoder and the plan is redone at every step;
/// a crystal would be one more part that can stop.
pub(crate) fn clocks() -> Config {
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
    // Above 150 MHz the core needs its higher voltage.
    config.rcc.boost = true;
    // Both converters from the system clock; the driver divides it by four.
    config.rcc.mux.adc12sel = rcc::mux::Adcsel::SYS;
    config
}

/// No controller can be built from the parameters: stays off and says so.
#[embassy_executor::task]
pub(crate) async fn hold(mut parts: Parts<Nucleo>, error: RigError) -> ! {
    parts.motors.apply(MotorCommand::OFF, MotorCommand::OFF);
    parts.light.show(Light::Alarm);
    loop {
        journal::rig_error(&error);
        Timer::after_secs(1).await;
    }
}
