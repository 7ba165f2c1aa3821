//! The debugger's access to the board.

use gdbstub::common::Signal;
use gdbstub::target::ext::base::BaseOps;
use gdbstub::target::ext::base::singlethread::{
    SingleThreadBase, SingleThreadResume, SingleThreadResumeOps, SingleThreadSingleStep,
    SingleThreadSingleStepOps,
};
use gdbstub::target::ext::breakpoints::{
    Breakpoints, BreakpointsOps, SwBreakpoint, SwBreakpointOps,
};
use gdbstub::target::{Target, TargetError, TargetResult};

use super::arch::{Core, CortexM, PC};
use super::{BREAK, Debugged};
use crate::core::{CoreError, Register};
use crate::elf::{FLASH, RAM};
use crate::error::BoardError;

/// The board or its plant failed.
#[derive(Debug, thiserror::Error)]
#[error(transparent)]
pub(super) struct Fatal(pub(super) BoardError);

fn fatal(error: CoreError) -> TargetError<Fatal> {
    TargetError::Fatal(Fatal(error.into()))
}

/// Whether these bytes are in flash or RAM. The debugger has no access to peripherals, some of
/// which a read changes.
fn is_memory(start: u32, bytes: usize) -> bool {
    [FLASH, RAM].iter().any(|memory| {
        let offset = start.wrapping_sub(memory.base) as usize;
        offset < memory.size as usize && bytes <= memory.size as usize - offset
    })
}

/// The registers in GDB's order; the program counter is the machine's own.
fn order() -> impl Iterator<Item = Register> {
    let general = (0..13).map(Register::R);
    general.chain([Register::Sp, Register::Lr, Register::Pc, Register::Xpsr])
}

impl Target for Debugged<'_> {
    type Arch = CortexM;
    type Error = Fatal;

    fn base_ops(&mut self) -> BaseOps<'_, CortexM, Fatal> {
        BaseOps::SingleThread(self)
    }

    fn support_breakpoints(&mut self) -> Option<BreakpointsOps<'_, Self>> {
        Some(self)
    }
}

impl SingleThreadBase for Debugged<'_> {
    fn read_registers(&mut self, core: &mut Core) -> TargetResult<(), Self> {
        let machine = self.bench.machine();
        for (value, register) in core.0.iter_mut().zip(order()) {
            *value = machine.register(register).map_err(fatal)?;
        }
        core.0[PC] = machine.pc();
        Ok(())
    }

    fn write_registers(&mut self, core: &Core) -> TargetResult<(), Self> {
        let machine = self.bench.machine_mut();
        for (value, register) in core.0.into_iter().zip(order()) {
            machine.set_register(register, value).map_err(fatal)?;
        }
        Ok(())
    }

    fn read_addrs(&mut self, start: u32, data: &mut [u8]) -> TargetResult<usize, Self> {
        if !is_memory(start, data.len()) {
            return Err(TargetError::NonFatal);
        }
        self.bench.machine().peek(start, data).map_err(|_| TargetError::NonFatal)?;
        for (&place, kept) in &self.breaks {
            for (offset, byte) in kept.iter().enumerate() {
                let at = (place + offset as u32).wrapping_sub(start) as usize;
                if let Some(shown) = data.get_mut(at) {
                    *shown = *byte;
                }
            }
        }
        Ok(data.len())
    }

    fn write_addrs(&mut self, start: u32, data: &[u8]) -> TargetResult<(), Self> {
        if !is_memory(start, data.len()) {
            return Err(TargetError::NonFatal);
        }
        self.bench.machine_mut().poke(start, data).map_err(|_| TargetError::NonFatal)
    }

    fn support_resume(&mut self) -> Option<SingleThreadResumeOps<'_, Self>> {
        Some(self)
    }
}

impl SingleThreadResume for Debugged<'_> {
    fn resume(&mut self, _: Option<Signal>) -> Result<(), Fatal> {
        self.steps = false;
        Ok(())
    }

    fn support_single_step(&mut self) -> Option<SingleThreadSingleStepOps<'_, Self>> {
        Some(self)
    }
}

impl SingleThreadSingleStep for Debugged<'_> {
    fn step(&mut self, _: Option<Signal>) -> Result<(), Fatal> {
        self.steps = true;
        Ok(())
    }
}

impl Breakpoints for Debugged<'_> {
    fn support_sw_breakpoint(&mut self) -> Option<SwBreakpointOps<'_, Self>> {
        Some(self)
    }
}

impl SwBreakpoint for Debugged<'_> {
    fn add_sw_breakpoint(&mut self, place: u32, _: usize) -> TargetResult<bool, Self> {
        if self.breaks.contains_key(&place) {
            return Ok(true);
        }
        let machine = self.bench.machine_mut();
        let mut kept = [0; 2];
        if !place.is_multiple_of(2) || machine.peek(place, &mut kept).is_err() {
            return Ok(false);
        }
        machine.poke(place, &BREAK).map_err(fatal)?;
        self.breaks.insert(place, kept);
        Ok(true)
    }

    fn remove_sw_breakpoint(&mut self, place: u32, _: usize) -> TargetResult<bool, Self> {
        let Some(kept) = self.breaks.remove(&place) else { return Ok(false) };
        self.bench.machine_mut().poke(place, &kept).map_err(fatal)?;
        Ok(true)
    }
}
