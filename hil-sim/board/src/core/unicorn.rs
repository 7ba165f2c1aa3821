//! The core on Unicorn, with a counter of cycles in its block hook.
//!
//! Most of an instruction's cost is known at the first execution of its block. A cost that
//! depends on operands or on a condition is deferred to a hook on that instruction, which the
//! engine calls only if the instruction is executed.
//!
//! Properties of the engine (2.1.5) that matter here:
//! - The core is chosen by `Mode::THUMB` and the model `CORTEX_M4`; the flag for the
//!   microcontroller profile would select another core. The floating-point unit is always on.
//! - A block hook comes before the block. A stop in it skips that block, which is not counted.
//! - A hook on a single instruction is not called if a condition skips it. The engine searches all
//!   hooks at each call, so only instructions that the program reaches get one.
//! - By default the engine searches for translated code after every write to RAM, which takes more
//!   than half of its time. A hook of ours provides the pages, and RAM is data until the program
//!   runs in it.
//! - Before the hook of an access the engine sets its IT state to that of the access. If the
//!   access lies inside a conditional block, instructions after the block are then skipped or
//!   undefined. So each such hook empties that state.

mod count;
mod hooks;

use std::collections::HashSet;

use unicorn_engine::{
    Arch, ArmCpuModel, HookType, MemType, Mode, Prot, RegisterARM, TlbEntry, TlbType, UcHookId,
    Unicorn, uc_error,
};

use self::count::Count;
use super::{Access as Touch, Bus, CoreError, Fault, Mark, Meter, NoBus, Register, Stop};
use crate::thumb::{Instruction, sweep};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Memory {
    /// First address.
    pub base: u32,
    /// Bytes, a multiple of 4096.
    pub size: u32,
    /// What the program may do there.
    pub access: Access,
}

/// What a program may do in a memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// Read and run: flash.
    Code,
    /// Read, write and run: RAM.
    Data,
}

/// Code whose cycles are counted: where it lies, and its bytes.
#[derive(Clone, Copy, Debug)]
pub struct Counted<'a> {
    /// Address of the first byte.
    pub base: u32,
    /// Everything from there on, data between the code included.
    pub bytes: &'a [u8],
    /// Address ranges of instructions.
    pub code: &'a [std::ops::Range<u32>],
}

impl Counted<'_> {
    /// Every instruction with its address, and whether it is conditional.
    fn instructions(&self) -> impl Iterator<Item = (u32, Instruction, bool)> {
        self.code.iter().flat_map(|range| {
            let [from, to] = [range.start, range.end].map(|at| at.wrapping_sub(self.base) as usize);
            sweep(self.bytes.get(from..to).unwrap_or_default(), range.start)
        })
    }
}

/// Interrupt number by which the engine reports a supervisor call.
const CALL: u32 = 2;
/// The same of a breakpoint instruction.
const BREAKPOINT: u32 = 7;
/// The same of a return from an exception.
const RETURN: u32 = 8;
/// Bits of a return value that the program counter does not keep.
const RETURN_BITS: u32 = 0xFFFF_FF01;
/// `WFE`, `WFI` and `SEV` in memory.
const WFE: [u8; 2] = [0x20, 0xBF];
const SEV: [u8; 2] = [0x40, 0xBF];
/// The state of thumb code outside of a conditional block, among the flags.
const THUMB: u64 = 1 << 24;
/// The engine's data.
struct Inside<B> {
    count: Count,
    bus: B,
    marks: Vec<Mark>,
    /// Places of flash of which reads are reported to the bus: address and bytes.
    spoilt: Vec<(u32, u32)>,
}

impl<B: Bus> Inside<B> {
    /// The program reads or executes these bytes of flash.
    fn look_for_spoilt(&mut self, address: u32, size: u32) {
        let within = |(base, bytes): &(u32, u32)| address < base + bytes && *base < address + size;
        if self.spoilt.iter().any(within) {
            let (pc, now) = (self.count.block, self.count.meter.cycles);
            self.bus.read_spoilt(Touch { address, size, pc, now });
        }
    }
}

/// A Cortex-M4 on Unicorn.
pub struct UnicornCore<B: Bus + 'static = NoBus> {
    engine: Unicorn<'static, Inside<B>>,
    /// Places without access: address and bytes.
    guards: Vec<(u32, u32)>,
    /// Hooks of deferred instructions, by their addresses.
    own: Vec<(u32, UcHookId)>,
    common: Option<UcHookId>,
    /// The hook of reads of spoilt flash.
    reads: Option<UcHookId>,
}

