//! The supply, watched: before it is too low for the chip, the bridges go off and what the
//! drive was doing goes to flash, where the next start finds it.
//!
//! The chip compares its supply with 2.9 V. From there on down to where it resets itself,
//! 1.7 V, what the board's capacitors hold has to last for a millisecond (see
//! `docs/HARDWARE.md`); a record takes a third of that.

use embassy_stm32::interrupt::{self, InterruptExt};
use embassy_stm32::pac::{EXTI, PWR};
use interstage::restart::Stopped;
use interstage::restart::flash_log::{self, Latest};

use super::flash_page::RECORDS;
use super::{guard, retained};

/// Threshold of the chip's detector: 2.9 V falling, 3.0 V rising.
const LEVEL: u8 = 6;

/// Line of the detector among the external interrupts; high means low.
const LINE: usize = 16;

/// Begins to watch; waits for as long as the supply is too low to go on with, and says
/// whether it was.
pub(crate) fn watch() -> bool {
    PWR.cr2().modify(|w| {
        w.set_pls(LEVEL);
        w.set_pvde(true);
    });
    EXTI.rtsr(0).modify(|w| w.set_line(LINE, true));
    EXTI.imr(0).modify(|w| w.set_line(LINE, true));
    let is_low = || PWR.sr2().read().pvdo();
    let mut waited = false;
    // What fell before anyone looked has been waited for; what falls behind the last look
    // here is told.
    while is_low() || {
        EXTI.pr(0).write(|w| w.set_line(LINE, true));
        interrupt::PVD_PVM.unpend();
        is_low()
    } {
        waited = true;
    }
    // SAFETY: the handler shares nothing with anyone who goes on behind it.
    unsafe { interrupt::PVD_PVM.enable() };
    waited
}

/// What the supply left when it went, if no start has taken it yet.
pub(super) fn found() -> Option<Latest> {
    flash_log::latest(RECORDS.bytes())
}

/// Takes it, once it is kept elsewhere, and makes room for the next.
pub(super) fn take(found: Option<Latest>) {
    if let Some(latest) = found {
        RECORDS.program(latest.mark, flash_log::TAKEN);
    }
    if flash_log::free(RECORDS.bytes()).is_none() {
        RECORDS.erase();
    }
}

/// The supply falls. Nothing runs behind this but a start.
#[embassy_stm32::interrupt]
unsafe fn PVD_PVM() {
    cortex_m::interrupt::disable();
    guard::cut();
    // Whatever ends it from here on, this is why.
    retained::stop(Stopped::Supply);
    if let (Some(snapshot), Some(first)) = (retained::snapshot(), flash_log::free(RECORDS.bytes()))
    {
        for (index, word) in (first..).zip(flash_log::words(&snapshot)) {
            // Refused if someone else was in the middle of a double word, which is dropped
            // then.
            let _ = RECORDS.program(index, word) || RECORDS.program(index, word);
        }
    }
    // It may come back before the chip is reset, or the watchdog bite before it does.
    while PWR.sr2().read().pvdo() {}
    retained::restart()
}
