//! Supply monitor: before the supply is too low for the chip, it switches the bridges off and
//! writes the drive's snapshot to flash, where the next start finds it.
//!
//! The chip compares its supply with 2.81 V, without a filter: what has gone after [`BOUNCE`] was
//! none. From there to its own reset at 1.7 V the board's capacitors last for a millisecond (see
//! `docs/HARDWARE.md`); a record takes a third of that.

use embassy_stm32::interrupt::{self, InterruptExt};
use interstage::restart::Stopped;
use interstage::restart::flash_log::{self, Latest};

use super::flash_page::RECORDS;
use super::registers::{EXTI, PWR};
use super::{SYSCLK_HZ, retained, safety};

/// Threshold of the chip's detector: falling 2.75 to 2.86 V, rising up to 2.96 V (DS12288,
/// V_PVD5). The next one reaches up to 3.04 V, and a supply under load may be down to 3.17 V.
const LEVEL: u8 = 5;

/// For so many rounds of three or four cycles a supply has to be low: 20 to 27 us, in which it
/// falls by 10 mV at most.
const BOUNCE: u32 = SYSCLK_HZ / 50_000 / 3;

/// Line of the detector among the external interrupts; high while the supply is low.
const LINE: usize = 16;

/// Starts the detector and waits while the supply is too low; returns whether it had to wait.
pub(crate) fn watch() -> bool {
    PWR.cr2().modify(|w| {
        w.set_pls(LEVEL);
        w.set_pvde(true);
    });
    EXTI.rtsr(0).modify(|w| w.set_line(LINE, true));
    EXTI.imr(0).modify(|w| w.set_line(LINE, true));
    let mut waited = false;
    // A fall before the detector ran has been waited for; one after the last check raises the
    // interrupt.
    while is_low() || {
        EXTI.pr(0).write(|w| w.set_line(LINE, true));
        interrupt::PVD_PVM.unpend();
        is_low()
    } {
        waited = true;
    }
    // SAFETY: the handler shares nothing with other code: it returns having done nothing, or never.
    unsafe { interrupt::PVD_PVM.enable() };
    waited
}

fn is_low() -> bool {
    PWR.sr2().read().pvdo()
}

/// The record of the last loss of supply, if no start has taken it yet.
pub(super) fn found() -> Option<Latest> {
    flash_log::latest(RECORDS.bytes())
}

/// Marks it as taken, once it is kept elsewhere, and makes room for the next.
pub(super) fn take(found: Option<Latest>) {
    if let Some(latest) = found {
        RECORDS.program(latest.mark, flash_log::TAKEN);
    }
    if flash_log::free(RECORDS.bytes()).is_none() {
        RECORDS.erase();
    }
}

/// The supply falls: a start follows, unless it was a bounce.
#[embassy_stm32::interrupt]
unsafe fn PVD_PVM() {
    EXTI.pr(0).write(|w| w.set_line(LINE, true));
    cortex_m::asm::delay(BOUNCE);
    if !is_low() {
        return;
    }
    cortex_m::interrupt::disable();
    safety::cut();
    // Whatever ends the program from here on, this is the reason.
    retained::stop(Stopped::Supply);
    if let (Some(snapshot), Some(first)) = (retained::snapshot(), flash_log::free(RECORDS.bytes()))
    {
        for (index, word) in (first..).zip(flash_log::words(&snapshot)) {
            // Fails if another write was in progress; the failure ends that one.
            let _ = RECORDS.program(index, word) || RECORDS.program(index, word);
        }
    }
    // The supply may recover before a reset, or the watchdog may bite first.
    while is_low() {}
    safety::restart()
}
