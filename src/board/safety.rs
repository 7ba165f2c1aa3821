//! What makes the bridges safe when the software no longer does, and ends the program.
//!
//! Panics and hard faults end here; so does a program that no longer feeds the watchdog,
//! shortly before that bites, as long as the system timer's interrupt, the most urgent
//! there is, gets through. Each cuts the bridges first, then writes what it knows where
//! the next start finds it.

use core::arch::naked_asm;
use core::panic::{Location, PanicInfo};
use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::peripheral::SCB;
use cortex_m::peripheral::syst::SystClkSource;
use embassy_stm32::pac;
use embassy_time::{Duration, Timer};
use interstage::restart::{Stopped, image_checksum};
use interstage::tasks::mid_tick_deadline;

use super::{EXCHANGE, SYSCLK_HZ, image, retained};

/// Takes the power from both bridges, for good.
pub(super) fn cut() {
    pac::TIM1.bdtr().modify(|w| w.set_moe(false));
    pac::TIM8.bdtr().modify(|w| w.set_moe(false));
}

/// Ends the program for this: bridges off, the reason kept, a new start.
fn end(stopped: Stopped) -> ! {
    cortex_m::interrupt::disable();
    cut();
    retained::stop(stopped);
    restart()
}

/// Starts again, with the bridges off until then and after it.
pub(super) fn restart() -> ! {
    // For the probe to fetch the end of the log: 5 ms at least, some times that at most.
    cortex_m::asm::delay(SYSCLK_HZ / 200);
    SCB::sys_reset()
}

/// Milliseconds without feeding after which nothing good is to be expected: before the
/// watchdog bites, also with its oscillator at the fast end.
const PATIENCE: u32 = 75;

/// Milliseconds since the watchdog was fed.
static UNFED: AtomicU32 = AtomicU32::new(0);

/// The watchdog has been fed.
pub(super) fn fed() {
    UNFED.store(0, Ordering::Relaxed);
}

/// Starts looking once a millisecond whether the watchdog is fed.
pub(super) fn watch_feeding() {
    // SAFETY: nobody else has the system timer: the time driver runs on another one.
    let mut timer = unsafe { cortex_m::Peripherals::steal() }.SYST;
    timer.set_clock_source(SystClkSource::Core);
    timer.set_reload(SYSCLK_HZ / 1000 - 1);
    timer.clear_current();
    timer.enable_interrupt();
    timer.enable_counter();
}

/// The system timer, of the highest priority as every interrupt that is given none, and
/// before the others among these: it passes on where the processor was.
#[unsafe(naked)]
#[unsafe(export_name = "SysTick")]
unsafe extern "C" fn sys_tick() {
    naked_asm!("mrs r0, msp", "b {look}", look = sym look_at)
}

/// `frame` is where the core put its registers when the interrupt came.
unsafe extern "C" fn look_at(frame: u32) {
    let unfed = UNFED.load(Ordering::Relaxed);
    UNFED.store(unfed + 1, Ordering::Relaxed);
    if unfed < PATIENCE {
        return;
    }
    cut();
    let (pc, lr) = returns(frame);
    let now = embassy_time::Instant::now().as_millis() as u32;
    let missed = EXCHANGE.unfed(now);
    retained::stop(Stopped::Hang { pc, lr, missed, at: now });
    // The watchdog ends it: it would also had this not been reached.
    loop {
        cortex_m::asm::nop();
    }
}

unsafe extern "C" {
    static _stack_start: u32;
    static _stack_end: u32;
}

/// Program counter and link register of a frame, 0 if it does not lie in the stack.
fn returns(frame: u32) -> (u32, u32) {
    let (from, to) = (&raw const _stack_end as u32, &raw const _stack_start as u32);
    if !frame.is_multiple_of(4) || frame < from || frame > to - 32 {
        return (0, 0);
    }
    let word = |index: u32| {
        // SAFETY: inside the stack, see above, which is memory and aligned.
        unsafe { ((frame + 4 * index) as *const u32).read_volatile() }
    };
    (word(6), word(5))
}

/// A hard fault, or a fault that came where it could not be served. If the stack is used
/// up, what follows starts it again from its top: nothing returns to what was using it.
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

unsafe extern "C" fn fault_at(frame: u32) -> ! {
    cut();
    let (pc, lr) = returns(frame);
    // SAFETY: reading these registers changes nothing.
    let (cfsr, hfsr) = unsafe { ((*SCB::PTR).cfsr.read(), (*SCB::PTR).hfsr.read()) };
    end(Stopped::Fault { pc, lr, cfsr, hfsr })
}

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    let (place, line) = info
        .location()
        .map_or((0, 0), |place| (core::ptr::from_ref::<Location<'_>>(place) as u32, place.line()));
    end(Stopped::Panic { place, line })
}

/// Words of the image that are summed up in one go.
const PART: usize = 256;

/// From one part to the next: a round takes six seconds, and no more than a thousandth of
/// the core.
const PACE: Duration = Duration::from_millis(50);

/// Sums up the image over and over, and ends the program if it has changed.
#[embassy_executor::task]
pub(crate) async fn watch_image(sealed: u32) -> ! {
    loop {
        let mut sum = 0;
        for part in image::words().chunks(PART) {
            Timer::at(mid_tick_deadline(PACE)).await;
            sum = image_checksum::sum_on(sum, part);
        }
        if sum != sealed {
            // Also for the case that what starts next cannot say it any more.
            image::say_damaged();
            end(Stopped::Image);
        }
    }
}
