//! Which image this is, and whether it is still what was flashed.

use core::slice;

use embassy_time::{Duration, Timer};
use interstage::restart::Stopped;
use interstage::restart::image_checksum;

use super::flash_page::SEALS;
use super::{light, retained};

unsafe extern "C" {
    /// The note that the linker writes, see `memory.x`: three words of head, the name
    /// `GNU` with its zero, then the hash of the image.
    static __build_id: [u8; 24];
    static __vector_table: u32;
    /// Initial values of the statics, with which the image ends.
    static __sidata: u8;
    static __sdata: u8;
    static __edata: u8;
}

/// First eight bytes of the image's hash. `readelf -n` shows the whole of it.
pub(super) fn id() -> [u8; 8] {
    let mut id = [0; 8];
    // SAFETY: the linker script keeps the note, which is longer than what is read, in
    // flash, where nothing changes it.
    let note = unsafe { &__build_id };
    id.copy_from_slice(&note[16..]);
    id
}

/// Its words, as they stand in flash; what is left of a last one is no part of any image.
fn words() -> &'static [u32] {
    let first = &raw const __vector_table;
    let values = &raw const __edata as usize - &raw const __sdata as usize;
    let length = &raw const __sidata as usize + values - first as usize;
    // SAFETY: flash from the vectors, which are aligned, to the end of the image, which nothing
    // writes to.
    unsafe { slice::from_raw_parts(first, length / 4) }
}

/// Time for which the light is dark, and then tells of a damaged image, before the clocks run:
/// in cycles of the oscillator that the chip starts on.
const SHOWN: u32 = 16_000_000 / 4;

/// The very first of a start, before statics have their values: looks at the image, and shows
/// by the light for a while if a bit has turned over. What comes behind says so too, if it
/// still works; if it does not and starts over and over, the light blinks.
///
/// Needs nothing of the image but itself, [`seals`] and some registers.
#[unsafe(export_name = "__pre_init")]
extern "C" fn look() {
    let (sum, sealed) = sums();
    if sealed.is_some_and(|sealed| sealed != sum) {
        cortex_m::asm::delay(SHOWN);
        light::glow();
        cortex_m::asm::delay(SHOWN);
    }
}

/// The image's sum, and that of its first start, if this is not the first.
#[inline(never)]
fn sums() -> (u32, Option<u32>) {
    (image_checksum::sum_on(0, words()), image_checksum::sum_of(SEALS.bytes(), id()))
}

/// The image's sum, if it is the one of its first start, or this is its first; none if a bit
/// has turned over since, which is said at once: what comes behind may no longer work.
pub(crate) fn verify() -> Option<u32> {
    let (sum, sealed) = sums();
    match sealed {
        None => seal(sum),
        Some(sealed) if sealed != sum => {
            say_damaged();
            return None;
        }
        Some(_) => {}
    }
    Some(sum)
}

/// Keeps the sum for the starts to come.
fn seal(sum: u32) {
    defmt::info!("first start of this image, sum {=u32:08x}", sum);
    let first = image_checksum::free(SEALS.bytes()).unwrap_or_else(|| {
        SEALS.erase();
        0
    });
    for (index, word) in image_checksum::entry(id(), sum).into_iter().enumerate() {
        SEALS.program(first + index, word);
    }
}

/// Says that it is no longer what it was.
#[inline(never)]
pub(super) fn say_damaged() {
    defmt::error!("image: a bit has turned over since its first start; flash it again");
}

/// Words that are summed up in one go.
const PART: usize = 256;

/// From one part to the next: a round takes six seconds, and no more than a thousandth of
/// the core.
const PACE: Duration = Duration::from_millis(50);

/// Sums up the image over and over, and ends the program if it is no longer what it was.
#[embassy_executor::task]
pub(crate) async fn watch(sealed: u32) -> ! {
    loop {
        let mut sum = 0;
        for part in words().chunks(PART) {
            Timer::at(crate::EXCHANGE.aside(PACE)).await;
            sum = image_checksum::sum_on(sum, part);
        }
        if sum != sealed {
            // Also for the case that what starts anew cannot say it any more.
            say_damaged();
            retained::end(Stopped::Image);
        }
    }
}
