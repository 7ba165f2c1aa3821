//! The emulated board behind the interface of a probe.

use std::time::Duration;

use hil_sim::probe::{Port, PortError};

use crate::bench::Bench;
use crate::core::{Access, Bus};
use crate::error::ImageError;
use crate::machine::Machine;
use crate::peripherals::HZ;
use crate::peripherals::rcc::Cause;
use crate::rtt::Probe;

/// First address of the peripherals.
const PERIPHERALS: u32 = 0x4000_0000;
/// Cycles of a pause between two polls.
const LOOK: u64 = 4000;

/// An emulated board with nothing at its pins.
pub struct EmulatedPort {
    pub machine: Machine,
    probe: Probe,
}

impl EmulatedPort {
    /// A board with this image, before its first instruction.
    pub fn new(elf: &[u8]) -> Result<Self, ImageError> {
        let machine = Machine::new(elf)?;
        Ok(Self { probe: Probe::of(&machine)?, machine })
    }
}

/// A failure of the engine as one of the probe.
pub(crate) fn gone(error: impl std::fmt::Display) -> PortError {
    PortError::Gone(error.to_string())
}

impl Port for EmulatedPort {
    fn up(&mut self, channel: u32) -> Result<Vec<u8>, PortError> {
        self.probe.up(&mut self.machine, channel).map_err(gone)
    }

    fn down(&mut self, channel: u32, bytes: &[u8]) -> Result<usize, PortError> {
        self.probe.down(&mut self.machine, channel, bytes).map_err(gone)
    }

    fn reset(&mut self) -> Result<(), PortError> {
        self.machine.restart(Cause::Software).map_err(gone)?;
        // The rings still hold bytes of the run before.
        self.probe.forget(&mut self.machine).map_err(gone)
    }

    fn memory(&mut self, address: u32, into: &mut [u8]) -> Result<(), PortError> {
        self.machine.peek(address, into).map_err(gone)
    }

    fn pass(&mut self) -> Result<(), PortError> {
        self.machine.run_on(self.machine.now() + LOOK).map_err(gone)
    }

    fn now(&self) -> Duration {
        Duration::from_secs_f64(self.machine.now() as f64 / HZ as f64)
    }
}

/// The bench by its console: log and line, a millisecond between two polls.
impl Port for Bench<'_> {
    fn up(&mut self, channel: u32) -> Result<Vec<u8>, PortError> {
        match channel {
            1 => self.read_log().map_err(gone),
            2 => self.line_take().map_err(gone),
            _ => Ok(Vec::new()),
        }
    }

    fn down(&mut self, channel: u32, bytes: &[u8]) -> Result<usize, PortError> {
        match (channel, bytes) {
            (0, [letter]) => self.send(*letter).map(usize::from).map_err(gone),
            (1, bytes) => self.line_send(bytes).map_err(gone),
            _ => Err(PortError::Board(format!("nothing sends down channel {channel}"))),
        }
    }

    fn reset(&mut self) -> Result<(), PortError> {
        self.hold_reset(1).map_err(gone)
    }

    fn memory(&mut self, address: u32, into: &mut [u8]) -> Result<(), PortError> {
        let machine = &mut self.machine;
        if address < PERIPHERALS {
            return machine.peek(address, into).map_err(gone);
        }
        let now = machine.now();
        let access = Access { address, size: 4, pc: 0, now };
        let word = machine.chip_mut().read(access).to_le_bytes();
        into.iter_mut().zip(word).for_each(|(byte, read)| *byte = read);
        Ok(())
    }

    fn pass(&mut self) -> Result<(), PortError> {
        self.step().map(drop).map_err(gone)
    }

    fn now(&self) -> Duration {
        Duration::from_secs_f64(self.time_s())
    }
}
