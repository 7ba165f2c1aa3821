//! What the engine calls while a program runs.

use unicorn_engine::{HookType, RegisterARM};

use super::{
    BREAKPOINT, Bus, CALL, CoreError, Counted, Fault, Hooked, Inside, Mark, RETURN, RETURN_BITS,
    Register, SEV, Stop, Touch, UnicornCore, WFE, forget_condition, name,
};
use crate::thumb::Kind;
use crate::timing;

/// Cycles without a new block after which the code in use is taken to be translated.
const QUIET: u64 = 500_000;
/// Needless calls of the common hook after which blocks are translated again; each time twice as
/// many, because a block that runs seldom is translated under that hook again and again.
pub(super) const NEEDLESS: u32 = 10_000;

impl<B: Bus + 'static> UnicornCore<B> {
    /// Hooks what is counted, reported or has to stop the program.
    pub(super) fn hook(&mut self, counted: &Counted<'_>) -> Result<(), CoreError> {
        let uc = &mut self.engine;
        uc.add_block_hook(1, 0, |uc, address, size| {
            let Inside { count, bus, .. } = uc.get_data_mut();
            let now = count.meter.cycles;
            count.slow_hz = bus.slow_hz();
            // What stops here is not executed and so not counted.
            let (at, spent) = (address as u32, now >= count.limit || now >= bus.deadline());
            let urgent = bus.urgent();
            if spent || urgent.is_some_and(|priority| unmasked(uc, priority)) {
                return halt(uc, Stop::Spent(at));
            }
            let count = &mut uc.get_data_mut().count;
            let block = match count.known(at, size) {
                Some(block) => block,
                None if count.wants_hooks(at, size) => return halt(uc, Stop::Spent(at)),
                None => count.meet(at, size),
            };
            count.enter(at, size, block);
            if block.marked {
                note(uc, at);
            }
            let inside = uc.get_data_mut();
            if !inside.spoilt.is_empty() {
                inside.look_for_spoilt(at, size);
            }
        })?;
        uc.add_intr_hook(|uc, number| {
            let at = uc.pc_read().unwrap_or_default() as u32;
            let stop = match number {
                CALL => Stop::Call(at),
                BREAKPOINT => Stop::Breakpoint(at),
                RETURN => Stop::Return(at | RETURN_BITS),
                _ => Stop::Fault { at, fault: Fault::Other },
            };
            halt(uc, stop);
        })?;
        // Waiting for an event arrives here, with the program counter behind it.
        uc.add_insn_invalid_hook(|uc| {
            let at = uc.pc_read().unwrap_or_default() as u32 & !1;
            let mut before = [0; 2];
            let read = uc.mem_read(u64::from(at.wrapping_sub(2)), &mut before);
            if read.is_ok() && before == WFE {
                halt(uc, Stop::Event(at));
                return true;
            }
            false
        })?;
        let (first, last) = (counted.base, counted.base + (counted.bytes.len() as u32 - 1));
        let (first, last) = (first.into(), last.into());
        let kind = HookType::MEM_WRITE_PROT;
        uc.add_mem_hook(kind, first, last, |uc, _, address, size, value| {
            let access = Touch {
                address: address as u32,
                size: size as u32,
                pc: uc.pc_read().unwrap_or_default() as u32 & !1,
                now: uc.get_data().count.meter.cycles,
            };
            uc.get_data_mut().bus.write_code(access, value as u32) && forget_condition(uc).is_ok()
        })?;
        for (address, instruction, _) in counted.instructions() {
            let at = (address - counted.base) as usize;
            if instruction.size == 2 && counted.bytes.get(at..at + 2) == Some(&SEV[..]) {
                let at = u64::from(address);
                uc.add_code_hook(at, at, |uc, _, _| uc.get_data_mut().bus.event())?;
            }
        }
        // Where there is but one such hook the engine calls it by itself, and would do so
        // when it is gone.
        uc.add_code_hook(1, 1, |_, _, _| {})?;
        Ok(())
    }

    /// Hooks the instructions that the program has come to, see [`Count::wants_hooks`].
    ///
    /// [`Count::wants_hooks`]: super::count::Count::wants_hooks
    pub(super) fn hook_wanted(&mut self) -> Result<(), CoreError> {
        for (address, kind) in std::mem::take(&mut self.engine.get_data_mut().count.wanted) {
            self.hook_deferred(address, kind)?;
            let at = u64::from(address);
            self.engine.ctl_remove_cache(at, at + 2)?;
        }
        Ok(())
    }

    /// Has the cycles of this instruction added whenever it is carried out.
    fn hook_deferred(&mut self, address: u32, kind: Kind) -> Result<(), CoreError> {
        let at = u64::from(address);
        let hooked = self.engine.add_code_hook(at, at, move |uc, _, _| {
            if !uc.get_data().count.common {
                spend(uc, kind);
            }
        });
        self.own.push((address, hooked?));
        self.engine.get_data_mut().count.hooked.push((address, kind));
        Ok(())
    }

    /// Chooses what hooks deferred instructions.
    ///
    /// The engine goes through all hooks of instructions whenever it calls one, so that one
    /// hook for all of the code is fastest. But where it is there while a block is
    /// translated, it is called for every instruction of that block. So each deferred
    /// instruction has a hook of its own while blocks are being translated; when no new ones
    /// have come for a while these go, their calls in the translated code stay, and the
    /// common hook answers them.
    pub(super) fn choose_hooks(&mut self) -> Result<(), CoreError> {
        let count = &mut self.engine.get_data_mut().count;
        match self.common {
            None if count.meter.cycles > count.met + QUIET && !self.own.is_empty() => {
                let (first, last) = (count.base, count.base + (count.bytes.len() as u32 - 1));
                (count.common, count.needless) = (true, 0);
                let own = std::mem::take(&mut self.own);
                // With a hook at its beginning a block would be forgotten.
                let (kept, gone): (Vec<_>, Vec<_>) =
                    own.into_iter().partition(|(at, _)| count.begins(*at));
                self.own = kept;
                for (_, hook) in gone {
                    self.engine.remove_hook(hook)?;
                }
                let common = self.engine.add_code_hook(first.into(), last.into(), |uc, at, _| {
                    match uc.get_data().count.deferred(at as u32) {
                        Some(kind) => spend(uc, kind),
                        None => uc.get_data_mut().count.needless += 1,
                    }
                });
                self.common = Some(common?);
            }
            Some(hook) if count.needless > count.patience => {
                count.patience = count.patience.saturating_mul(2);
                count.common = false;
                count.forget();
                let own = &self.own;
                let there = |at: u32| own.iter().any(|(place, _)| *place == at);
                let (kept, again): (Vec<_>, Vec<_>) =
                    std::mem::take(&mut count.hooked).into_iter().partition(|(at, _)| there(*at));
                count.hooked = kept;
                self.common = None;
                self.engine.remove_hook(hook)?;
                for (address, kind) in again {
                    self.hook_deferred(address, kind)?;
                }
            }
            _ => {}
        }
        Ok(())
    }
}

/// Adds what an instruction costs beyond its first cycle.
fn spend<B>(uc: &mut Hooked<'_, B>, kind: Kind) {
    let cycles = if let Kind::Divide { signed, n, m } = kind {
        let value = |number| uc.reg_read(name(Register::R(number))).unwrap_or_default() as u32;
        timing::division(signed, value(n), value(m)) - 1
    } else {
        timing::extra(kind)
    };
    uc.get_data_mut().count.spend(cycles);
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
    let (cycles, waits) = (inside.count.meter.cycles, inside.count.waits());
    inside.marks.push(Mark { cycles, waits, address, r0 });
}

/// Whether the masks let an exception of this priority through.
///
/// Source: ARMv7-M Architecture Reference Manual, B1.5.4 (`ExecutionPriority`).
pub(super) fn unmasked<B>(uc: &Hooked<'_, B>, priority: i16) -> bool {
    let read = |register: RegisterARM| uc.reg_read(register).unwrap_or_default() & 0xFF;
    let level = match read(RegisterARM::BASEPRI) {
        _ if read(RegisterARM::FAULTMASK) != 0 => -1,
        _ if read(RegisterARM::PRIMASK) != 0 => 0,
        0 => i16::MAX,
        level => level as i16,
    };
    priority < level
}
