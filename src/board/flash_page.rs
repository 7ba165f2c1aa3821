//! Blocking writes of double words to the chip's second flash bank: for code that runs before
//! the tasks or after them. The library's driver belongs to the task of the parameter sets, and
//! these writes have no task to lend it; one of them comes from an interrupt, maybe in the middle
//! of an operation of that driver. `Flash::new_blocking` would serve the first start alone.
//!
//! The last pages of the 512 KiB are in use: one for image checksums, one for records of a lost
//! supply, then the two slots of a parameter set.

use core::ptr;

use interstage::params::slots::SLOT_BYTES;
use interstage::restart::page::{self, PAGE_BYTES, WORD_BYTES, Word};

use super::registers::FLASH;

/// End of flash in memory.
const END: u32 = 0x0808_0000;

/// Begin of the second bank.
const SECOND_BANK: u32 = 0x0804_0000;

/// Whether the chip's option bytes leave its flash in two banks, as delivered. With one bank
/// the numbers of pages mean other addresses, so that nothing here writes or erases.
pub(crate) fn two_banks() -> bool {
    FLASH.optr().read().dbank()
}

/// A page that is written by double words from its begin on.
#[derive(Clone, Copy)]
pub(super) struct Page(u32);

/// Records of a supply that was lost.
pub(super) const RECORDS: Page = Page(END - (2 * SLOT_BYTES + PAGE_BYTES) as u32);

/// Known images and their checksums.
pub(super) const IMAGE_CHECKSUMS: Page = Page(RECORDS.0 - PAGE_BYTES as u32);

impl Page {
    pub(super) fn bytes(self) -> &'static page::Page {
        // SAFETY: inside flash, which is always mapped and holds plain bytes. It changes only
        // before the tasks, and in a handler that does not return; nobody holds the reference over
        // a change, and `Open::end` lets no read pass one.
        unsafe { &*ptr::with_exposed_provenance(self.0 as usize) }
    }

    /// Programs the double word of this number, which has to be blank; takes 0.1 ms, and up to
    /// 25 ms more during an erase. False on failure.
    #[inline(never)]
    pub(super) fn program(self, index: usize, [low, high]: Word) -> bool {
        let place = self.0 + (index * WORD_BYTES) as u32;
        let Some(open) = Open::begin() else { return false };
        FLASH.cr().write(|w| w.set_pg(true));
        // SAFETY: inside a page outside the image, which is only written through this pointer.
        // The chip takes the double word once both words have come.
        unsafe {
            let place: *mut u32 = ptr::with_exposed_provenance_mut(place as usize);
            place.write_volatile(low);
            place.add(1).write_volatile(high);
        }
        open.end()
    }

    /// Erases it, in about 22 ms.
    #[inline(never)]
    pub(super) fn erase(self) -> bool {
        let Some(open) = Open::begin() else { return false };
        FLASH.cr().write(|w| {
            w.set_per(true);
            w.set_bker(true);
            w.set_pnb(((self.0 - SECOND_BANK) / PAGE_BYTES as u32) as u8);
        });
        FLASH.cr().modify(|w| w.set_strt(true));
        open.end()
    }
}

/// The flash's interface, unlocked, and the data cache off: code from the first bank would fill
/// it while the second is written, and its content may then be wrong (STM32G474 errata ES0430).
struct Open {
    cached: bool,
}

impl Open {
    /// Waits for an operation in progress, and unlocks; none if the flash has one bank.
    #[inline(never)]
    fn begin() -> Option<Self> {
        if !two_banks() {
            return None;
        }
        wait();
        let cached = FLASH.acr().read().dcen();
        FLASH.acr().modify(|w| w.set_dcen(false));
        // Clears errors of earlier operations, which would block this one.
        FLASH.sr().write_value(FLASH.sr().read());
        if FLASH.cr().read().lock() {
            FLASH.keyr().write_value(0x4567_0123);
            FLASH.keyr().write_value(0xCDEF_89AB);
        }
        Some(Self { cached })
    }

    /// Waits for the end, and locks; returns whether it succeeded. The cache starts empty.
    #[inline(never)]
    fn end(self) -> bool {
        wait();
        let status = FLASH.sr().read();
        FLASH.cr().write(|w| w.set_lock(true));
        FLASH.acr().modify(|w| w.set_dcrst(true));
        FLASH.acr().modify(|w| w.set_dcrst(false));
        FLASH.acr().modify(|w| w.set_dcen(self.cached));
        // For the compiler, too: what it has read of the page is no longer true.
        cortex_m::asm::dsb();
        !(status.progerr() || status.pgaerr() || status.pgserr() || status.wrperr())
    }
}

fn wait() {
    while FLASH.sr().read().bsy() {}
}
