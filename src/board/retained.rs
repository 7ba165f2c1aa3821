//! The record of a start's reason that the start finds: in memory that is not cleared.
//!
//! Every reset but that of a lost supply leaves the chip's memory as it is. Panics and
//! hard faults end here; so does a program that no longer feeds the watchdog, shortly
//! before that bites, as long as the system timer's interrupt, the most urgent there is,
//! gets through. Each cuts the bridges first, then writes what it knows.

use core::arch::naked_asm;
use core::cell::UnsafeCell;
use core::mem::MaybeUninit;
use core::panic::{Location, PanicInfo};
use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::peripheral::SCB;
use cortex_m::peripheral::syst::SystClkSource;
use interstage::restart::{
    CRASH_WORDS, Crash, DriveSnapshot, Reset, Restart, SNAPSHOT_WORDS, Stopped, later,
};

use super::{SYSCLK_HZ, guard, image, supply};

/// What is kept.
#[repr(C)]
struct Kept {
    crash: [u32; CRASH_WORDS],
    /// Even and odd ticks.
    snapshots: [[u32; SNAPSHOT_WORDS]; 2],
}

struct Shared(UnsafeCell<MaybeUninit<Kept>>);

// SAFETY: written by the control tick, and by handlers that never return, on one core;
// read before the tick begins. What is torn or never written is words like any other,
// and told from a record by its check.
unsafe impl Sync for Shared {}

/// By this name a probe finds it.
#[unsafe(link_section = ".uninit.retained")]
#[unsafe(export_name = "INTERSTAGE_BLACKBOX")]
static KEPT: Shared = Shared(UnsafeCell::new(MaybeUninit::uninit()));

fn kept() -> *mut Kept {
    KEPT.0.get().cast()
}

/// Keeps what the drive does in a tick.
pub(super) fn keep(snapshot: &DriveSnapshot) {
    let place = (snapshot.tick & 1) as usize;
    // SAFETY: see `Shared`; the index is 0 or 1.
    unsafe { (&raw mut (*kept()).snapshots[place]).write_volatile(snapshot.seal()) }
}

/// What is kept of the last whole tick.
#[inline(never)]
pub(super) fn snapshot() -> Option<DriveSnapshot> {
    // SAFETY: see `Shared`; read by a start, and by handlers that never return.
    let [even, odd] = unsafe { (&raw const (*kept()).snapshots).read_volatile() };
    later(DriveSnapshot::open(&even), DriveSnapshot::open(&odd))
}

/// Keeps why the program ends.
#[inline(never)]
pub(super) fn stop(stopped: Stopped) {
    let crash = Crash { build: build(), stopped };
    // SAFETY: see `Shared`.
    unsafe { (&raw mut (*kept()).crash).write_volatile(crash.seal()) }
}

/// First word of the image's hash.
fn build() -> u32 {
    let [a, b, c, d, ..] = image::id();
    u32::from_le_bytes([a, b, c, d])
}

/// What there is to report of the time before this start, which may have `waited` for its
/// supply. Call once, before the control tick begins.
///
/// What the drive was doing stays kept until the tick writes over it, so that a second reset
/// right behind the first, as of a pin that bounces or a supply that flickers, finds it too.
pub(crate) fn report(waited: bool) -> Restart {
    let in_memory = snapshot();
    // SAFETY: nobody else is there yet. The words may never have been written, so they are
    // read as volatile memory that holds anything.
    let crash = unsafe { (&raw const (*kept()).crash).read_volatile() };
    let found = supply::found();
    let in_flash = found.and_then(|latest| latest.snapshot);
    let supply = || Crash { build: build(), stopped: Stopped::Supply };
    let crash = Crash::open(&crash).or(in_flash.map(|_| supply()));
    let mut restart = Restart { reset: guard::reset(), snapshot: in_memory.or(in_flash), crash };
    // The watchdog has reasons of its own for doubt.
    if waited && restart.reset != Reset::Watchdog {
        restart.reset = Reset::Power;
    }
    let first = restart.standing().map_or([0; SNAPSHOT_WORDS], |snapshot| snapshot.seal());
    // In this order: a reset or a supply that goes again finds here what it was, in one place
    // or the other.
    // SAFETY: as before.
    unsafe {
        (&raw mut (*kept()).snapshots).write_volatile([first, [0; SNAPSHOT_WORDS]]);
        (&raw mut (*kept()).crash).write_volatile([0; CRASH_WORDS]);
    }
    guard::forget_reset();
    supply::take(found);
    say(&restart);
    restart
}

