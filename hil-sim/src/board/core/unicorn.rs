//! The core on Unicorn, with a counter of cycles in its block hook.
//!
//! Most of an instruction's cost is known when its block is first seen; what depends
//! on operands or on a condition is added by a hook on just those instructions, which
//! the engine calls only if the instruction is carried out.

use std::collections::HashSet;

use unicorn_engine::{Arch, ArmCpuModel, Mode, Prot, RegisterARM, Unicorn};

use super::{Core, CoreError, Heat, Meter, Register, Stop};
use crate::board::thumb::{self, Kind};
use crate::board::timing::{self, REFILL};

/// Memory of the board, or a stand-in for it.
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
    /// Where in it instructions stand.
    pub code: &'a [std::ops::Range<u32>],
}

/// Interrupt number by which the engine reports a breakpoint instruction.
const BREAKPOINT: u32 = 7;
/// Marks a halfword at which no block has begun yet.
const UNSEEN: u32 = u32::MAX;

/// A straight piece of code.
#[derive(Clone, Copy, Debug)]
struct Block {
    address: u32,
    size: u32,
    instructions: u64,
    cycles: u64,
    /// Cycles spent here since last asked.
    heat: u64,
}

/// What the hooks keep.
struct Count {
    base: u32,
    bytes: Vec<u8>,
    /// Block by the halfword it begins at.
    begins: Vec<u32>,
    blocks: Vec<Block>,
    /// Instructions with a hook of their own.
    late: HashSet<u32>,
    /// Blocks that have heat.
    warm: Vec<u32>,
    /// The block under way.
    current: u32,
    /// Where the program is if it does not branch.
    next: u32,
    meter: Meter,
    /// Cycles at which to stop.
    limit: u64,
    breakpoint: Option<u32>,
}

impl Count {
    fn new(counted: &Counted<'_>) -> Self {
        Self {
            base: counted.base,
            bytes: counted.bytes.to_vec(),
            begins: vec![UNSEEN; counted.bytes.len() / 2],
            blocks: Vec::new(),
            late: HashSet::new(),
            warm: Vec::new(),
            current: UNSEEN,
            next: 0,
            meter: Meter::default(),
            limit: u64::MAX,
            breakpoint: None,
        }
    }

    /// Adds cycles to the total and to the block under way.
    fn spend(&mut self, cycles: u64) {
        self.meter.cycles += cycles;
        if let Some(block) = self.blocks.get_mut(self.current as usize) {
            if block.heat == 0 {
                self.warm.push(self.current);
            }
            block.heat += cycles;
        }
    }

    /// Counts the block that begins here; false if the cycles allowed are used up.
    fn enter(&mut self, address: u32, size: u32) -> bool {
        if self.meter.cycles >= self.limit {
            return false;
        }
        if self.next != address {
            // The branch belongs to the block that ends with it.
            self.spend(REFILL);
        }
        self.next = address.wrapping_add(size);
        let Some(index) = self.block(address, size) else {
            self.current = UNSEEN;
            return true;
        };
        let Block { instructions, cycles, .. } = self.blocks[index as usize];
        self.current = index;
        self.meter.instructions += instructions;
        self.spend(cycles);
        true
    }

    /// The block of this place, decoded when first seen.
    fn block(&mut self, address: u32, size: u32) -> Option<u32> {
        let offset = address.wrapping_sub(self.base) as usize;
        let index = *self.begins.get(offset / 2)?;
        if self.blocks.get(index as usize).is_some_and(|block| block.size == size) {
            return Some(index);
        }
        let code = self.bytes.get(offset..offset + size as usize)?;
        let (mut instructions, mut cycles) = (0, 0);
        // A block may begin under a condition, so the sweep of the whole code decides
        // what is late, not this one.
        for (at, instruction, _) in thumb::sweep(code, address) {
            let late = self.late.contains(&at);
            instructions += 1;
            cycles += 1 + if late { 0 } else { timing::extra(instruction.kind) };
        }
        let index = u32::try_from(self.blocks.len()).ok()?;
        self.blocks.push(Block { address, size, instructions, cycles, heat: 0 });
        self.begins[offset / 2] = index;
        Some(index)
    }
}

/// A Cortex-M4 on Unicorn.
pub struct UnicornCore {
    engine: Unicorn<'static, Count>,
}

/// Gives an engine's error its place.
fn engine<T>(what: &'static str, result: Result<T, impl std::fmt::Debug>) -> Result<T, CoreError> {
    result.map_err(|error| CoreError::Engine { what, why: format!("{error:?}") })
}

impl UnicornCore {
    /// A core with these memories, counting the cycles of `counted`.
    ///
    /// # Errors
    /// [`CoreError::Engine`] if the engine cannot be had or a memory overlaps.
    pub fn new(memories: &[Memory], counted: &Counted<'_>) -> Result<Self, CoreError> {
        // The flag for the microcontroller profile would select another core.
        let new = Unicorn::new_with_data(Arch::ARM, Mode::THUMB, Count::new(counted));
        let mut core = Self { engine: engine("start", new)? };
        let uc = &mut core.engine;
        engine("select the core", uc.ctl_set_cpu_model(ArmCpuModel::CORTEX_M4 as i32))?;
        for memory in memories {
            let access = match memory.access {
                Access::Code => Prot::READ | Prot::EXEC,
                Access::Data => Prot::ALL,
            };
            let mapped = uc.mem_map(memory.base.into(), memory.size.into(), access);
            engine("map a memory", mapped)?;
        }
        core.write(counted.base, counted.bytes)?;
        core.hook(counted)?;
        Ok(core)
    }

