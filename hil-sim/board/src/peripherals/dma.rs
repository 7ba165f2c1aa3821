//! DMA1 with its request multiplexer.
//!
//! Transfers from a peripheral to memory, one for each request: channels with their
//! counters and flags. The chip connects the requests and moves the data.
//!
//! Source: RM0440, chapters of DMA and DMAMUX.

use super::registers::Registers;
use super::{Peripheral, Why, Write};
use crate::description::dma1::*;
use crate::description::{DMAMUX, Field, bits, dmamux};
use crate::rules::Rule;

pub(crate) const CHANNELS: usize = 8;

/// Bytes from a channel's registers to the next's.
const STRIDE: u32 = CH2_CR - CH1_CR;

/// A channel, with the offsets and fields of the first.
#[derive(Clone, Copy, Debug, Default)]
struct Channel {
    config: u32,
    left: u32,
    peripheral: u32,
    memory: u32,
    /// Transfers at the enabling, and transfers done since.
    total: u32,
    done: u32,
    flags: u32,
}

/// A transfer that is due, from a peripheral to memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Move {
    pub channel: usize,
    /// Address in memory and bytes there.
    pub memory: (u32, u32),
    /// Address of the peripheral's register and bytes there.
    pub peripheral: (u32, u32),
}

/// The controller.
#[derive(Clone, Debug, Default)]
pub struct Dma {
    channels: [Channel; CHANNELS],
}

impl Dma {
    /// The transfer that channel `index` makes at a request.
    pub(crate) fn due(&self, index: usize) -> Option<Move> {
        let c = self.channels.get(index)?;
        if !ch1_cr::EN.is_in(c.config) || c.left == 0 {
            return None;
        }
        let bytes = |size: Field| 1 << size.of(c.config).min(2);
        let (memory, peripheral) = (bytes(ch1_cr::MSIZE), bytes(ch1_cr::PSIZE));
        let at = |base: u32, bytes: u32, steps: Field| {
            if steps.is_in(c.config) { base + bytes * c.done } else { base }
        };
        Some(Move {
            channel: index,
            memory: (at(c.memory, memory, ch1_cr::MINC), memory),
            peripheral: (at(c.peripheral, peripheral, ch1_cr::PINC), peripheral),
        })
    }

    /// The channel's transfer is done, or `found` no memory or register at its address.
    pub fn moved(&mut self, index: usize, found: bool) {
        let c = &mut self.channels[index];
        if !found {
            c.flags |= isr::TEIF1.mask;
            c.config &= !ch1_cr::EN.mask;
            return;
        }
        c.left -= 1;
        c.done += 1;
        if c.done * 2 == c.total {
            c.flags |= isr::HTIF1.mask;
        }
        if c.left == 0 {
            c.flags |= isr::TCIF1.mask;
            if ch1_cr::CIRC.is_in(c.config) {
                c.left = c.total;
                c.done = 0;
            }
        }
    }

    /// Whether a channel requests its interrupt.
    pub fn requests(&self, index: usize) -> bool {
        // Flags and their enables have the same bits.
        let enables = bits(&[ch1_cr::TCIE, ch1_cr::HTIE, ch1_cr::TEIE]);
        self.channels[index].flags & self.channels[index].config & enables != 0
    }
}

/// Channel of an offset, and the same register's offset in the first.
fn place(offset: u32) -> Option<(usize, u32)> {
    let rest = offset.checked_sub(CH1_CR)?;
    let (channel, register) = ((rest / STRIDE) as usize, CH1_CR + rest % STRIDE);
    (channel < CHANNELS && register <= CH1_MAR).then_some((channel, register))
}

impl Peripheral for Dma {
    fn read(&mut self, offset: u32, _: u64) -> Option<u32> {
        if offset == ISR {
            let word =
                |(index, c): (usize, &Channel)| (c.flags | u32::from(c.flags != 0)) << (4 * index);
            return Some(self.channels.iter().enumerate().map(word).fold(0, |a, b| a | b));
        }
        if offset == IFCR {
            return Some(0);
        }
        let (channel, register) = place(offset)?;
        let c = &self.channels[channel];
        Some(match register {
            CH1_CR => c.config,
            CH1_NDTR => c.left,
            CH1_PAR => c.peripheral,
            _ => c.memory,
        })
    }

