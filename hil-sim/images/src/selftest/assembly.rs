//! Pieces whose every instruction matters.

use core::arch::global_asm;

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
