//! The checks, each true if the core did as it must, and the start that runs them.

use core::arch::asm;
use core::hint::black_box;
use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::peripheral::scb::SystemHandler;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m::peripheral::{NVIC, SCB};
use cortex_m::{Peripherals, asm as op};
use embassy_stm32::pac::Interrupt;

use crate::program::{BEATS, CALLS, NUMBER, conditional, float_across, note, order};

/// One bit for each check that failed, in the order of [`ALL`].
#[unsafe(no_mangle)]
static FAILED: AtomicU32 = AtomicU32::new(u32::MAX);
/// What the host gives to the conditional block, and what comes out of it.
#[unsafe(no_mangle)]
static GIVEN: AtomicU32 = AtomicU32::new(0);
#[unsafe(no_mangle)]
static RETURNED: AtomicU32 = AtomicU32::new(0);

#[cortex_m_rt::entry]
fn main() -> ! {
    prepare();
    let mut failed = 0;
    for (bit, check) in ALL.iter().enumerate() {
        if !check() {
            failed |= 1 << bit;
        }
    }
    FAILED.store(failed, Ordering::Relaxed);
    loop {
        op::bkpt();
        // SAFETY: plain arithmetic.
        let returned = unsafe { conditional(GIVEN.load(Ordering::Relaxed)) };
        RETURNED.store(returned, Ordering::Relaxed);
    }
}

/// Their order is known to the host.
const ALL: [fn() -> bool; 15] = [
    supervisor_calls,
    conditional_blocks,
    float_context,
    nesting,
    interrupt_mask,
    priority_mask,
    waiting_masked,
    events,
    process_stack,
    exclusives,
    status,
    chaining,
    float_results,
    compares_under_interrupts,
    cycle_counter,
];

/// Priorities and enables.
fn prepare() {
    // SAFETY: nothing else runs yet.
    unsafe {
        let mut core = Peripherals::steal();
        core.NVIC.set_priority(Interrupt::TIM3, 0x80);
        core.NVIC.set_priority(Interrupt::TIM4, 0x40);
        core.SCB.set_priority(SystemHandler::PendSV, 0xF0);
        NVIC::unmask(Interrupt::TIM3);
        NVIC::unmask(Interrupt::TIM4);
    }
}

fn supervisor_calls() -> bool {
    // SAFETY: the handler counts and nothing else.
    unsafe {
        asm!("svc 3");
        asm!("svc 4");
    }
    CALLS.load(Ordering::Relaxed) == 2
}

fn conditional_blocks() -> bool {
    // SAFETY: plain arithmetic.
    let of = |given| unsafe { conditional(black_box(given)) };
    of(9) == 1109 + 0x1_0000 && of(2) == (5 << 4) + 3 + 0x1_0000 - 0x40 && of(1) == 4 + 0x2_0000
}

fn float_context() -> bool {
    // SAFETY: sets an interrupt pending whose handler spoils what it may.
    let sum = unsafe { float_across(0xE000_E200, 1 << Interrupt::TIM3 as u32) };
    f32::from_bits(sum) == 6.0
}

fn nesting() -> bool {
    // From the check before: the more urgent one in the middle of the other.
    order() == 0x123
}

fn interrupt_mask() -> bool {
    cortex_m::interrupt::disable();
    NVIC::pend(Interrupt::TIM4);
    SCB::set_pendsv();
    op::isb();
    note(9);
    // SAFETY: nothing here is critical.
    unsafe { cortex_m::interrupt::enable() };
    op::isb();
    note(0xA);
    order() == 0x925A
}

fn priority_mask() -> bool {
    // SAFETY: opened again below.
    unsafe { cortex_m::register::basepri::write(0x60) };
    NVIC::pend(Interrupt::TIM4);
    op::isb();
    note(8);
    SCB::set_pendsv();
    op::isb();
    note(9);
    // SAFETY: open.
    unsafe { cortex_m::register::basepri::write(0) };
    op::isb();
    order() == 0x2895
}

fn waiting_masked() -> bool {
    cortex_m::interrupt::disable();
    NVIC::pend(Interrupt::TIM4);
    op::wfi();
    note(7);
    // SAFETY: nothing here is critical.
    unsafe { cortex_m::interrupt::enable() };
    op::isb();
    order() == 0x72
}

fn events() -> bool {
    // Whatever has set the register before is used up by the first.
    op::sev();
    op::wfe();
    op::sev();
    op::wfe();
    note(4);
    NVIC::pend(Interrupt::TIM4);
    op::isb();
    // Taking an exception is an event.
    op::wfe();
    note(6);
    order() == 0x426
}