/// The engine as a hook sees it.
type Hooked<'a, B> = Unicorn<'a, Inside<B>>;

impl From<uc_error> for CoreError {
    fn from(error: uc_error) -> Self {
        Self::Engine(format!("{error:?}"))
    }
}

/// Empties the IT state, which the engine has set to that of the access under way.
fn forget_condition<B: Bus>(uc: &mut Hooked<'_, B>) -> Result<(), uc_error> {
    uc.reg_write(RegisterARM::EPSR, THUMB)
}

impl<B: Bus + 'static> UnicornCore<B> {
    /// A core with these memories and a bus, counting the cycles of `counted`.
    pub fn new(memories: &[Memory], counted: &Counted<'_>, bus: B) -> Result<Self, CoreError> {
        let ranges = bus.ranges();
        let inside =
            Inside { count: Count::new(counted), bus, marks: Vec::new(), spoilt: Vec::new() };
        // The flag for the microcontroller profile would select another core.
        let mut core = Self {
            engine: Unicorn::new_with_data(Arch::ARM, Mode::THUMB, inside)?,
            guards: Vec::new(),
            own: Vec::new(),
            common: None,
            reads: None,
        };
        core.engine.ctl_set_cpu_model(ArmCpuModel::CORTEX_M4 as i32)?;
        core.translate_pages(memories)?;
        for memory in memories {
            let access = match memory.access {
                Access::Code => Prot::READ | Prot::EXEC,
                Access::Data => Prot::ALL,
            };
            core.engine.mem_map(memory.base.into(), memory.size.into(), access)?;
        }
        for (base, size) in ranges {
            core.map_bus(base, size)?;
        }
        core.write(counted.base, counted.bytes)?;
        core.hook(counted)?;
        Ok(core)
    }

    pub fn bus(&self) -> &B {
        &self.engine.get_data().bus
    }

    /// The bus, to be changed between two runs.
    pub(crate) fn bus_mut(&mut self) -> &mut B {
        &mut self.engine.get_data_mut().bus
    }

    /// Sets the places, address and bytes, that the program may not access; everything else in
    /// RAM it may. The host's accesses are not affected.
    pub(crate) fn set_guards(&mut self, guards: Vec<(u32, u32)>) -> Result<(), CoreError> {
        for (base, size) in std::mem::replace(&mut self.guards, guards) {
            self.engine.mem_protect(base.into(), size.into(), Prot::ALL)?;
        }
        for (base, size) in &self.guards {
            self.engine.mem_protect((*base).into(), (*size).into(), Prot::NONE)?;
        }
        Ok(())
    }

    /// Whether the program may not access some of these bytes.
    pub(crate) fn is_guarded(&self, address: u32, bytes: u32) -> bool {
        let within = |(base, size): &(u32, u32)| address < base + size && *base < address + bytes;
        self.guards.iter().any(within)
    }

    /// Sets the places of flash, address and bytes, whose reads the bus is told of. Slow while
    /// there are some: the engine calls a hook at every read.
    pub(crate) fn set_spoilt(&mut self, spoilt: Vec<(u32, u32)>) -> Result<(), CoreError> {
        if self.engine.get_data().spoilt == spoilt {
            return Ok(());
        }
        if let Some(hook) = self.reads.take() {
            self.engine.remove_hook(hook)?;
        }
        let first = spoilt.first().map(|(base, _)| *base);
        let last = spoilt.last().map(|(base, size)| base + (size - 1));
        self.engine.get_data_mut().spoilt = spoilt;
        if let (Some(first), Some(last)) = (first, last) {
            // A read that begins before such a place may reach into it.
            let (first, kind) = (u64::from(first - 3), HookType::MEM_READ);
            let read = self.engine.add_mem_hook(kind, first, last.into(), |uc, _, at, size, _| {
                uc.get_data_mut().look_for_spoilt(at as u32, size as u32);
                forget_condition(uc).is_ok()
            });
            self.reads = Some(read?);
        }
        // Translated code calls such a hook only if it was there.
        Ok(self.engine.ctl_flush_tb()?)
    }

    /// Counts what the flash's wait states cost from now on, see [`crate::accelerator`]. Slow: the
    /// engine calls a hook at every read.
    pub(crate) fn count_waits(&mut self, flash: Memory) -> Result<(), CoreError> {
        self.engine.get_data_mut().count.count_waits();
        let (first, last) = (flash.base.into(), (flash.base + (flash.size - 1)).into());
        self.engine.add_mem_hook(HookType::MEM_READ, first, last, |uc, _, at, _, _| {
            uc.get_data_mut().count.load(at as u32);
            forget_condition(uc).is_ok()
        })?;
        // Translated code calls such a hook only if it was there.
        Ok(self.engine.ctl_flush_tb()?)
    }

    /// Cycles that the flash would have cost since `count_waits`.
    pub fn waits(&self) -> u64 {
        self.engine.get_data().count.waits()
    }

    /// Sets what the engine may use a page for. By default every page is code, and the engine
    /// searches for translated blocks at every write to RAM, which takes most of its time.
    /// Here RAM is data until the program executes in it.
    fn translate_pages(&mut self, memories: &[Memory]) -> Result<(), CoreError> {
        self.engine.ctl_set_tlb_type(TlbType::VIRTUAL)?;
        let data = memories.iter().filter(|m| m.access == Access::Data);
        let data: Vec<_> = data.map(|m| m.base..m.base + m.size).collect();
        let mut run = HashSet::new();
        self.engine.add_tlb_hook(1, 0, move |uc, address, access| {
            let page = address as u32;
            if access == MemType::FETCH {
                run.insert(page);
            } else {
                forget_condition(uc).ok()?;
            }
            let is_data = data.iter().any(|range| range.contains(&page)) && !run.contains(&page);
            // The engine checks the permissions of the memory itself.
            let perms = if is_data { Prot::READ | Prot::WRITE } else { Prot::ALL };
            Some(TlbEntry { paddr: address, perms })
        })?;
        Ok(())
    }

    fn map_bus(&mut self, base: u32, size: u32) -> Result<(), CoreError> {
        let touch = move |uc: &Hooked<'_, B>, offset: u64, size: usize| Touch {
            address: base + offset as u32,
            size: size as u32,
            pc: uc.get_data().count.block,
            now: uc.get_data().count.meter.cycles,
        };
        let read = move |uc: &mut Hooked<'_, B>, offset: u64, size: usize| {
            let access = touch(uc, offset, size);
            u64::from(uc.get_data_mut().bus.read(access))
        };
        let write = move |uc: &mut Hooked<'_, B>, offset: u64, size: usize, value: u64| {
            let access = touch(uc, offset, size);
            uc.get_data_mut().bus.write(access, value as u32);
        };
        Ok(self.engine.mmio_map(base.into(), size.into(), Some(read), Some(write))?)
    }

    /// Runs from `address` until a hook stops it or it gets to `until`.
    fn go(&mut self, address: u32, cycles: u64, until: u64) -> Result<Stop, CoreError> {
        self.choose_hooks()?;
        let count = &mut self.engine.get_data_mut().count;
        count.stop = None;
        count.limit = count.meter.cycles.saturating_add(cycles);
        // A start by the host is no branch.
        count.next = address & !1;
        let mut address = address;
        let ended = loop {
            let ended = self.engine.emu_start(u64::from(address | 1), until, 0, 0);
            let count = &self.engine.get_data().count;
            match count.stop {
                Some(Stop::Spent(at)) if !count.wanted.is_empty() => address = at,
                _ => break ended,
            }
            self.hook_wanted()?;
            self.engine.get_data_mut().count.stop = None;
        };
        if let Some(stop) = self.engine.get_data_mut().count.stop.take() {
            return Ok(stop);
        }
        let at = self.register(Register::Pc)?;
        Ok(match ended {
            // Only waiting for an interrupt ends it without a hook.
            Ok(()) => Stop::Wait(at),
            Err(error) => Stop::Fault { at, fault: fault(error) },
        })
    }
}

