//! The emulated board behind the interface of a probe.

use std::time::Duration;

use hil_sim::probe::{Port, PortError};

use crate::error::ImageError;
use crate::machine::Machine;
use crate::peripherals::HZ;
use crate::peripherals::rcc::Cause;
use crate::rtt::Probe;

/// Cycles between two looks at the board: a tenth of what a probe on USB needs.
const LOOK: u64 = 4000;

/// An emulated board with nothing at its pins, and its memory in reach.
pub struct EmulatedPort {
    machine: Machine,
    probe: Probe,
}

impl EmulatedPort {
    /// A board with this image, before its first instruction.
    ///
    /// # Errors
    /// [`ImageError`] if the image is none, or has no RTT channels.
    pub fn new(elf: &[u8]) -> Result<Self, ImageError> {
        let machine = Machine::new(elf)?;
        Ok(Self { probe: Probe::of(&machine)?, machine })
    }

    /// The board.
    #[must_use]
    pub const fn machine(&self) -> &Machine {
        &self.machine
    }

    /// The board, to be tampered with.
    pub fn machine_mut(&mut self) -> &mut Machine {
        &mut self.machine
    }
}

/// The engine's failure is the probe's.
fn gone(error: impl std::fmt::Display) -> PortError {
    PortError::Gone(error.to_string())
}

impl Port for EmulatedPort {
    fn up(&mut self, channel: u32) -> Result<Vec<u8>, PortError> {
        self.probe.up(&mut self.machine, channel).map_err(gone)
    }

    fn down(&mut self, channel: u32, bytes: &[u8]) -> Result<usize, PortError> {
        for (sent, byte) in bytes.iter().enumerate() {
            if !self.probe.down(&mut self.machine, channel, *byte).map_err(gone)? {
                return Ok(sent);
            }
        }
        Ok(bytes.len())
    }

    fn reset(&mut self) -> Result<(), PortError> {
        self.machine.restart(Cause::Software).map_err(gone)?;
        // What the run before has left in its rings is not this one's.
        self.probe.forget(&mut self.machine).map_err(gone)
    }

    fn memory(&mut self, address: u32, into: &mut [u8]) -> Result<(), PortError> {
        self.machine.peek(address, into).map_err(gone)
    }

    fn pass(&mut self) -> Result<Duration, PortError> {
        let before = self.machine.now();
        self.machine.run_on(before + LOOK).map_err(gone)?;
        let passed = self.machine.now() - before;
        Ok(Duration::from_nanos(passed * 1_000_000_000 / HZ))
    }
}