    fn hook(&mut self, counted: &Counted<'_>) -> Result<(), CoreError> {
        let uc = &mut self.engine;
        let blocks = uc.add_block_hook(1, 0, |uc, address, size| {
            if !uc.get_data_mut().enter(address as u32, size) {
                // Stopping can only fail if nothing runs.
                let _ = uc.emu_stop();
            }
        });
        engine("hook blocks", blocks)?;
        let traps = uc.add_intr_hook(|uc, number| {
            let at = uc.pc_read().unwrap_or_default() as u32;
            if number == BREAKPOINT {
                uc.get_data_mut().breakpoint = Some(at);
            }
            let _ = uc.emu_stop();
        });
        engine("hook interrupts", traps)?;
        for range in counted.code {
            let bytes = (range.start.wrapping_sub(counted.base) as usize)
                ..(range.end.wrapping_sub(counted.base) as usize);
            let code = counted.bytes.get(bytes).unwrap_or_default();
            for (address, instruction, conditional) in thumb::sweep(code, range.start) {
                if timing::is_late(&instruction, conditional) {
                    self.engine.get_data_mut().late.insert(address);
                    self.hook_late(address, instruction.kind)?;
                }
            }
        }
        Ok(())
    }

    /// Adds what an instruction costs beyond its first cycle whenever it is carried out.
    fn hook_late(&mut self, address: u32, kind: Kind) -> Result<(), CoreError> {
        let at = u64::from(address);
        let hooked = if let Kind::Divide { signed, n, m } = kind {
            self.engine.add_code_hook(at, at, move |uc, _, _| {
                let value = |number| uc.reg_read(general(number)).unwrap_or_default() as u32;
                let cycles = timing::division(signed, value(n), value(m)) - 1;
                uc.get_data_mut().spend(cycles);
            })
        } else {
            let extra = timing::extra(kind);
            self.engine.add_code_hook(at, at, move |uc, _, _| uc.get_data_mut().spend(extra))
        };
        engine("hook an instruction", hooked).map(|_| ())
    }
}

/// The engine's name of R0 to R12.
fn general(number: u8) -> i32 {
    // The engine numbers R0 to R12 in sequence.
    RegisterARM::R0 as i32 + i32::from(number)
}

fn name(register: Register) -> i32 {
    match register {
        Register::R(number) => general(number),
        Register::Sp => RegisterARM::SP as i32,
        Register::Lr => RegisterARM::LR as i32,
        Register::Pc => RegisterARM::PC as i32,
    }
}

impl Core for UnicornCore {
    fn read(&self, address: u32, into: &mut [u8]) -> Result<(), CoreError> {
        engine("read memory", self.engine.mem_read(address.into(), into))
    }

    fn write(&mut self, address: u32, bytes: &[u8]) -> Result<(), CoreError> {
        engine("write memory", self.engine.mem_write(address.into(), bytes))
    }

    fn register(&self, register: Register) -> Result<u32, CoreError> {
        let value = engine("read a register", self.engine.reg_read(name(register)))?;
        Ok(value as u32)
    }

    fn set_register(&mut self, register: Register, value: u32) -> Result<(), CoreError> {
        engine("set a register", self.engine.reg_write(name(register), value.into()))
    }

    fn run(&mut self, address: u32, cycles: u64) -> Result<Stop, CoreError> {
        let count = self.engine.get_data_mut();
        count.breakpoint = None;
        count.limit = count.meter.cycles.saturating_add(cycles);
        count.current = UNSEEN;
        // Where the host starts the program, nothing has branched.
        count.next = address & !1;
        let ended = self.engine.emu_start(u64::from(address | 1), u64::MAX, 0, 0);
        if let Some(at) = self.engine.get_data_mut().breakpoint.take() {
            return Ok(Stop::Breakpoint(at));
        }
        let at = self.register(Register::Pc)?;
        let count = self.engine.get_data();
        match ended {
            Ok(()) if count.meter.cycles >= count.limit => Ok(Stop::Spent(at)),
            ended => {
                let why = ended.map_or_else(|e| format!("{e:?}"), |()| "it gave up".to_owned());
                Err(CoreError::Fault { at, lr: self.register(Register::Lr)?, why })
            }
        }
    }

    fn meter(&self) -> Meter {
        self.engine.get_data().meter
    }

    fn take_heat(&mut self) -> Heat {
        let count = self.engine.get_data_mut();
        let mut heat = Heat::new();
        for index in std::mem::take(&mut count.warm) {
            let block = &mut count.blocks[index as usize];
            *heat.entry((block.address, block.size)).or_default() +=
                std::mem::take(&mut block.heat);
        }
        heat
    }
}

#[cfg(test)]
mod tests;
