//! Supply monitor: before the supply is too low for the chip, it switches the bridges off and
//! writes the drive's snapshot to flash, where the next start finds it.
//!
//! The chip compares its supply with 2.9 V. From there to its own reset at 1.7 V the board's
//! capacitors last for a millisecond (see `docs/HARDWARE.md`); a record takes a third of that.

use embassy_stm32::interrupt::{self, InterruptExt};
use interstage::restart::Stopped;
use interstage::restart::flash_log::{self, Latest};

use super::flash_page::RECORDS;
use super::registers::{EXTI, PWR};
use super::{retained, safety};

/// Threshold of the chip's detector: 2.9 V falling, 3.0 V rising.
const LEVEL: u8 = 6;

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
    let is_low = || PWR.sr2().read().pvdo();
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
    // SAFETY: the handler never returns, so it shares nothing with other code.
    unsafe { interrupt::PVD_PVM.enable() };
    waited
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

/// The supply falls. After this handler only a start follows.
#[embassy_stm32::interrupt]
unsafe fn PVD_PVM() {
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
    while PWR.sr2().read().pvdo() {}
    safety::restart()
}