fn process_stack() -> bool {
    static mut STACK: [u32; 256] = [0; 256];
    let top = (&raw const STACK as u32) + 1024;
    let before = CALLS.load(Ordering::Relaxed);
    let after: u32;
    // SAFETY: the stack is this check's own, and the main one is back at the end.
    unsafe {
        asm!(
            "msr psp, {top}",
            "mrs {s}, control",
            "orr {s}, {s}, #2",
            "msr control, {s}",
            "isb",
            "svc 9",
            "mov {after}, sp",
            "mrs {s}, control",
            "bic {s}, {s}, #2",
            "msr control, {s}",
            "isb",
            top = in(reg) top,
            s = out(reg) _,
            after = out(reg) after,
        );
    }
    after == top && CALLS.load(Ordering::Relaxed) == before + 1
}

fn exclusives() -> bool {
    static WORD: AtomicU32 = AtomicU32::new(40);
    WORD.fetch_add(2, Ordering::SeqCst);
    WORD.compare_exchange(42, 7, Ordering::SeqCst, Ordering::SeqCst) == Ok(42)
        && WORD.compare_exchange(42, 8, Ordering::SeqCst, Ordering::SeqCst) == Err(7)
}

fn status() -> bool {
    let number: u32;
    // SAFETY: reads a status.
    unsafe { asm!("mrs {}, ipsr", out(reg) number) };
    number == 0 && NUMBER.load(Ordering::Relaxed) == 16 + Interrupt::TIM4 as u32
}

fn chaining() -> bool {
    cortex_m::interrupt::disable();
    NVIC::pend(Interrupt::TIM3);
    NVIC::pend(Interrupt::TIM4);
    SCB::set_pendsv();
    // SAFETY: nothing here is critical.
    unsafe { cortex_m::interrupt::enable() };
    op::isb();
    note(0xB);
    // The urgent one, then the other with the urgent one in its middle, then the last.
    order() == 0x2_1235B
}

fn float_results() -> bool {
    let root: u32;
    // SAFETY: arithmetic.
    unsafe {
        asm!("vmov s0, {0}", "vsqrt.f32 s0, s0", "vmov {0}, s0",
            inout(reg) 2.0_f32.to_bits() => root, out("s0") _);
    }
    f32::from_bits(root) == core::f32::consts::SQRT_2
        && black_box(1.0_f32) / 3.0 == 0.333_333_34
        && black_box(-7.9_f32) as i32 == -7
}

/// Sums, compares and carries while the system timer interrupts every 211 cycles.
fn compares_under_interrupts() -> bool {
    // SAFETY: the timer is this check's own.
    let mut core = unsafe { Peripherals::steal() };
    core.SYST.set_clock_source(SystClkSource::Core);
    core.SYST.set_reload(210);
    core.SYST.clear_current();
    BEATS.store(0, Ordering::Relaxed);
    core.SYST.enable_interrupt();
    core.SYST.enable_counter();
    let (mut above, mut wide, mut float) = (0_u32, 0_u64, 0.0_f32);
    for number in 0..20_000_u32 {
        let value = black_box(number.wrapping_mul(2_654_435_761));
        above += u32::from(value > 0x8000_0000);
        wide = wide.wrapping_add(u64::from(value) << 7);
        let part = black_box((number & 7) as f32);
        float += if part > 3.0 { 1.0 } else { 0.25 };
    }
    core.SYST.disable_counter();
    core.SYST.disable_interrupt();
    // Computed once without interrupts, by the same rules.
    let (mut same, mut also) = (0_u32, 0_u64);
    for number in 0..20_000_u32 {
        let value = number.wrapping_mul(2_654_435_761);
        same += value >> 31 & u32::from(value != 0x8000_0000);
        also = also.wrapping_add(u64::from(value) << 7);
    }
    above == same && wide == also && float == 12_500.0 && BEATS.load(Ordering::Relaxed) > 1000
}

/// The emulator counts the cycles of a block at its beginning: the block has to end after the
/// reading.
#[inline(never)]
fn cycle_counter() -> bool {
    // SAFETY: the counter is this check's own.
    let mut core = unsafe { Peripherals::steal() };
    core.DCB.enable_trace();
    core.DWT.set_cycle_count(0);
    core.DWT.enable_cycle_counter();
    op::delay(1000);
    let passed = cortex_m::peripheral::DWT::cycle_count();
    // 1001 times a subtraction and a branch that refills the pipeline.
    (4000..4020).contains(&passed)
}