/// Says it, if it was not the operator's switch.
fn say(restart: &Restart) {
    if restart.reset != Reset::Power {
        defmt::error!("restarted {=str}", restart.reset.sentence());
    }
    if restart.shut_out() {
        defmt::error!("a hang with interrupts shut out");
    }
    if let Some(crash) = &restart.crash {
        match crash.stopped {
            Stopped::Panic { place, line } => {
                defmt::error!("panicked in line {=u32}, place {=u32:#x}", line, place);
            }
            Stopped::Fault { pc, lr, cfsr, hfsr } => defmt::error!(
                "hard fault at {=u32:#x} from {=u32:#x}, CFSR {=u32:#x}, HFSR {=u32:#x}",
                pc,
                lr,
                cfsr,
                hfsr
            ),
            Stopped::Hang { pc, lr, missed, .. } => defmt::error!(
                "{=str} did not come, at {=u32:#x} from {=u32:#x}",
                missed.name(),
                pc,
                lr
            ),
            Stopped::Supply => defmt::error!("the supply fell too low"),
            Stopped::Image => defmt::error!("a bit of the image had turned over"),
        }
    }
    if let Some(DriveSnapshot { tick, position, mode, level, fault, missed, .. }) = restart.snapshot
    {
        defmt::warn!(
            "before: tick {=u32}, mode {=u8}, {=f32} mm, level {=u8}, last fault {=u16}, late: {=str}",
            tick,
            mode,
            position.to_num::<f32>(),
            level & !DriveSnapshot::UNSURE,
            fault,
            missed.name()
        );
    }
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

/// Starts looking whether the watchdog is fed, and beating: at each whole millisecond of
/// the clock, whose timer has the same source, some tenths of a microsecond behind it.
pub(super) fn look() {
    // SAFETY: nobody else has the system timer: the time driver runs on another one.
    let mut timer = unsafe { cortex_m::Peripherals::steal() }.SYST;
    timer.set_clock_source(SystClkSource::Core);
    timer.set_reload(SYSCLK_HZ / 1000 - 1);
    #[cfg(not(feature = "hil"))]
    {
        crate::EXCHANGE.expect_beat();
        let begun = embassy_time::Instant::now().as_millis();
        while embassy_time::Instant::now().as_millis() == begun {}
    }
    timer.clear_current();
    timer.enable_interrupt();
    timer.enable_counter();
}

/// The system timer, of the highest priority as every interrupt that is given none, and
/// before the others among these: it beats, and passes on where the processor was.
#[unsafe(naked)]
#[unsafe(export_name = "SysTick")]
unsafe extern "C" fn sys_tick() {
    naked_asm!("mrs r0, msp", "b {look}", look = sym look_at)
}

/// `frame` is where the core put its registers when the interrupt came.
unsafe extern "C" fn look_at(frame: u32) {
    // With the host in the loop it is the host's time that beats.
    #[cfg(not(feature = "hil"))]
    if crate::EXCHANGE.beat() {
        super::angle::begin();
    }
    let unfed = UNFED.load(Ordering::Relaxed);
    UNFED.store(unfed + 1, Ordering::Relaxed);
    if unfed < PATIENCE {
        return;
    }
    guard::cut();
    let (pc, lr) = returns(frame);
    let now = embassy_time::Instant::now().as_millis() as u32;
    let missed = crate::EXCHANGE.unfed(now);
    stop(Stopped::Hang { pc, lr, missed, at: now });
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
/// up, what follows takes it afresh: nothing returns to who was using it.
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
    guard::cut();
    let (pc, lr) = returns(frame);
    // SAFETY: reading these registers changes nothing.
    let (cfsr, hfsr) = unsafe { ((*SCB::PTR).cfsr.read(), (*SCB::PTR).hfsr.read()) };
    stop(Stopped::Fault { pc, lr, cfsr, hfsr });
    restart()
}

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    cortex_m::interrupt::disable();
    guard::cut();
    let (place, line) = info
        .location()
        .map_or((0, 0), |place| (core::ptr::from_ref::<Location<'_>>(place) as u32, place.line()));
    end(Stopped::Panic { place, line })
}

/// Ends the program for this: bridges off, the reason kept, a start anew.
pub(super) fn end(stopped: Stopped) -> ! {
    cortex_m::interrupt::disable();
    guard::cut();
    stop(stopped);
    restart()
}

/// Starts anew, with the bridges off until then and after it.
pub(super) fn restart() -> ! {
    // For the probe to fetch the end of the log: 5 ms at least, some times that at most.
    cortex_m::asm::delay(SYSCLK_HZ / 200);
    SCB::sys_reset()
}
