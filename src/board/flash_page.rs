//! Double words of the chip's second bank of flash, written at once and waited for: where
//! nobody else runs any more, or yet.
//!
//! Of the 512 KiB the last pages are in use: one for the seals of images, one for records of
//! a lost supply, and behind them the two places of a set of parameters.

use embassy_stm32::pac::FLASH;
use interstage::params::slots::SLOT_BYTES;
use interstage::restart::page::{self, PAGE_BYTES, WORD_BYTES, Word};

/// Where flash ends in memory.
const END: u32 = 0x0808_0000;

/// Where the second bank begins.
const SECOND_BANK: u32 = 0x0804_0000;

/// A page that is written by double words from its beginning on.
#[derive(Clone, Copy)]
pub(super) struct Page(u32);

/// Records of a supply that was lost.
pub(super) const RECORDS: Page = Page(END - (2 * SLOT_BYTES + PAGE_BYTES) as u32);

/// Which images are known, and their sums.
pub(super) const SEALS: Page = Page(RECORDS.0 - PAGE_BYTES as u32);

impl Page {
    /// What stands there.
    pub(super) fn bytes(self) -> &'static page::Page {
        // SAFETY: inside flash, which is always mapped and holds plain bytes. It changes at
        // a start, before the tasks, and in a handler that does not return: whoever reads it
        // then does so again behind each change.
        unsafe { &*(self.0 as *const page::Page) }
    }

    /// Programs the double word of this number, which has to be blank; takes 0.1 ms, and up
    /// to 25 ms more if a page is being erased. False if it was not taken.
    #[inline(never)]
    pub(super) fn program(self, index: usize, [low, high]: Word) -> bool {
        let place = self.0 + (index * WORD_BYTES) as u32;
        open();
        FLASH.cr().write(|w| w.set_pg(true));
        // SAFETY: inside a page that the image has no part in. Nothing is read through this
        // pointer, and the chip takes the double word once both words have come.
        unsafe {
            (place as *mut u32).write_volatile(low);
            ((place + 4) as *mut u32).write_volatile(high);
        }
        close()
    }

    /// Erases it, in about 22 ms.
    #[inline(never)]
    pub(super) fn erase(self) -> bool {
        open();
        FLASH.cr().write(|w| {
            w.set_per(true);
            w.set_bker(true);
            w.set_pnb(((self.0 - SECOND_BANK) / PAGE_BYTES as u32) as u8);
        });
        FLASH.cr().modify(|w| w.set_strt(true));
        close()
    }
}

/// Waits for what is under way, and takes the lock off.
#[inline(never)]
fn open() {
    wait();
    // Errors of whoever came before, which would bar the way.
    FLASH.sr().write_value(FLASH.sr().read());
    if FLASH.cr().read().lock() {
        FLASH.keyr().write_value(0x4567_0123);
        FLASH.keyr().write_value(0xCDEF_89AB);
    }
}

/// Waits for the end, and locks; whether it went well.
#[inline(never)]
fn close() -> bool {
    wait();
    let status = FLASH.sr().read();
    FLASH.cr().write(|w| w.set_lock(true));
    !(status.progerr() || status.pgaerr() || status.pgserr() || status.wrperr())
}

fn wait() {
    while FLASH.sr().read().bsy() {}
}
