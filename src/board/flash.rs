//! The two slots of the parameter set at the end of the chip's flash.
//!
//! They are in the second bank: while a page of it is erased or a double word programmed, the
//! core still reads code from the first, so the control tick continues.

use embassy_stm32::Peri;
use embassy_stm32::flash::{Async, Flash};
use embassy_stm32::peripherals::FLASH;
use interstage::params::Refusal;
use interstage::params::slots::{PAGE_BYTES, SLOT_BYTES, SetMemory, Slot, WORD_BYTES};

use super::{Irqs, safety};

const BASE: usize = 0x0800_0000;

/// The last 8 KiB of 512.
const SLOTS: usize = 512 * 1024 - 2 * SLOT_BYTES;

/// The chip's flash controller.
pub(crate) struct ParameterFlash(Flash<'static, Async>);

impl ParameterFlash {
    pub(crate) fn new(flash: Peri<'static, FLASH>) -> Self {
        Self(Flash::new(flash, Irqs))
    }
}

/// Offset of a slot from the begin of flash, bytes.
const fn offset_of(slot: Slot) -> usize {
    SLOTS + slot as usize * SLOT_BYTES
}

impl SetMemory for ParameterFlash {
    fn bytes(&self, slot: Slot) -> &[u8] {
        let start = (BASE + offset_of(slot)) as *const u8;
        // SAFETY: inside flash, which is always mapped and holds plain bytes; it changes
        // through `&mut self` alone, so not during this borrow.
        unsafe { core::slice::from_raw_parts(start, SLOT_BYTES) }
    }

    fn is_readable(&self, slot: Slot) -> bool {
        let before = safety::unreadable();
        for word in self.bytes(slot).chunks(WORD_BYTES) {
            // SAFETY: a byte of flash. Volatile: what counts is that it is read.
            let _ = word.first().map(|byte| unsafe { core::ptr::from_ref(byte).read_volatile() });
        }
        // What a read reports has interrupted the core once the read is complete and the core has
        // refetched.
        cortex_m::asm::dsb();
        cortex_m::asm::isb();
        safety::unreadable() == before
    }

    async fn erase(&mut self, slot: Slot, page: usize) -> Result<(), Refusal> {
        let from = (offset_of(slot) + page * PAGE_BYTES) as u32;
        self.0.erase(from, from + PAGE_BYTES as u32).await.map_err(|_| Refusal::Flash)
    }

    async fn program(
        &mut self,
        slot: Slot,
        offset: usize,
        word: [u8; WORD_BYTES],
    ) -> Result<(), Refusal> {
        let at = (offset_of(slot) + offset) as u32;
        self.0.write(at, &word).await.map_err(|_| Refusal::Flash)
    }
}
