//! The emulated board behind the interface of a probe.

use std::time::Duration;

use hil_sim::probe::{Port, PortError};

use crate::error::ImageError;
use crate::machine::Machine;
use crate::peripherals::HZ;
use crate::peripherals::rcc::Cause;
use crate::rtt::Probe;

/// Cycles between two accesses of the probe: a tenth of what a probe on USB needs.
const LOOK: u64 = 4000;

/// An emulated board with nothing at its pins.
pub struct EmulatedPort {
    machine: Machine,
    probe: Probe,
}

impl EmulatedPort {
    /// A board with this image, before its first instruction.
    pub fn new(elf: &[u8]) -> Result<Self, ImageError> {
        let machine = Machine::new(elf)?;
        Ok(Self { probe: Probe::of(&machine)?, machine })
    }

    /// The board.
    pub const fn machine(&self) -> &Machine {
        &self.machine
    }

    /// The board, to be changed.
    pub fn machine_mut(&mut self) -> &mut Machine {
        &mut self.machine
    }
}

/// A failure of the engine as one of the probe.
fn gone(error: impl std::fmt::Display) -> PortError {
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

    fn pass(&mut self) -> Result<Duration, PortError> {
        let before = self.machine.now();
        self.machine.run_on(before + LOOK).map_err(gone)?;
        let passed = self.machine.now() - before;
        Ok(Duration::from_nanos(passed * 1_000_000_000 / HZ))
    }
}
