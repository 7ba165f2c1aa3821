//! The arm's angle sensor, an AS5048A: 16-bit frames on SPI1, mode 1.
//!
//! A frame takes 3 us, and a reading two of them. To wait for the second costs half of what
//! it would to have DMA move it and wake the task; and the bus clocks by itself, so that the
//! wait always ends. The first passes while other sensors are read, see [`begin`].

use core::sync::atomic::{AtomicU8, Ordering};

use embassy_stm32::Peri;
use embassy_stm32::gpio::{Level, Output, Pull, Speed};
use embassy_stm32::mode::Blocking;
use embassy_stm32::pac;
use embassy_stm32::peripherals::{PA6, PA7, PB3, PB10, SPI1};
use embassy_stm32::spi::mode::Master;
use embassy_stm32::spi::{Config, MODE_1, Spi};
use embassy_stm32::time::Hertz;
use interstage::hal::AngleBus;
use interstage::sense::raw::{AngleFrame, BusFault};

/// Read, register 0x3FFF (angle), even parity.
const READ_ANGLE: u16 = 0xFFFF;

/// 170 MHz / 32. The sensor takes 10 MHz; the next divider would give 10.6.
const CLOCK: Hertz = Hertz(5_312_500);

/// Least time from select to clock, and between frames, is 350 ns or 60 cycles: the
/// delay goes round once more than this, and a round takes the core three at least.
const SELECT_ROUNDS: u32 = 20;

/// Looks at the bus in which a frame of 512 cycles has come: a look takes four at least.
const FRAME_ROUNDS: u32 = 500;

/// Nothing is under way on the bus.
const IDLE: u8 = 0;
/// The beat has begun the first frame.
const BEGUN: u8 = 1;
/// The bus is its task's.
const TAKEN: u8 = 2;

/// Who has the bus: one of these.
static HOLDER: AtomicU8 = AtomicU8::new(TAKEN);

/// Begins the first of the two frames that the sensor's task exchanges in its turn, if
/// nobody has the bus. For the interrupt that wakes it: the other sensors' tasks come
/// before it, and while they run the frame passes.
pub(crate) fn begin() {
    if HOLDER.load(Ordering::Acquire) == IDLE {
        pac::GPIOB.bsrr().write(|w| w.set_br(SELECT, true));
        send();
        HOLDER.store(BEGUN, Ordering::Release);
    }
}

/// Sends the read command to the sensor, which is selected.
fn send() {
    cortex_m::asm::delay(SELECT_ROUNDS);
    pac::SPI1.dr16().write_value(READ_ANGLE);
}

/// Pin of port B that selects the sensor.
const SELECT: usize = 10;

/// The sensor on its bus.
pub(crate) struct Angle {
    _bus: Spi<'static, Blocking, Master>,
    select: Output<'static>,
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
        // Nobody is selected; from here on the bus stands at frames of 16 bits. The driver
        // would set it up for each of them, which takes as long as half a frame.
        let _ = bus.blocking_transfer_in_place(&mut [READ_ANGLE]);
        HOLDER.store(IDLE, Ordering::Release);
        Self { _bus: bus, select }
    }

    /// Sends the read command and returns what comes back meanwhile: the answer
    /// to the command before.
    fn exchange(&mut self) -> Result<u16, BusFault> {
        self.select.set_low();
        send();
        self.receive()
    }

    /// What comes back of a frame that has begun.
    fn receive(&mut self) -> Result<u16, BusFault> {
        let come = (0..FRAME_ROUNDS).any(|_| pac::SPI1.sr().read().rxne());
        let word = pac::SPI1.dr16().read();
        self.select.set_high();
        if come { Ok(word) } else { Err(BusFault::Transfer) }
    }
}

impl AngleBus for Angle {
    async fn frame(&mut self) -> Result<AngleFrame, BusFault> {
        // Two frames, because the answer to the last call's command is a whole
        // sampling period old.
        let begun = HOLDER.swap(TAKEN, Ordering::AcqRel) == BEGUN;
        let first = if begun { self.receive() } else { self.exchange() };
        cortex_m::asm::delay(SELECT_ROUNDS);
        let second = self.exchange();
        HOLDER.store(IDLE, Ordering::Release);
        first.and(second).map(AngleFrame::new)
    }
}
