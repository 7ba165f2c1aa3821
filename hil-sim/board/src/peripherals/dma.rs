//! DMA1 with its request multiplexer.
//!
//! Transfers from a peripheral to memory, one for each request: channels with their
//! counters and flags. The chip connects the requests and moves the data.
//!
//! Source: RM0440, chapters of DMA and DMAMUX.

use super::registers::{Kept, Registers};
use super::{Peripheral, Write};
use crate::rules::Rule;

pub const CHANNELS: usize = 8;

const ISR: u32 = 0x00;
const IFCR: u32 = 0x04;
const FIRST: u32 = 0x08;
const STRIDE: u32 = 0x14;

const ENABLE: u32 = 1;
const FROM_MEMORY: u32 = 1 << 4;
const CIRCULAR: u32 = 1 << 5;
const STEP_PERIPHERAL: u32 = 1 << 6;
const STEP_MEMORY: u32 = 1 << 7;
const MEMORY_TO_MEMORY: u32 = 1 << 14;
/// Flags of a channel: any, complete, half, error.
const COMPLETE: u32 = 1 << 1;
const HALF: u32 = 1 << 2;
const ERROR: u32 = 1 << 3;

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
    broken: Option<Rule>,
}

impl Dma {
    /// The transfer that channel `index` makes at a request.
    pub fn due(&self, index: usize) -> Option<Move> {
        let c = self.channels.get(index)?;
        if c.config & ENABLE == 0 || c.left == 0 {
            return None;
        }
        let bytes = |shift: u32| 1 << (c.config >> shift & 3).min(2);
        let (memory, peripheral) = (bytes(10), bytes(8));
        let at = |base: u32, bytes: u32, steps: u32| {
            if c.config & steps == 0 { base } else { base + bytes * c.done }
        };
        Some(Move {
            channel: index,
            memory: (at(c.memory, memory, STEP_MEMORY), memory),
            peripheral: (at(c.peripheral, peripheral, STEP_PERIPHERAL), peripheral),
        })
    }

    /// The channel's transfer is done, or `found` no memory or register at its address.
    pub fn moved(&mut self, index: usize, found: bool) {
        let c = &mut self.channels[index];
        if !found {
            c.flags |= ERROR;
            c.config &= !ENABLE;
            return;
        }
        c.left -= 1;
        c.done += 1;
        if c.done * 2 == c.total {
            c.flags |= HALF;
        }
        if c.left == 0 {
            c.flags |= COMPLETE;
            if c.config & CIRCULAR != 0 {
                c.left = c.total;
                c.done = 0;
            }
        }
    }

    /// Whether a channel requests its interrupt.
    pub fn requests(&self, index: usize) -> bool {
        // Flags and their enables have the same bits.
        self.channels[index].flags & self.channels[index].config & (COMPLETE | HALF | ERROR) != 0
    }
}

/// Channel and register of an offset.
fn place(offset: u32) -> Option<(usize, u32)> {
    let rest = offset.checked_sub(FIRST)?;
    let (channel, register) = ((rest / STRIDE) as usize, rest % STRIDE);
    (channel < CHANNELS && register < 0x10).then_some((channel, register))
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
            0x0 => c.config,
            0x4 => c.left,
            0x8 => c.peripheral,
            _ => c.memory,
        })
    }

    fn write(&mut self, offset: u32, write: Write, _: u64) -> Option<()> {
        if offset == IFCR {
            for (index, c) in self.channels.iter_mut().enumerate() {
                let flags = write.ones() >> (4 * index) & 0xF;
                c.flags &= !(if flags & 1 != 0 { 0xF } else { flags });
            }
            return Some(());
        }
        let (channel, register) = place(offset)?;
        let c = &mut self.channels[channel];
        let enabled = c.config & ENABLE != 0;
        match register {
            0x0 => {
                let next = write.onto(c.config) & 0x7FFF;
                if next & (MEMORY_TO_MEMORY | FROM_MEMORY) != 0 {
                    return None;
                }
                if enabled && next & ENABLE != 0 && next != c.config {
                    self.broken = Some(Rule::DmaEnabled);
                    return Some(());
                }
                if next & ENABLE != 0 && !enabled {
                    (c.total, c.done) = (c.left, 0);
                }
                c.config = next;
            }
            _ if enabled => self.broken = Some(Rule::DmaEnabled),
            0x4 => c.left = write.onto(c.left) & 0xFFFF,
            0x8 => c.peripheral = write.onto(c.peripheral),
            _ => c.memory = write.onto(c.memory),
        }
        Some(())
    }

    fn take_broken_rule(&mut self) -> Option<Rule> {
        self.broken.take()
    }
}

/// Request of a channel; requests of a synchronisation event, and event generation.
const REQUEST: u32 = 0x7F;
const COUNT: u32 = 0x1F << 19 | 1 << 9;

/// The request multiplexer.
#[derive(Clone, Debug)]
pub struct Dmamux(Registers);

impl Default for Dmamux {
    fn default() -> Self {
        let request = |channel| Kept { offset: 4 * channel, reset: 0, mask: REQUEST | COUNT };
        // Without synchronisation its flags are zero.
        Self(Registers::new(
            &std::array::from_fn::<_, 16, _>(|at| request(at as u32)),
            &[],
            &[0x80, 0x84],
        ))
    }
}

impl Dmamux {
    /// The request that channel `index` of DMA1 listens to; 0 is none.
    pub fn request(&self, index: usize) -> u32 {
        self.0.get(4 * index as u32) & REQUEST
    }
}

impl Peripheral for Dmamux {
    fn read(&mut self, offset: u32, _: u64) -> Option<u32> {
        self.0.read(offset)
    }

    fn write(&mut self, offset: u32, write: Write, _: u64) -> Option<()> {
        // Synchronisation and event generation are not modelled; the count of their requests
        // has no effect.
        if offset < 0x40 && write.ones() & !(REQUEST | COUNT) != 0 {
            return None;
        }
        self.0.write(offset, write)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: u32 = u32::MAX;

    fn write(dma: &mut Dma, offset: u32, value: u32) {
        dma.write(offset, Write { value, mask: ALL }, 0).expect("modelled");
    }

    /// Channel 3 takes two halfwords from 0x4001_300C into memory.
    fn ready() -> Dma {
        let mut dma = Dma::default();
        let base = FIRST + 2 * STRIDE;
        write(&mut dma, base + 4, 2);
        write(&mut dma, base + 8, 0x4001_300C);
        write(&mut dma, base + 12, 0x2000_0100);
        write(&mut dma, base, 1 << 10 | 1 << 8 | STEP_MEMORY | 2 | ENABLE);
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
        assert_eq!(dma.read(ISR, 0), Some((COMPLETE | HALF | 1) << 8));
        write(&mut dma, IFCR, 1 << 8);
        assert!(!dma.requests(2));
    }

    #[test]
    fn a_running_channel_keeps_its_addresses() {
        let mut dma = ready();
        write(&mut dma, FIRST + 2 * STRIDE + 12, 0);
        assert_eq!(dma.due(2).expect("due").memory.0, 0x2000_0100);
    }

    #[test]
    fn a_wrong_address_ends_it_with_an_error() {
        let mut dma = ready();
        dma.moved(2, false);
        assert_eq!(dma.read(ISR, 0), Some((ERROR | 1) << 8));
        assert_eq!(dma.due(2), None);
    }
}
