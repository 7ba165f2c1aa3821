//! SPI1 as master with frames of up to 16 bits, and the angle sensor at its other end.

use super::registers::Registers;
use super::{Peripheral, Why, Write};
use crate::description::{SPI1, bits, spi1::*};

mod angle;

pub use angle::AngleSensor;

/// Registers that the model has in part: a master with two lines and no checksum, without DMA.
const PARTS: [(u32, u32); 2] = [
    (CR1, bits(&[cr1::CPHA, cr1::CPOL, cr1::MSTR, cr1::BR, cr1::SPE]) | SELECTS),
    (CR2, !bits(&[cr2::RXDMAEN, cr2::TXDMAEN])),
];
const SELECTS: u32 = bits(&[cr1::LSBFIRST, cr1::SSI, cr1::SSM]);

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
            registers: Registers::of(SPI1, &[CRCPR], &PARTS, &[I2SCFGR]),
            next: None,
            shifting: None,
            taken: None,
            overrun: false,
        }
    }
}

impl Spi {
    fn is_on(&self) -> bool {
        self.registers.has(cr1::SPE) && self.registers.has(cr1::MSTR)
    }

    fn bits(&self) -> u32 {
        self.registers.field(cr2::DS) + 1
    }

    fn bit_cycles(&self) -> u64 {
        2 << self.registers.field(cr1::BR)
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
        Some(Frame {
            sent: sent & (0xFFFF >> (16 - self.bits())),
            bits: self.bits(),
            mode: self.registers.get(CR1) & bits(&[cr1::CPHA, cr1::CPOL]),
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
                let [taken, waits] = [self.taken, self.next].map(|word| u32::from(word.is_some()));
                // A word that waits shows as a filled quarter, half or more of the queues.
                Some(
                    sr::RXNE.at(taken)
                        | sr::FRLVL.at(2 * taken)
                        | sr::TXE.at(1 - waits)
                        | sr::FTLVL.at(3 * waits)
                        | sr::OVR.at(self.overrun.into())
                        | sr::BSY.at(self.shifting.is_some().into()),
                )
            }
            DR => {
                self.overrun = false;
                Some(u32::from(self.taken.take().unwrap_or(0)))
            }
            _ => self.registers.read(offset),
        }
    }

    fn write(&mut self, offset: u32, write: Write, now: u64) -> Result<(), Why> {
        match offset {
            // Reading clears its flags.
            SR => {}
            DR => {
                if self.next.is_none() {
                    self.next = Some(write.value as u16);
                }
            }
            _ => self.registers.write(offset, write)?,
        }
        self.start(now);
        Ok(())
    }

    fn deadline(&self) -> u64 {
        self.shifting.map_or(u64::MAX, |(_, end)| end)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::peripherals::tests::write;

    fn ready() -> Spi {
        let mut spi = Spi::default();
        write(&mut spi, CR2, 0xF << 8, 0);
        write(&mut spi, CR1, bits(&[cr1::CPHA, cr1::MSTR, cr1::SPE]) | cr1::BR.at(4), 0);
        spi
    }

    #[test]
    fn a_frame_takes_its_bits_and_brings_one_back() {
        let mut spi = ready();
        write(&mut spi, DR, 0xFFFF, 100);
        assert_eq!(spi.read(SR, 0), Some(bits(&[sr::TXE, sr::BSY])));
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
        assert_eq!(spi.read(SR, 0).map(|flags| sr::OVR.of(flags)), Some(1));
        assert_eq!(spi.read(DR, 0), Some(1));
    }

    #[test]
    fn switched_off_it_sends_nothing() {
        let mut spi = Spi::default();
        write(&mut spi, DR, 1, 0);
        assert_eq!(spi.deadline(), u64::MAX);
    }
}
