//! The stack's guard: what lies below RAM may not be accessed.
//!
//! The stack takes the bottom of RAM. The reference manual only reserves the addresses below
//! it and promises no fault there, so the memory protection unit makes one.

use cortex_m::asm;
use cortex_m::peripheral::scb::Exception;

/// 32 KiB below RAM, more than any frame, and above the chip's own memory at 0x1FFF_7FFF.
const BASE: u32 = 0x1FFF_8000;
/// Its size, as 2^(n + 1) bytes.
const SIZE: u32 = 14;

/// Of `RBAR`: the address is for the region in the lowest bits, 0.
const VALID: u32 = 1 << 4;
/// Of `RASR`: no code, no access (permission 0), the region's size, on.
const NO_ACCESS: u32 = 1 << 28 | SIZE << 1 | 1;
/// Of `CTRL`: on, and the default memory map elsewhere. In the hard fault's handler it is off.
const ON: u32 = 1 << 2 | 1;

/// Forbids any access below the stack, as a fault of its own: escalated to the hard fault it
/// could not save its frame, and the core would lock up.
pub(crate) fn guard() {
    // SAFETY: called once, first of all; nothing else uses these registers of the core.
    let mut core = unsafe { cortex_m::Peripherals::steal() };
    // SAFETY: the region holds no memory that the program uses.
    unsafe {
        core.MPU.rbar.write(BASE | VALID);
        core.MPU.rasr.write(NO_ACCESS);
        core.MPU.ctrl.write(ON);
    }
    core.SCB.enable(Exception::MemoryManagement);
    asm::dsb();
    asm::isb();
}
