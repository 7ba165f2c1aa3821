//! The processor core as the rest of the emulated board sees it.

pub mod unicorn;

use std::collections::BTreeMap;

/// A core register.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Register {
    /// R0 to R12.
    R(u8),
    /// Stack pointer in use.
    Sp,
    /// Link register.
    Lr,
    /// Program counter.
    Pc,
}

/// Why the core stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// At this breakpoint instruction.
    Breakpoint(u32),
    /// The cycles allowed were used up, at this address.
    Spent(u32),
}

/// What can go wrong on the core.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CoreError {
    /// The engine refused something.
    #[error("the emulator failed to {what}: {why}")]
    Engine {
        /// What it was to do.
        what: &'static str,
        /// What it said.
        why: String,
    },
    /// The program did what a processor faults on.
    #[error("the core stopped at {at:#010x} (called from {lr:#010x}): {why}")]
    Fault {
        /// Program counter.
        at: u32,
        /// Link register.
        lr: u32,
        /// What the engine said.
        why: String,
    },
}

/// What has been executed since the start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Meter {
    /// Textbook cycles, see [`super::timing`].
    pub cycles: u64,
    /// Instructions, those skipped by a condition included.
    pub instructions: u64,
}

impl Meter {
    /// What has been executed since `earlier`.
    #[must_use]
    pub const fn since(self, earlier: Self) -> Self {
        Self {
            cycles: self.cycles - earlier.cycles,
            instructions: self.instructions - earlier.instructions,
        }
    }
}

/// Cycles by the basic block that spent them, given as address and bytes.
pub type Heat = BTreeMap<(u32, u32), u64>;

/// A Cortex-M4 with its memory: registers, running, counting.
///
/// Addresses that hold no memory are the board's to answer; an access to one that
/// nothing answers ends the run.
pub trait Core {
    /// Reads memory.
    ///
    /// # Errors
    /// [`CoreError::Engine`] if nothing lies there.
    fn read(&self, address: u32, into: &mut [u8]) -> Result<(), CoreError>;

    /// Writes memory, flash too.
    ///
    /// # Errors
    /// [`CoreError::Engine`] if nothing lies there.
    fn write(&mut self, address: u32, bytes: &[u8]) -> Result<(), CoreError>;

    /// A register's value.
    ///
    /// # Errors
    /// [`CoreError::Engine`] if the engine does not tell.
    fn register(&self, register: Register) -> Result<u32, CoreError>;

    /// Sets a register.
    ///
    /// # Errors
    /// [`CoreError::Engine`] if the engine does not take it.
    fn set_register(&mut self, register: Register, value: u32) -> Result<(), CoreError>;

    /// Runs from `address` until a breakpoint instruction, or until `cycles` have gone.
    ///
    /// # Errors
    /// [`CoreError::Fault`] if the program faults.
    fn run(&mut self, address: u32, cycles: u64) -> Result<Stop, CoreError>;

    /// What has been executed so far.
    fn meter(&self) -> Meter;

    /// Takes the cycles by block since the last call, or since the start.
    fn take_heat(&mut self) -> Heat;
}
