//! Real-time transfer as a debug probe does it: rings in the board's memory, read and
//! written without the program taking part.
//!
//! Source: SEGGER, RTT implementation (wiki, "Real Time Transfer"), layout of the
//! control block; what makes a handle stale: probe-rs 0.32, `rtt/channel.rs`.

use hil_sim::probe::{Access, ChannelError, Channels, Rtt};

use super::core::CoreError;
use super::error::ImageError;
use super::machine::Machine;

/// Symbol of the control block.
const SYMBOL: &str = "_SEGGER_RTT";
/// Its first bytes once the program has set it up.
const MARK: &[u8; 16] = b"SEGGER RTT\0\0\0\0\0\0";
/// Bytes before the channels, and of a channel's record.
const HEAD: u32 = 24;
const CHANNEL: u32 = 24;
/// Largest plausible ring, bytes.
const LARGEST: u32 = 64 * 1024;

/// A probe with the address of the control block, and what it knows of the channels.
#[derive(Debug)]
pub(crate) struct Probe {
    block: u32,
    channels: Channels<Offsets>,
}

/// Read offset of each channel up after its last read, as probe-rs keeps it.
type Offsets = [Option<u32>; 8];

struct Link<'a> {
    block: u32,
    machine: &'a mut Machine,
}

/// A ring: address of its record and its buffer, bytes, write and read offsets.
struct Ring {
    at: u32,
    buffer: u32,
    size: u32,
    write: u32,
    read: u32,
}

impl Probe {
    /// Finds the control block of the image.
    pub(crate) fn of(machine: &Machine) -> Result<Self, ImageError> {
        Ok(Self { block: machine.image.symbol(SYMBOL)?, channels: Channels::default() })
    }

    /// Makes the channels unknown until the program sets them up again.
    pub(crate) fn forget(&mut self, machine: &mut Machine) -> Result<(), CoreError> {
        self.channels.forget();
        machine.poke(self.block, &[0; MARK.len()])
    }

    /// Takes the bytes that channel `index` has sent.
    pub(crate) fn up(&mut self, machine: &mut Machine, index: u32) -> Result<Vec<u8>, CoreError> {
        self.channels.up(&mut Link { block: self.block, machine }, index)
    }

    /// Sends bytes down channel `index`; returns how many it had room for.
    pub(crate) fn down(
        &mut self,
        machine: &mut Machine,
        index: u32,
        bytes: &[u8],
    ) -> Result<usize, CoreError> {
        self.channels.down(&mut Link { block: self.block, machine }, index, bytes)
    }
}

impl Link<'_> {
    /// The ring of a channel, upwards or downwards; none before the program has set it
    /// up.
    fn ring(&self, index: u32, down: bool) -> Result<Option<Ring>, CoreError> {
        let mut mark = [0; 16];
        self.machine.peek(self.block, &mut mark)?;
        if mark != *MARK {
            return Ok(None);
        }
        let ups = self.machine.word(self.block + 16)?;
        let at = self.block + HEAD + CHANNEL * (if down { ups } else { 0 } + index);
        let word = |offset: u32| self.machine.word(at + offset);
        let ring = Ring { at, buffer: word(4)?, size: word(8)?, write: word(12)?, read: word(16)? };
        let sound = ring.size <= LARGEST && ring.write < ring.size && ring.read < ring.size;
        Ok(sound.then_some(ring))
    }

    /// The ring of a channel up, if its read offset is as it was left.
    fn known(&self, offsets: &Offsets, index: u32) -> Access<Ring, CoreError> {
        let ring = self.ring(index, false)?.ok_or(ChannelError::Stale)?;
        match offsets[index as usize] {
            Some(read) if read != ring.read => Err(ChannelError::Stale),
            _ => Ok(ring),
        }
    }
}

impl Rtt for Link<'_> {
    type Handle = Offsets;
    type Error = CoreError;

    fn attach(&mut self) -> Result<Option<Offsets>, CoreError> {
        Ok(self.ring(0, false)?.map(|_| Offsets::default()))
    }

    fn read(&mut self, offsets: &mut Offsets, index: u32) -> Access<Vec<u8>, CoreError> {
        let ring = self.known(offsets, index)?;
        let mut taken = Vec::new();
        let mut read = ring.read;
        while read != ring.write {
            let end = if ring.write > read { ring.write } else { ring.size };
            let mut part = vec![0; (end - read) as usize];
            self.machine.peek(ring.buffer + read, &mut part)?;
            taken.extend(part);
            read = end % ring.size;
        }
        if !taken.is_empty() {
            self.machine.poke(ring.at + 16, &read.to_le_bytes())?;
        }
        offsets[index as usize] = Some(read);
        Ok(taken)
    }

    fn write(
        &mut self,
        offsets: &mut Offsets,
        heard: Option<u32>,
        index: u32,
        bytes: &[u8],
    ) -> Access<usize, CoreError> {
        if let Some(heard) = heard {
            self.known(offsets, heard)?;
        }
        let ring = self.ring(index, true)?.ok_or(ChannelError::Stale)?;
        let mut write = ring.write;
        for (sent, byte) in bytes.iter().enumerate() {
            let next = (write + 1) % ring.size;
            if next == ring.read {
                return Ok(sent);
            }
            self.machine.poke(ring.buffer + write, &[*byte])?;
            self.machine.poke(ring.at + 12, &next.to_le_bytes())?;
            write = next;
        }
        Ok(bytes.len())
    }
}
