//! What the engine calls while a program runs.

use unicorn_engine::{HookType, RegisterARM};

use super::{
    BREAKPOINT, Bus, CALL, CoreError, Counted, Fault, Hooked, Inside, Mark, RETURN, RETURN_BITS,
    SEV, Stop, Touch, UnicornCore, WFE, engine, general, passes,
};
use crate::thumb::{self, Kind};
use crate::timing;

impl<B: Bus + 'static> UnicornCore<B> {
    /// Hooks what is counted, reported or has to stop the program.
    pub(super) fn hook(&mut self, counted: &Counted<'_>) -> Result<(), CoreError> {
        let uc = &mut self.engine;
        let blocks = uc.add_block_hook(1, 0, |uc, address, size| {
            let Inside { count, bus, .. } = uc.get_data_mut();
            let now = count.meter.cycles;
            // What stops here is not executed and so not counted.
            if now >= count.limit || now >= bus.deadline() {
                halt(uc, Stop::Spent(address as u32));
                return;
            }
            if let Some(priority) = bus.urgent()
                && unmasked(uc, priority)
            {
                halt(uc, Stop::Urgent(address as u32));
                return;
            }
            let Inside { count, .. } = uc.get_data_mut();
            if count.wants_hooks(address as u32, size) {
                halt(uc, Stop::Spent(address as u32));
                return;
            }
            if count.enter(address as u32, size) {
                note(uc, address as u32);
            }
        });
        engine("hook blocks", blocks)?;
        let traps = uc.add_intr_hook(|uc, number| {
            let at = uc.pc_read().unwrap_or_default() as u32;
            let stop = match number {
                CALL => Stop::Call(at),
                BREAKPOINT => Stop::Breakpoint(at),
                RETURN => Stop::Return(at | RETURN_BITS),
                _ => Stop::Fault { at, fault: Fault::Other },
            };
            halt(uc, stop);
        });
        engine("hook interrupts", traps)?;
        // Waiting for an event arrives here, with the program counter behind it.
        let invalid = uc.add_insn_invalid_hook(|uc| {
            let at = uc.pc_read().unwrap_or_default() as u32 & !1;
            let mut before = [0; 2];
            let read = uc.mem_read(u64::from(at.wrapping_sub(2)), &mut before);
            if read.is_ok() && before == WFE {
                halt(uc, Stop::Event(at));
                return true;
            }
            false
        });
        engine("hook waiting", invalid)?;
        let (first, last) = (counted.base, counted.base + (counted.bytes.len() as u32 - 1));
        let (first, last) = (first.into(), last.into());
        let kind = HookType::MEM_WRITE_PROT;
        let protected = uc.add_mem_hook(kind, first, last, |uc, _, address, size, value| {
            let access = Touch {
                address: address as u32,
                size: size as u32,
                pc: uc.pc_read().unwrap_or_default() as u32 & !1,
                now: uc.get_data().count.meter.cycles,
            };
            uc.get_data_mut().bus.write_code(access, value as u32)
        });
        engine("hook writes to code", protected)?;
        for range in counted.code {
            let bytes = (range.start.wrapping_sub(counted.base) as usize)
                ..(range.end.wrapping_sub(counted.base) as usize);
            let code = counted.bytes.get(bytes).unwrap_or_default();
            for (address, instruction, conditional) in thumb::sweep(code, range.start) {
                if timing::is_late(&instruction, conditional) {
                    self.engine.get_data_mut().count.is_late(address, instruction.kind);
                }
                let at = (address - range.start) as usize;
                if instruction.size == 2 && code.get(at..at + 2) == Some(&SEV[..]) {
                    let at = u64::from(address);
                    let sent =
                        self.engine.add_code_hook(at, at, |uc, _, _| uc.get_data_mut().bus.event());
                    engine("hook an instruction", sent)?;
                }
            }
        }
        Ok(())
    }

    /// Hooks the instructions that the program has come to, see [`Count::wants_hooks`].
    ///
    /// [`Count::wants_hooks`]: super::count::Count::wants_hooks
    pub(super) fn hook_wanted(&mut self) -> Result<(), CoreError> {
        for (address, kind) in std::mem::take(&mut self.engine.get_data_mut().count.wanted) {
            self.hook_late(address, kind)?;
            let at = u64::from(address);
            engine("forget code", self.engine.ctl_remove_cache(at, at + 2))?;
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
                uc.get_data_mut().count.spend(cycles);
            })
        } else {
            let extra = timing::extra(kind);
            self.engine.add_code_hook(at, at, move |uc, _, _| uc.get_data_mut().count.spend(extra))
        };
        engine("hook an instruction", hooked).map(|_| ())
    }
}

/// Stops the engine from inside a hook.
fn halt<B>(uc: &mut Hooked<'_, B>, stop: Stop) {
    uc.get_data_mut().count.stop = Some(stop);
    // Stopping can only fail if nothing runs.
    let _ = uc.emu_stop();
}

/// Notes that the program has come to a marked block.
fn note<B>(uc: &mut Hooked<'_, B>, address: u32) {
    let r0 = uc.reg_read(RegisterARM::R0).unwrap_or_default() as u32;
    let inside = uc.get_data_mut();
    inside.marks.push(Mark { cycles: inside.count.meter.cycles, address, r0 });
}

/// Whether the masks let an exception of this priority through.
fn unmasked<B>(uc: &Hooked<'_, B>, priority: i16) -> bool {
    let read = |register: RegisterARM| uc.reg_read(register).unwrap_or_default() as u32;
    passes(
        priority,
        read(RegisterARM::PRIMASK),
        read(RegisterARM::BASEPRI),
        read(RegisterARM::FAULTMASK),
    )
}
