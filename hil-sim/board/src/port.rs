//! The emulated board behind the interface of a probe.

use std::time::Duration;

use hil_sim::probe::{Port, PortError};

use crate::error::ImageError;
use crate::machine::Machine;
use crate::peripherals::HZ;
use crate::peripherals::rcc::Cause;
use crate::rtt::Probe;

/// Cycles of a pause between two polls.
const LOOK: u64 = 4000;

/// How long accesses take over USB.
#[derive(Clone, Copy, Debug, Default)]
pub struct Usb {
    accesses: u64,
}

impl Usb {
    /// Time of the next access, us: half a millisecond, and an eighth of a second now and then.
    pub const fn access_us(&mut self) -> u64 {
        self.accesses += 1;
        if self.accesses.is_multiple_of(400) { 125_000 } else { 500 }
    }
}

/// An emulated board with nothing at its pins.
pub struct EmulatedPort {
    machine: Machine,
    probe: Probe,
    /// Its accesses take time.
    usb: Option<Usb>,
    /// Cycles that they took since the last pause.
    spent: u64,
}

impl EmulatedPort {
    /// A board with this image, before its first instruction.
    pub fn new(elf: &[u8]) -> Result<Self, ImageError> {
        let machine = Machine::new(elf)?;
        Ok(Self { probe: Probe::of(&machine)?, machine, usb: None, spent: 0 })
    }

    /// The same at a probe on USB; otherwise an access takes no time.
    pub fn on_usb(self) -> Self {
        Self { usb: Some(Usb::default()), ..self }
    }

    /// Lets the time of so many accesses pass.
    fn access(&mut self, accesses: u32) -> Result<(), PortError> {
        let Some(usb) = &mut self.usb else { return Ok(()) };
        let us: u64 = (0..accesses).map(|_| usb.access_us()).sum();
        self.run(us * (HZ / 1_000_000))
    }

    fn run(&mut self, cycles: u64) -> Result<(), PortError> {
        let before = self.machine.now();
        self.machine.run_on(before + cycles).map_err(gone)?;
        self.spent += self.machine.now() - before;
        Ok(())
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
        // The offsets; then data and read offset.
        self.access(1)?;
        let bytes = self.probe.up(&mut self.machine, channel).map_err(gone)?;
        self.access(if bytes.is_empty() { 0 } else { 2 })?;
        Ok(bytes)
    }

    fn down(&mut self, channel: u32, bytes: &[u8]) -> Result<usize, PortError> {
        self.access(4)?;
        self.probe.down(&mut self.machine, channel, bytes).map_err(gone)
    }

    fn reset(&mut self) -> Result<(), PortError> {
        self.machine.restart(Cause::Software).map_err(gone)?;
        // The rings still hold bytes of the run before.
        self.probe.forget(&mut self.machine).map_err(gone)
    }

    fn memory(&mut self, address: u32, into: &mut [u8]) -> Result<(), PortError> {
        self.access(1)?;
        self.machine.peek(address, into).map_err(gone)
    }

    fn pass(&mut self) -> Result<Duration, PortError> {
        self.run(LOOK)?;
        Ok(Duration::from_nanos(std::mem::take(&mut self.spent) * 1_000_000_000 / HZ))
    }
}
