//! SPI1 as master with frames of up to 16 bits, and the angle sensor at its other end.

use super::registers::{Kept, Registers};
use super::{Peripheral, Write};

mod angle;

pub use angle::AngleSensor;

const CR1: u32 = 0x00;
const CR2: u32 = 0x04;
const SR: u32 = 0x08;
/// Data register.
pub(crate) const DR: u32 = 0x0C;

const MASTER: u32 = 1 << 2;
const ENABLE: u32 = 1 << 6;
/// Bits of `CR1` that a master with two lines and no checksum uses.
const PLAIN: u32 = 0x3FF;
const TAKEN: u32 = 1;
const EMPTY: u32 = 1 << 1;
const OVERRUN: u32 = 1 << 6;
const BUSY: u32 = 1 << 7;

const REGISTERS: [Kept; 3] = [
    Kept { offset: CR1, reset: 0, mask: PLAIN },
    Kept { offset: CR2, reset: 0x700, mask: 0x7FFC },
    Kept { offset: 0x10, reset: 7, mask: 0xFFFF },
];

/// A frame as it goes over the lines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame {
    /// Bits sent, the first on top.
    pub sent: u16,
    /// How many.
    pub bits: u32,
    /// `CPOL` and `CPHA`.
    pub mode: u32,
    pub bit_cycles: u64,
}

/// The bus.
#[derive(Clone, Debug)]
pub struct Spi {
    registers: Registers,
    /// Frame that waits to be sent.
    next: Option<u16>,
    /// Frame on the lines, and the cycle at which it is complete.
    shifting: Option<(u16, u64)>,
    /// Received frame.
    taken: Option<u16>,
    overrun: bool,
}

impl Default for Spi {
    fn default() -> Self {
        Self {
            registers: Registers::new(&REGISTERS, &[], &[0x1C]),
            next: None,
            shifting: None,
            taken: None,
            overrun: false,
        }
    }
}

impl Spi {
    fn is_on(&self) -> bool {
        self.registers.get(CR1) & (ENABLE | MASTER) == ENABLE | MASTER
    }

    fn bits(&self) -> u32 {
        (self.registers.get(CR2) >> 8 & 0xF) + 1
    }

    fn bit_cycles(&self) -> u64 {
        2 << (self.registers.get(CR1) >> 3 & 7)
    }

    /// Whether a frame is on the lines.
    pub const fn is_busy(&self) -> bool {
        self.shifting.is_some()
    }

    fn start(&mut self, now: u64) {
        if self.is_on()
            && self.shifting.is_none()
            && let Some(word) = self.next.take()
        {
            self.shifting = Some((word, now + self.bit_cycles() * u64::from(self.bits())));
        }
    }

    /// Takes the completed frame; [`Spi::answer`] gives its answer.
    pub fn over(&mut self, now: u64) -> Option<Frame> {
        let (sent, _) = self.shifting.filter(|(_, end)| *end <= now)?;
        self.shifting = None;
        let bits = self.bits();
        Some(Frame {
            sent: sent & (0xFFFF >> (16 - bits)),
            bits,
            mode: self.registers.get(CR1) & 3,
            bit_cycles: self.bit_cycles(),
        })
    }

    /// Receives the answer to the completed frame.
    pub fn answer(&mut self, word: u16, now: u64) {
        if self.taken.is_some() {
            self.overrun = true;
        } else {
            self.taken = Some(word);
        }
        self.start(now);
    }
}

impl Peripheral for Spi {
    fn read(&mut self, offset: u32, _: u64) -> Option<u32> {
        match offset {
            SR => {
                let flag = |on: bool, bits: u32| if on { bits } else { 0 };
                // A word that waits shows as a filled quarter, half or more of the queues.
                Some(
                    flag(self.taken.is_some(), TAKEN | 2 << 9)
                        | flag(self.next.is_none(), EMPTY)
                        | flag(self.next.is_some(), 3 << 11)
                        | flag(self.overrun, OVERRUN)
                        | flag(self.shifting.is_some(), BUSY),
                )
            }
            DR => {
                self.overrun = false;
                Some(u32::from(self.taken.take().unwrap_or(0)))
            }
            _ => self.registers.read(offset),
        }
    }

    fn write(&mut self, offset: u32, write: Write, now: u64) -> Option<()> {
        match offset {
            // Reading clears its flags.
            SR => {}
            DR => {
                if self.next.is_none() {
                    self.next = Some(write.value as u16);
                }
            }
            CR1 if write.ones() & !PLAIN != 0 => return None,
            _ => self.registers.write(offset, write)?,
        }
        self.start(now);
        Some(())
    }

    fn deadline(&self) -> u64 {
        self.shifting.map_or(u64::MAX, |(_, end)| end)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn write(spi: &mut Spi, offset: u32, value: u32, now: u64) {
        spi.write(offset, Write { value, mask: u32::MAX }, now).expect("modelled");
    }

    fn ready() -> Spi {
        let mut spi = Spi::default();
        write(&mut spi, CR2, 0xF << 8, 0);
        write(&mut spi, CR1, 1 | MASTER | 4 << 3 | ENABLE, 0);
        spi
    }

    #[test]
    fn a_frame_takes_its_bits_and_brings_one_back() {
        let mut spi = ready();
        write(&mut spi, DR, 0xFFFF, 100);
        assert_eq!(spi.read(SR, 0), Some(EMPTY | BUSY));
        assert_eq!(spi.deadline(), 100 + 16 * 32);
        assert_eq!(spi.over(611), None);
        let frame = Frame { sent: 0xFFFF, bits: 16, mode: 1, bit_cycles: 32 };
        assert_eq!(spi.over(612), Some(frame));
        spi.answer(0x1234, 612);
        assert_eq!(spi.read(DR, 0), Some(0x1234));
    }

    #[test]
    fn a_word_after_one_that_was_not_read_is_an_overrun() {
        let mut spi = ready();
        for word in [1, 2] {
            write(&mut spi, DR, 0, 0);
            assert!(spi.over(u64::MAX).is_some());
            spi.answer(word, 0);
        }
        assert_eq!(spi.read(SR, 0).map(|flags| flags & OVERRUN), Some(OVERRUN));
        assert_eq!(spi.read(DR, 0), Some(1));
    }

    #[test]
    fn switched_off_it_sends_nothing() {
        let mut spi = Spi::default();
        write(&mut spi, DR, 1, 0);
        assert_eq!(spi.deadline(), u64::MAX);
    }
}
