//! The wheel encoder: TIM5 counts both edges of both lines, four counts a line pair.

use embassy_stm32::Peri;
use embassy_stm32::gpio::Pull;
use embassy_stm32::peripherals::{PA0, PA1, TIM5};
use embassy_stm32::timer::qei::{Config, Qei, QeiMode};
use interstage::hal::WheelEncoder;
use interstage::sense::raw::EncoderCount;

use crate::board::registers::{self, FilterValue};

pub(crate) struct Wheel(Qei<'static, TIM5>);

impl Wheel {
    /// Lines A and B. Both are pulled up, so that an open-collector encoder
    /// works as it is and a lost line reads as one that does not move.
    pub(crate) fn new(
        timer: Peri<'static, TIM5>,
        a: Peri<'static, PA0>,
        b: Peri<'static, PA1>,
    ) -> Self {
        let config = Config {
            ch1_pull: Pull::Up,
            ch2_pull: Pull::Up,
            mode: QeiMode::Mode3,
            ..Config::default()
        };
        let counter = Qei::new(timer, a, b, config);
        // An edge counts after 8 equal samples at 170 MHz / 32, 1.5 us: far below the 120 us
        // between two counts at 160 mm/s, far above the ringing that the bridges couple in.
        registers::TIM5.ccmr_input(0).modify(|w| {
            w.set_icf(0, FilterValue::FDTS_DIV32_N8);
            w.set_icf(1, FilterValue::FDTS_DIV32_N8);
        });
        Self(counter)
    }
}

impl WheelEncoder for Wheel {
    fn count(&mut self) -> EncoderCount {
        EncoderCount::new(self.0.count())
    }
}
