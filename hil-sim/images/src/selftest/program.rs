//! Pieces whose every instruction matters, and the exceptions: each notes that it ran, and spoils what
//! its hardware frame or its compiler has to keep.

use core::arch::{asm, global_asm};
use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::asm::bkpt;
use cortex_m::peripheral::NVIC;
use cortex_m_rt::exception;
use defmt as _;
use embassy_stm32::interrupt;
use embassy_stm32::pac::Interrupt;

/// A breakpoint outside of `main` reports it to the host.
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {
        bkpt();
    }
}

global_asm!(
    r#"
    .syntax unified
    .section .text.conditional, "ax", %progbits
    .global conditional
    .type conditional, %function
    .thumb_func
conditional:
    cmp r0, #5
    itete gt
    addgt r0, r0, #100
    addle r0, r0, #1
    addgt r0, r0, #1000
    addle r0, r0, #2
    cmp r0, #5
    ittt eq
    lsleq r0, r0, #4
    addeq r0, r0, #3
    eoreq r0, r0, #0x40
    tst r0, #1
    ite ne
    addne r0, r0, #0x10000
    addeq r0, r0, #0x20000
    bx lr
    .size conditional, . - conditional

    .section .text.float_across, "ax", %progbits
    .global float_across
    .type float_across, %function
    .thumb_func
float_across:
    push {{r4, lr}}
    mov r2, #0x3f800000
    vmov s0, r2
    vmov s1, r2
    vmov s5, r2
    vmov s15, r2
    vadd.f32 s2, s0, s1
    str r1, [r0]
    dsb
    isb
    nop
    vadd.f32 s3, s0, s1
    vadd.f32 s3, s3, s5
    vadd.f32 s3, s3, s15
    vadd.f32 s3, s3, s2
    vmov r0, s3
    pop {{r4, pc}}
    .size float_across, . - float_across
    "#
);

unsafe extern "C" {
    /// Three conditional blocks one after the other.
    pub(crate) fn conditional(given: u32) -> u32;
    /// Writes `mask` to the register at `address`, which interrupts, with floating-point
    /// values in registers on both sides of it; returns the bits of 6.0.
    pub(crate) fn float_across(address: u32, mask: u32) -> u32;
}

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
