//! Hash of the image, and whether the image is intact.

use core::{ptr, slice};

use cortex_m::asm;
use interstage::restart::image_checksum;

use super::flash_page::IMAGE_CHECKSUMS;
use super::light;

unsafe extern "C" {
    /// The note that the linker writes, see `memory.x`: three words of head, the name
    /// `GNU` with its zero, then the hash of the image.
    static __build_id: [[u8; 8]; 3];
    static __vector_table: u32;
    /// Initial values of the statics, with which the image ends.
    static __sidata: u8;
    static __sdata: u8;
    static __edata: u8;
}

/// First eight bytes of the image's hash; `readelf -n` shows all of it.
pub(super) fn id() -> [u8; 8] {
    // SAFETY: the linker script keeps the note in flash, where nothing changes it; it is longer
    // than what is read.
    unsafe { __build_id[2] }
}

/// Its words in flash; the rest of an incomplete last word belongs to no image.
pub(super) fn words() -> &'static [u32] {
    let first = &raw const __vector_table;
    let values = &raw const __edata as usize - &raw const __sdata as usize;
    let length = &raw const __sidata as usize + values - first as usize;
    // SAFETY: flash from the aligned vectors to the end of the image, never written. The linker's
    // symbol is one word, so that the pointer is made of its address.
    unsafe { slice::from_raw_parts(ptr::with_exposed_provenance(first as usize), length / 4) }
}

/// Half a period of 2 to 3 Hz, rounds of three or four cycles of the oscillator that the chip
/// starts on.
const HALF_PERIOD: u32 = 16_000_000 / 4 / 4;

/// Runs first of all, before statics have their values: shows a damaged image by the light, in
/// case the code that would log it no longer works. The light is off for half a period, the
/// checksum included, and then on: a damaged image that restarts in a loop blinks. Needs only
/// this function, [`checksums`] and some registers: it may read and write no static in RAM. The
/// bridges' lines, which in reset have their pull-downs alone, it drives low before all else.
#[unsafe(export_name = "__pre_init")]
extern "C" fn look() {
    light::hold_bridges();
    let (now, first) = checksums();
    if first.is_some_and(|first| first != now) {
        asm::delay(HALF_PERIOD);
        light::glow();
        asm::delay(HALF_PERIOD);
    }
}

/// The image's checksum, and that of its first start; none if this is the first.
#[inline(never)]
fn checksums() -> (u32, Option<u32>) {
    (image_checksum::sum_on(0, words()), image_checksum::sum_of(IMAGE_CHECKSUMS.bytes(), id()))
}

/// The image's checksum; none, and an error in the log, if it has changed since the first
/// start of the image.
pub(crate) fn verify() -> Option<u32> {
    let (now, first) = checksums();
    if first.is_none() {
        store(now);
    } else if first != Some(now) {
        log_damaged();
        return None;
    }
    Some(now)
}

fn store(sum: u32) {
    defmt::info!("first start of this image, sum {=u32:08x}", sum);
    let first = image_checksum::free(IMAGE_CHECKSUMS.bytes()).unwrap_or_else(|| {
        IMAGE_CHECKSUMS.erase();
        0
    });
    for (index, word) in image_checksum::entry(id(), sum).into_iter().enumerate() {
        IMAGE_CHECKSUMS.program(first + index, word);
    }
}

#[inline(never)]
pub(super) fn log_damaged() {
    defmt::error!("image: a bit has turned over since its first start; flash it again");
}
