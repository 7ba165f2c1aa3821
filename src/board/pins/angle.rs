//! The arm's angle sensor, an AS5048A: 16-bit frames on SPI1, mode 1.
//!
//! A frame takes 3 us, a reading two of them. The driver busy-waits: the bus clocks by itself,
//! so the wait always ends.
//!
//! Each frame carries the answer to the command before. An error in a command raises the error
//! flag of every later answer until the error register is read; so each flagged answer is
//! followed by that read, and the reading after it is good again.

use embassy_stm32::Peri;
use embassy_stm32::gpio::{Level, Output, Pull, Speed};
use embassy_stm32::peripherals::{PA6, PA7, PB3, PB10, SPI1};
use embassy_stm32::spi::{Config, MODE_1, Spi};
use embassy_stm32::time::Hertz;
use interstage::hal::AngleBus;
use interstage::sense::angle::{field, is_flagged};
use interstage::sense::raw::{AngleFrame, BusFault};

use crate::board::{SYSCLK_HZ, registers};

/// Commands that read a register, bit 14, with even parity in bit 15: the angle at 0x3FFF,
/// diagnostics and gain at 0x3FFD, the errors at 0x0001.
const READ_ANGLE: u16 = 0xFFFF;
const READ_DIAGNOSTICS: u16 = 0x7FFD;
const READ_ERRORS: u16 = 0x4001;

/// 170 MHz / 32. The sensor takes 10 MHz; the next divider would give 10.6.
const CLOCK: Hertz = Hertz(5_312_500);

/// From select to clock, and between frames, the sensor wants 350 ns; with half as much again for
/// edges and clock 525 ns. A round of the delay takes three cycles at least.
const SELECT_ROUNDS: u32 = SYSCLK_HZ / 1_000_000 * 525 / 1000 / 3 + 1;

/// Polls of the bus for a frame of 512 cycles: a poll takes four at least.
const FRAME_ROUNDS: u32 = 500;

pub(crate) struct Angle {
    select: Output<'static>,
    /// The next answer is that of the diagnostics.
    diagnosed: bool,
    /// The magnet's field by the last diagnostics.
    field: bool,
}

impl Angle {
    /// The bus with its pins (clock, controller out, controller in) and the select line.
    pub(crate) fn new(
        spi: Peri<'static, SPI1>,
        (clock, out, input): (Peri<'static, PB3>, Peri<'static, PA7>, Peri<'static, PA6>),
        select: Peri<'static, PB10>,
    ) -> Self {
        let mut config = Config::default();
        config.mode = MODE_1;
        config.frequency = CLOCK;
        config.gpio_speed = Speed::Medium;
        // An absent sensor then reads 0xFFFF, which carries the error flag;
        // 0x0000 would pass for an angle of zero with right parity.
        config.miso_pull = Pull::Up;
        let select = Output::new(select, Level::High, Speed::Medium);
        let mut bus = Spi::new_blocking(spi, clock, out, input, config);
        // With nothing selected, sets the bus to frames of 16 bits once: the driver would do it
        // for each frame, which takes half as long as the frame.
        let _ = bus.blocking_transfer_in_place(&mut [READ_ANGLE]);
        // Dropping it would stop the bus.
        core::mem::forget(bus);
        let mut angle = Self { select, diagnosed: false, field: true };
        // A reset in the middle of a frame is an error.
        let _ = angle.exchange(READ_ERRORS);
        angle
    }

    /// Sends a command and returns the answer to the command before.
    fn exchange(&mut self, command: u16) -> Result<AngleFrame, BusFault> {
        self.select.set_low();
        cortex_m::asm::delay(SELECT_ROUNDS);
        registers::SPI1.dr16().write_value(command);
        let come = (0..FRAME_ROUNDS).any(|_| registers::SPI1.sr().read().rxne());
        let word = registers::SPI1.dr16().read();
        self.select.set_high();
        cortex_m::asm::delay(SELECT_ROUNDS);
        if come { Ok(AngleFrame::new(word)) } else { Err(BusFault::Transfer) }
    }
}

impl AngleBus for Angle {
    async fn frame(&mut self) -> Result<AngleFrame, BusFault> {
        // Two frames, because the angle has to be of now. The first one's answer is that of the
        // last call's second command: the diagnostics come at no cost.
        let before = self.exchange(READ_ANGLE)?;
        let angle = self.exchange(READ_DIAGNOSTICS)?;
        if core::mem::replace(&mut self.diagnosed, true)
            && let Ok(field) = field(before)
        {
            self.field = field;
        }
        if is_flagged(angle) {
            self.diagnosed = false;
            self.exchange(READ_ERRORS)?;
        }
        Ok(if self.field { angle } else { AngleFrame::NO_FIELD })
    }
}
