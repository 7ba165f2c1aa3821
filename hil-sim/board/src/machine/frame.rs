//! The stack frame of an exception, its entry and its return.
//!
//! Source: ARMv7-M Architecture Reference Manual, B1.5.6 to B1.5.8. The floating-point
//! registers are stacked at once; lazy stacking writes them later to the same addresses.

use crate::chip::Chip;
use crate::core::unicorn::UnicornCore;
use crate::core::{CoreError, Register};

type Core = UnicornCore<Chip>;

/// Bytes of a frame without and with floating-point registers.
const BASIC: u32 = 0x20;
const EXTENDED: u32 = 0x68;

/// In the saved status: the stack pointer was aligned to eight bytes.
const ALIGNED: u32 = 1 << 9;
/// In the status: state of a conditional block.
const CONDITIONAL: u32 = 0x0600_FC00;
const EXCEPTION: u32 = 0x1FF;
const THUMB: u32 = 1 << 24;
/// In `CONTROL`: the process stack, and a floating-point context.
const PROCESS_STACK: u32 = 2;
const FLOAT_CONTEXT: u32 = 4;
/// In a return value: basic frame, thread mode, process stack.
const RETURN_BASIC: u32 = 1 << 4;
const RETURN_THREAD: u32 = 1 << 3;
const RETURN_PROCESS: u32 = 1 << 2;

const SAVED: [Register; 6] =
    [Register::R(0), Register::R(1), Register::R(2), Register::R(3), Register::R(12), Register::Lr];

/// Where the next frame lies: its address and its bytes.
pub(super) fn next(core: &Core) -> Result<(u32, u32), CoreError> {
    let float = core.register(Register::Control)? & FLOAT_CONTEXT != 0;
    let bytes = if float { EXTENDED } else { BASIC };
    Ok((core.register(Register::Sp)?.wrapping_sub(bytes) & !7, bytes))
}

/// Pushes a frame that returns to `back`; false if there is no memory for it.
pub(super) fn push(core: &mut Core, back: u32) -> Result<bool, CoreError> {
    let status = core.register(Register::Xpsr)?;
    let float = core.register(Register::Control)? & FLOAT_CONTEXT != 0;
    let stack = core.register(Register::Sp)?;
    let (base, bytes) = next(core)?;
    let mut frame = Vec::with_capacity(bytes as usize);
    for register in SAVED {
        frame.extend(core.register(register)?.to_le_bytes());
    }
    frame.extend(back.to_le_bytes());
    let moved = if stack & 4 != 0 { ALIGNED } else { 0 };
    frame.extend((status & !ALIGNED | moved).to_le_bytes());
    if float {
        for number in 0..16 {
            frame.extend(core.register(Register::Float(number))?.to_le_bytes());
        }
        frame.extend(core.register(Register::Fpscr)?.to_le_bytes());
        frame.extend([0; 4]);
    }
    core.set_register(Register::Sp, base)?;
    Ok(core.write(base, &frame).is_ok())
}

/// Enters handler mode for exception `number`; `nested` if another one is active.
pub(super) fn go_to_handler(core: &mut Core, number: u8, nested: bool) -> Result<(), CoreError> {
    let control = core.register(Register::Control)?;
    let mut back = 0xFFFF_FFE1 | RETURN_BASIC;
    if control & FLOAT_CONTEXT != 0 {
        back &= !RETURN_BASIC;
        core.set_register(Register::Control, control & !FLOAT_CONTEXT)?;
    }
    if !nested {
        back |= RETURN_THREAD;
        if control & PROCESS_STACK != 0 {
            back |= RETURN_PROCESS;
        }
    }
    change_handler(core, number)?;
    core.set_register(Register::Lr, back)
}

/// Sets the status for the handler of exception `number`.
pub(super) fn change_handler(core: &mut Core, number: u8) -> Result<(), CoreError> {
    let status = core.register(Register::Xpsr)?;
    let status = status & !(CONDITIONAL | EXCEPTION) | THUMB | u32::from(number);
    // The engine changes to the main stack with the number.
    core.set_register(Register::Xpsr, status)
}

/// Pops the frame of this return value, and restores its mode. Returns the address at which
/// the program continues; `None` if the frame is not in memory.
pub(super) fn pop(core: &mut Core, value: u32) -> Result<Option<u32>, CoreError> {
    let float = value & RETURN_BASIC == 0;
    let process = value & RETURN_PROCESS != 0;
    let pointer = if process { Register::Psp } else { Register::Sp };
    let base = core.register(pointer)?;
    let bytes = if float { EXTENDED } else { BASIC };
    let mut frame = vec![0; bytes as usize];
    if core.read(base, &mut frame).is_err() {
        return Ok(None);
    }
    let word = |index: usize| {
        let bytes = frame[4 * index..4 * index + 4].try_into().unwrap_or_default();
        u32::from_le_bytes(bytes)
    };
    for (index, register) in SAVED.into_iter().enumerate() {
        core.set_register(register, word(index))?;
    }
    if float {
        for number in 0..16 {
            core.set_register(Register::Float(number), word(8 + usize::from(number)))?;
        }
        core.set_register(Register::Fpscr, word(24))?;
    }
    let (back, status) = (word(6), word(7));
    let top = base + bytes + if status & ALIGNED != 0 { 4 } else { 0 };
    core.set_register(pointer, top)?;
    core.set_register(Register::Xpsr, status & !ALIGNED | THUMB)?;
    let control = core.register(Register::Control)? & !(PROCESS_STACK | FLOAT_CONTEXT);
    let stack = if process { PROCESS_STACK } else { 0 };
    let context = if float { FLOAT_CONTEXT } else { 0 };
    core.set_register(Register::Control, control | stack | context)?;
    Ok(Some(back & !1))
}
