//! Exceptions of the self-test. Each notes that it ran, and spoils what its hardware
//! frame or its compiler has to keep.

use core::arch::asm;
use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::peripheral::NVIC;
use cortex_m_rt::exception;
use embassy_stm32::interrupt;
use embassy_stm32::pac::Interrupt;

/// Handlers in the order in which they ran: a digit each, the last on the right.
static ORDER: AtomicU32 = AtomicU32::new(0);
/// Supervisor calls.
pub(crate) static CALLS: AtomicU32 = AtomicU32::new(0);
/// Interrupts of the system timer.
pub(crate) static BEATS: AtomicU32 = AtomicU32::new(0);
/// Number of the exception that the last handler found itself in.
pub(crate) static NUMBER: AtomicU32 = AtomicU32::new(0);

/// Adds a digit.
pub(crate) fn note(digit: u32) {
    ORDER.store(ORDER.load(Ordering::Relaxed) << 4 | digit, Ordering::Relaxed);
}

/// Takes the digits.
pub(crate) fn order() -> u32 {
    let order = ORDER.load(Ordering::Relaxed);
    ORDER.store(0, Ordering::Relaxed);
    order
}

#[exception]
fn SVCall() {
    CALLS.fetch_add(1, Ordering::Relaxed);
}

#[exception]
fn PendSV() {
    note(5);
}

#[exception]
fn SysTick() {
    BEATS.fetch_add(1, Ordering::Relaxed);
    // SAFETY: registers that the hardware has put away, and flags.
    unsafe {
        asm!("vmov s0, {0}", "vmov s15, {0}", "vcmp.f32 s0, #0.0", "vmrs APSR_nzcv, fpscr",
            "cmp {0}, #7", in(reg) 0x4120_0000_u32, out("s0") _, out("s15") _);
    }
}

/// Less urgent: pends the more urgent one while it runs.
#[interrupt]
fn TIM3() {
    note(1);
    // SAFETY: registers that the hardware has put away.
    unsafe {
        asm!("vmov s0, {0}", "vmov s5, {0}", "vmov s15, {0}",
            in(reg) 0x4120_0000_u32, out("s0") _, out("s5") _, out("s15") _);
    }
    NVIC::pend(Interrupt::TIM4);
    cortex_m::asm::dsb();
    cortex_m::asm::isb();
    note(3);
}

/// More urgent.
#[interrupt]
fn TIM4() {
    note(2);
    let number: u32;
    // SAFETY: reads a status; writes registers that the hardware has put away.
    unsafe {
        asm!("mrs {}, ipsr", out(reg) number);
        asm!("vmov s1, {0}", in(reg) 0xDEAD_BEEF_u32, out("s1") _);
    }
    NUMBER.store(number, Ordering::Relaxed);
}
