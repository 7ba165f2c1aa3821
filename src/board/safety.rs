//! Cuts the bridges when the software fails, and ends the program.
//!
//! Panics, hard faults and damaged code end here. So does a hang: shortly before the watchdog bites, the
//! system timer's interrupt, which has the highest priority, finds it unfed. Each path cuts the
//! bridges first, then writes what it knows where the next start finds it.

use core::arch::naked_asm;
use core::panic::{Location, PanicInfo};
use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::peripheral::SCB;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m_rt::exception;
use embassy_time::{Duration, Timer};
use interstage::restart::{Stopped, image_checksum};
use interstage::tasks::mid_tick_deadline;

use super::registers::{FLASH, SYSCFG, TIM1, TIM8};
use super::{EXCHANGE, SYSCLK_HZ, image, retained};

/// Switches both bridges off until the next start.
pub(super) fn cut() {
    TIM1.bdtr().modify(|w| w.set_moe(false));
    TIM8.bdtr().modify(|w| w.set_moe(false));
}

/// Ends the program: bridges off, the reason kept, a restart.
fn end(stopped: Stopped) -> ! {
    cortex_m::interrupt::disable();
    cut();
    retained::stop(stopped);
    restart()
}

/// Restarts, with the bridges off.
pub(super) fn restart() -> ! {
    // At least 5 ms for the probe to fetch the end of the log.
    cortex_m::asm::delay(SYSCLK_HZ / 200);
    SCB::sys_reset()
}

/// Milliseconds without feeding that count as a hang: less than the watchdog's time-out at the
/// fast end of its oscillator.
const HANG_MS: u32 = 75;

/// Milliseconds since the last feeding.
pub(super) static UNFED: AtomicU32 = AtomicU32::new(0);

pub(super) fn fed() {
    UNFED.store(0, Ordering::Relaxed);
}

/// Starts the check, once a millisecond, that the watchdog is fed.
pub(super) fn watch_feeding() {
    // SAFETY: nothing else uses the system timer: the time driver runs on another one.
    let mut timer = unsafe { cortex_m::Peripherals::steal() }.SYST;
    timer.set_clock_source(SystClkSource::Core);
    timer.set_reload(SYSCLK_HZ / 1000 - 1);
    timer.clear_current();
    timer.enable_interrupt();
    timer.enable_counter();
}

/// Interrupt of the system timer, of the highest priority; passes on where the core saved its
/// registers.
#[unsafe(naked)]
#[unsafe(export_name = "SysTick")]
unsafe extern "C" fn sys_tick() {
    naked_asm!("mrs r0, msp", "b {look}", look = sym look_at)
}

/// `frame` is the address of the registers saved at the interrupt.
unsafe extern "C" fn look_at(frame: u32) {
    let unfed = UNFED.load(Ordering::Relaxed);
    UNFED.store(unfed + 1, Ordering::Relaxed);
    if unfed < HANG_MS {
        return;
    }
    cut();
    let (pc, lr) = returns(frame);
    let now = embassy_time::Instant::now().as_millis() as u32;
    let missed = EXCHANGE.unfed(now);
    retained::stop(Stopped::Hang { pc, lr, missed, at: now });
    // The watchdog ends this, as it would without this handler.
    loop {
        cortex_m::asm::nop();
    }
}

unsafe extern "C" {
    static _stack_start: u32;
    static _stack_end: u32;
}

/// Program counter and link register of a frame, 0 if it is outside the stack.
fn returns(frame: u32) -> (u32, u32) {
    let (from, to) = (&raw const _stack_end as u32, &raw const _stack_start as u32);
    if !frame.is_multiple_of(4) || frame < from || frame > to - 32 {
        return (0, 0);
    }
    let word = |index: u32| {
        // SAFETY: inside the stack, as checked above, and aligned.
        unsafe { ((frame + 4 * index) as *const u32).read_volatile() }
    };
    (word(6), word(5))
}

/// A hard fault, or a fault that could not be served. With the stack used up, the handler
/// continues from its top: nothing returns to what used it.
#[unsafe(naked)]
#[unsafe(export_name = "HardFault")]
#[unsafe(link_section = ".HardFault.user")]
unsafe extern "C" fn hard_fault() {
    naked_asm!(
        "mrs r0, msp",
        "ldr r1, =_stack_end + 512",
        "cmp r0, r1",
        "bhs 1f",
        "ldr r1, =_stack_start",
        "mov sp, r1",
        "1:",
        "b {fault}",
        fault = sym fault_at,
    )
}

/// An access below the stack, see [`super::stack`]: the same.
#[unsafe(naked)]
#[unsafe(export_name = "MemoryManagement")]
unsafe extern "C" fn memory_fault() {
    naked_asm!("b {fault}", fault = sym hard_fault)
}

unsafe extern "C" fn fault_at(frame: u32) -> ! {
    cut();
    let (pc, lr) = returns(frame);
    // SAFETY: reads of these registers have no effect.
    let (cfsr, hfsr) = unsafe { ((*SCB::PTR).cfsr.read(), (*SCB::PTR).hfsr.read()) };
    end(Stopped::Fault { pc, lr, cfsr, hfsr })
}

/// Double words that could not be read, since the start.
static UNREADABLE: AtomicU32 = AtomicU32::new(0);

pub(super) fn unreadable() -> u32 {
    UNREADABLE.load(Ordering::Relaxed)
}

/// A double word of flash has two wrong bits, which the chip reports and cannot correct.
///
/// While the drive runs, one in the first bank is in the image: the chip has cut the bridges, see
/// [`super::guard`], and the next start reports the image. At a start the image's checksum finds
/// it. In the second bank, a write has lost its power: the checks of sets and records reject it,
/// so the program continues; stopping would leave a board that never starts again.
#[exception]
unsafe fn NonMaskableInt() {
    let status = FLASH.eccr().read();
    if !status.eccd() {
        return;
    }
    UNREADABLE.store(unreadable().wrapping_add(1), Ordering::Relaxed);
    FLASH.eccr().modify(|w| w.set_eccd(true));
    if !status.bk_ecc() && SYSCFG.cfgr2().read().eccl() {
        end(Stopped::Image);
    }
}

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    let (place, line) = info
        .location()
        .map_or((0, 0), |place| (core::ptr::from_ref::<Location<'_>>(place) as u32, place.line()));
    end(Stopped::Panic { place, line })
}

/// Words of the image per step of the checksum.
const PART: usize = 384;

/// Interval between two steps: the image takes six seconds, and a thousandth of the core.
const INTERVAL: Duration = Duration::from_millis(50);

/// Checks the image over and over, and ends the program if its checksum has changed.
#[embassy_executor::task]
pub(crate) async fn watch_image(checksum: u32) -> ! {
    loop {
        let mut sum = 0;
        for part in image::words().chunks(PART) {
            Timer::at(mid_tick_deadline(INTERVAL)).await;
            sum = image_checksum::sum_on(sum, part);
        }
        if sum != checksum {
            image::log_damaged();
            end(Stopped::Image);
        }
    }
}