    fn write(&mut self, offset: u32, write: Write, _: u64) -> Result<(), Why> {
        if offset == IFCR {
            for (index, c) in self.channels.iter_mut().enumerate() {
                let flags = write.ones() >> (4 * index) & 0xF;
                c.flags &= !(if flags & 1 != 0 { 0xF } else { flags });
            }
            return Ok(());
        }
        let (channel, register) = place(offset).ok_or(Why::NoModel)?;
        let c = &mut self.channels[channel];
        let enabled = ch1_cr::EN.is_in(c.config);
        match register {
            CH1_CR => {
                let next = write.onto(c.config);
                let enables = ch1_cr::EN.is_in(next);
                // Out of memory is not modelled.
                if ch1_cr::MEM2MEM.is_in(next) || ch1_cr::DIR.is_in(next) {
                    return Err(Why::NoModel);
                }
                if enabled && enables && next != c.config {
                    return Err(Why::Broken(Rule::DmaEnabled));
                }
                if enables && !enabled {
                    (c.total, c.done) = (c.left, 0);
                }
                c.config = next;
            }
            _ if enabled => return Err(Why::Broken(Rule::DmaEnabled)),
            CH1_NDTR => c.left = ch1_ndtr::NDT.of(write.onto(c.left)),
            CH1_PAR => c.peripheral = write.onto(c.peripheral),
            _ => c.memory = write.onto(c.memory),
        }
        Ok(())
    }
}

/// The request multiplexer. Synchronisation and event generation are not modelled: the count of
/// their requests has no effect, their flags are zero.
pub(crate) fn multiplexer() -> Registers {
    use dmamux::ccr0;
    let request = bits(&[ccr0::DMAREQ_ID, ccr0::EGE, ccr0::NBREQ]);
    let channels = (dmamux::CCR0..=dmamux::CCR15).step_by(4).map(|offset| (offset, request));
    Registers::of(DMAMUX, &[], &channels.collect::<Vec<_>>(), &[dmamux::CSR, dmamux::CFR])
}

/// The request that channel `index` of DMA1 listens to, by the multiplexer; 0 is none.
pub fn request(multiplexer: &Registers, index: usize) -> u32 {
    dmamux::ccr0::DMAREQ_ID.of(multiplexer.get(dmamux::CCR0 + 4 * index as u32))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::peripherals::tests::write;

    /// Channel 3 takes two halfwords from 0x4001_300C into memory.
    fn ready() -> Dma {
        let mut dma = Dma::default();
        write(&mut dma, CH3_NDTR, 2, 0);
        write(&mut dma, CH3_PAR, 0x4001_300C, 0);
        write(&mut dma, CH3_MAR, 0x2000_0100, 0);
        let halfwords = ch3_cr::MSIZE.at(1) | ch3_cr::PSIZE.at(1);
        write(&mut dma, CH3_CR, halfwords | bits(&[ch3_cr::MINC, ch3_cr::TCIE, ch3_cr::EN]), 0);
        dma
    }

    #[test]
    fn each_request_moves_one_and_the_last_raises_the_flag() {
        let mut dma = ready();
        let first = dma.due(2).expect("due");
        assert_eq!(first.memory, (0x2000_0100, 2));
        assert_eq!(first.peripheral, (0x4001_300C, 2));
        dma.moved(2, true);
        assert!(!dma.requests(2));
        assert_eq!(dma.due(2).expect("due").memory, (0x2000_0102, 2));
        dma.moved(2, true);
        assert!(dma.requests(2));
        assert_eq!(dma.due(2), None);
        assert_eq!(dma.read(ISR, 0), Some(bits(&[isr::GIF3, isr::TCIF3, isr::HTIF3])));
        write(&mut dma, IFCR, ifcr::CGIF3.mask, 0);
        assert!(!dma.requests(2));
        // A wrong address ends it.
        let mut dma = ready();
        dma.moved(2, false);
        assert_eq!(
            (dma.due(2), dma.read(CH3_CR, 0).map(|word| ch3_cr::EN.of(word))),
            (None, Some(0))
        );
    }
}