fn name(register: Register) -> i32 {
    match register {
        // The engine numbers R0 to R12, and S0 to S31, in sequence.
        Register::R(number) => RegisterARM::R0 as i32 + i32::from(number),
        Register::Sp => RegisterARM::SP as i32,
        Register::Lr => RegisterARM::LR as i32,
        Register::Pc => RegisterARM::PC as i32,
        Register::Psp => RegisterARM::PSP as i32,
        Register::Xpsr => RegisterARM::XPSR as i32,
        Register::Control => RegisterARM::CONTROL as i32,
        Register::Primask => RegisterARM::PRIMASK as i32,
        Register::Basepri => RegisterARM::BASEPRI as i32,
        Register::Faultmask => RegisterARM::FAULTMASK as i32,
        Register::Float(number) => RegisterARM::S0 as i32 + i32::from(number),
        Register::Fpscr => RegisterARM::FPSCR as i32,
    }
}

/// Every method fails if the engine refuses, as for an address without memory.
impl<B: Bus + 'static> UnicornCore<B> {
    pub fn read(&self, address: u32, into: &mut [u8]) -> Result<(), CoreError> {
        Ok(self.engine.mem_read(address.into(), into)?)
    }

    /// Writes memory, flash too.
    pub fn write(&mut self, address: u32, bytes: &[u8]) -> Result<(), CoreError> {
        self.engine.mem_write(address.into(), bytes)?;
        let count = &self.engine.get_data().count;
        if (address.wrapping_sub(count.base) as usize) < count.bytes.len() {
            // Discard the translation of changed code.
            let (from, to) = (u64::from(address & !0xFFF), u64::from(address) + bytes.len() as u64);
            self.engine.ctl_remove_cache(from, to)?;
        }
        Ok(())
    }

    pub fn register(&self, register: Register) -> Result<u32, CoreError> {
        Ok(self.engine.reg_read(name(register))? as u32)
    }

    pub fn set_register(&mut self, register: Register, value: u32) -> Result<(), CoreError> {
        let uc = &mut self.engine;
        if register == Register::Xpsr {
            // The first name sets every field; only the second makes the engine apply the new
            // mode and state.
            uc.reg_write(RegisterARM::XPSR_NZCVQG, value.into())?;
            return Ok(uc.reg_write(RegisterARM::APSR_NZCV, value.into())?);
        }
        Ok(uc.reg_write(name(register), value.into())?)
    }

    /// Whether the masks let an exception of this priority through.
    pub(crate) fn unmasked(&self, priority: i16) -> bool {
        hooks::unmasked(&self.engine, priority)
    }

    /// Runs from `address` until something stops the core, `cycles` at most.
    pub fn run(&mut self, address: u32, cycles: u64) -> Result<Stop, CoreError> {
        self.go(address, cycles, u64::MAX)
    }

    /// The same, or until the program gets to `until`. Slow: the engine translates again.
    pub fn run_to(&mut self, address: u32, cycles: u64, until: u32) -> Result<Stop, CoreError> {
        self.engine.ctl_flush_tb()?;
        let stop = self.go(address, cycles, u64::from(until & !1))?;
        self.engine.ctl_flush_tb()?;
        Ok(match stop {
            Stop::Wait(at) if at & !1 == until & !1 => Stop::Spent(at),
            stop => stop,
        })
    }

    /// Lets time pass in which no instruction is executed.
    pub fn pass(&mut self, cycles: u64) {
        self.engine.get_data_mut().count.meter.cycles += cycles;
    }

    /// Cycles and instructions so far.
    pub(crate) fn meter(&self) -> Meter {
        self.engine.get_data().count.meter
    }

    /// Notes from now on when the program gets to this address.
    pub fn mark(&mut self, address: u32) {
        self.engine.get_data_mut().count.mark(address & !1);
    }

    /// Moves the notes since the last call into `marks`, in their order.
    pub(crate) fn take_marks(&mut self, marks: &mut Vec<Mark>) {
        marks.append(&mut self.engine.get_data_mut().marks);
    }
}

/// The fault for an engine's error.
fn fault(error: uc_error) -> Fault {
    match error {
        uc_error::INSN_INVALID => Fault::Undefined,
        uc_error::FETCH_UNMAPPED | uc_error::FETCH_PROT | uc_error::FETCH_UNALIGNED => Fault::Fetch,
        uc_error::READ_UNMAPPED | uc_error::READ_UNALIGNED => Fault::Read,
        uc_error::WRITE_UNMAPPED | uc_error::WRITE_UNALIGNED => Fault::Write,
        // Flash can be read, and a write to it is answered by its interface.
        uc_error::READ_PROT | uc_error::WRITE_PROT => Fault::Guarded,
        _ => Fault::Other,
    }
}

#[cfg(test)]
mod tests;
