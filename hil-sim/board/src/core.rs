//! The processor core as the rest of the emulated board sees it.

pub mod unicorn;

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
    /// Stack pointer of the thread on a stack of its own.
    Psp,
    /// Flags, state of a conditional block, number of the exception.
    Xpsr,
    /// Which stack, whether the floating-point context is live.
    Control,
    /// Shuts out every exception with a priority that can be set.
    Primask,
    /// Shuts out exceptions of this priority and less urgent ones.
    Basepri,
    /// Shuts out all but the non-maskable interrupt.
    Faultmask,
    /// S0 to S31.
    Float(u8),
    /// Flags and modes of the floating-point unit.
    Fpscr,
}

/// Why the core stopped, and where it goes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// At this breakpoint instruction.
    Breakpoint(u32),
    /// The cycles allowed were used up, or the bus wants to be looked after.
    Spent(u32),
    /// An exception wants to be taken that no mask shuts out.
    Urgent(u32),
    /// Behind a supervisor call.
    Call(u32),
    /// An exception handler returned, with this value.
    Return(u32),
    /// Waiting for an event.
    Event(u32),
    /// Waiting for an interrupt.
    Wait(u32),
    /// The program did what a processor faults on.
    Fault {
        /// Program counter.
        at: u32,
        /// What it did.
        fault: Fault,
    },
}

/// What a processor faults on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// An instruction that is none.
    Undefined,
    /// Nothing to run there.
    Fetch,
    /// Reading where nothing answers.
    Read,
    /// Writing where nothing takes it.
    Write,
    /// Something else that the engine does not name.
    Other,
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
    pub const fn since(self, earlier: Self) -> Self {
        Self {
            cycles: self.cycles - earlier.cycles,
            instructions: self.instructions - earlier.instructions,
        }
    }
}

/// The program has come to a marked address.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mark {
    /// Cycles so far, the block that begins there included.
    pub cycles: u64,
    /// Where.
    pub address: u32,
    /// What R0 held.
    pub r0: u32,
}

/// An access to an address that holds no memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Access {
    /// Where.
    pub address: u32,
    /// Bytes: 1, 2 or 4.
    pub size: u32,
    /// The program counter: the beginning of the block under way.
    pub pc: u32,
    /// Cycles since the start.
    pub now: u64,
}

/// What answers the addresses that hold no memory, and interrupts the core.
pub trait Bus {
    /// Ranges that it answers: first address and bytes, a multiple of 4096.
    fn ranges(&self) -> Vec<(u32, u32)>;

    /// Reads.
    fn read(&mut self, access: Access) -> u32;

    /// Writes.
    fn write(&mut self, access: Access, value: u32);

    /// Writes where code lies, which may not be written as memory. False if nothing takes
    /// it: a fault.
    fn write_code(&mut self, _access: Access, _value: u32) -> bool {
        false
    }

    /// Cycle at which something happens by itself; the core stops no earlier than its
    /// next block after it.
    fn deadline(&self) -> u64;

    /// Priority of the exception that is to be taken next, if it preempts what runs
    /// and no mask shuts it out.
    fn urgent(&self) -> Option<i16>;

    /// The program has sent an event.
    fn event(&mut self);
}

/// A core by itself: nothing answers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NoBus;

impl Bus for NoBus {
    fn ranges(&self) -> Vec<(u32, u32)> {
        Vec::new()
    }

    fn read(&mut self, _: Access) -> u32 {
        0
    }

    fn write(&mut self, _: Access, _: u32) {}

    fn deadline(&self) -> u64 {
        u64::MAX
    }

    fn urgent(&self) -> Option<i16> {
        None
    }

    fn event(&mut self) {}
}

/// Whether an exception of this priority passes the masks.
///
/// Source: ARMv7-M Architecture Reference Manual, B1.5.4 (`ExecutionPriority`).
pub fn passes(priority: i16, primask: u32, basepri: u32, faultmask: u32) -> bool {
    let mut level = i16::MAX;
    if basepri & 0xFF != 0 {
        level = (basepri & 0xFF) as i16;
    }
    if primask & 1 != 0 {
        level = 0;
    }
    if faultmask & 1 != 0 {
        level = -1;
    }
    priority < level
}

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

    /// Runs from `address` until something stops the core, `cycles` at most.
    ///
    /// # Errors
    /// [`CoreError::Engine`] if the engine fails.
    fn run(&mut self, address: u32, cycles: u64) -> Result<Stop, CoreError>;

    /// Runs from `address` until the program comes to `until`, or as [`Core::run`].
    ///
    /// Slow: code is translated anew for the place to stop at.
    ///
    /// # Errors
    /// As [`Core::run`].
    fn run_to(&mut self, address: u32, cycles: u64, until: u32) -> Result<Stop, CoreError>;

    /// Carries out the one instruction at `address`, or the conditional block that begins
    /// there.
    ///
    /// Slow: code is translated anew for it.
    ///
    /// # Errors
    /// As [`Core::run`].
    fn step(&mut self, address: u32) -> Result<Stop, CoreError>;

    /// Lets time pass in which no instruction is executed.
    fn pass(&mut self, cycles: u64);

    /// What has been executed so far.
    fn meter(&self) -> Meter;

    /// Notes from now on whenever the program comes to this address.
    ///
    /// # Errors
    /// [`CoreError::Engine`] if the engine refuses.
    fn mark(&mut self, address: u32) -> Result<(), CoreError>;

    /// Moves the notes taken since the last call into `marks`, in their order.
    fn take_marks(&mut self, marks: &mut Vec<Mark>);
}
