//! The processor core, as the rest of the emulated board uses it.

pub mod unicorn;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Register {
    R(u8),
    /// Stack pointer in use.
    Sp,
    Lr,
    Pc,
    /// Stack pointer of the thread on a stack of its own.
    Psp,
    /// Flags, state of a conditional block, number of the exception.
    Xpsr,
    /// Which stack, whether the floating-point context is live.
    Control,
    /// Masks every exception with a configurable priority.
    Primask,
    /// Masks exceptions of this priority and less urgent ones.
    Basepri,
    /// Masks all but the non-maskable interrupt.
    Faultmask,
    /// S0 to S31.
    Float(u8),
    /// Flags and modes of the floating-point unit.
    Fpscr,
}

/// Why the core stopped, and the address at which it continues.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// At this breakpoint instruction.
    Breakpoint(u32),
    /// The cycles are used up, the bus has a deadline, or an exception that no mask excludes is
    /// pending.
    Spent(u32),
    /// After a supervisor call.
    Call(u32),
    /// An exception handler returned, with this value.
    Return(u32),
    /// Waiting for an event.
    Event(u32),
    /// Waiting for an interrupt.
    Wait(u32),
    /// The program caused a fault.
    Fault {
        /// Program counter.
        at: u32,
        fault: Fault,
    },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    Undefined,
    /// A fetch from an address without code.
    Fetch,
    /// A read without an answer.
    Read,
    /// A write without an answer.
    Write,
    /// A read or write that the memory protection unit forbids.
    Guarded,
    Other,
}

/// What can go wrong on the core.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CoreError {
    /// The engine refused a request, with this answer.
    #[error("the emulator failed: {0}")]
    Engine(String),
    #[error("the image has no loop")]
    NoLoop,
}

/// Cycles and instructions since the start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Meter {
    /// Textbook cycles, see `timing`.
    pub cycles: u64,
    /// Instructions, including those that a condition skips.
    pub instructions: u64,
}

impl Meter {
    /// The difference to `earlier`.
    pub const fn since(self, earlier: Self) -> Self {
        Self {
            cycles: self.cycles - earlier.cycles,
            instructions: self.instructions - earlier.instructions,
        }
    }
}

/// The program got to a marked address.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mark {
    /// Cycles so far, including the block that begins there.
    pub cycles: u64,
    /// Cycles that the flash would have cost so far, see `accelerator`.
    pub waits: u64,
    pub address: u32,
    pub r0: u32,
}

/// An access to an address without memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Access {
    pub address: u32,
    /// Bytes: 1, 2 or 4.
    pub size: u32,
    /// The program counter: the beginning of the current block.
    pub pc: u32,
    /// Cycles since the start.
    pub now: u64,
}

/// The devices at addresses without memory, which interrupt the core.
pub trait Bus {
    /// Ranges that it answers: first address and bytes, a multiple of 4096.
    fn ranges(&self) -> Vec<(u32, u32)> {
        Vec::new()
    }

    fn read(&mut self, _access: Access) -> u32 {
        0
    }

    fn write(&mut self, _access: Access, _value: u32) {}

    /// Writes to flash, which is not writable as memory; false is a fault.
    fn write_code(&mut self, _access: Access, _value: u32) -> bool {
        false
    }

    /// Reads or executes bytes of flash of which some are wrong, see
    /// `UnicornCore::set_spoilt`.
    fn read_spoilt(&mut self, _access: Access) {}

    /// Cycle at which something happens by itself; the core stops at the first block after it.
    fn deadline(&self) -> u64 {
        u64::MAX
    }

    /// Priority of the pending exception that preempts the running code unless it is masked.
    fn urgent(&self) -> Option<i16> {
        None
    }

    /// The core's clock, Hz, while it is slower than full.
    fn slow_hz(&self) -> Option<u64> {
        None
    }

    /// The program has sent an event.
    fn event(&mut self) {}
}

/// No bus: nothing answers and nothing interrupts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NoBus;

impl Bus for NoBus {}
