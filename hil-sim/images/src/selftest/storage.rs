//! Programming and erasing the flash, by its registers.

use embassy_stm32::pac::FLASH;

/// Last page of the second bank, where no code lies, and its number there.
const PAGE: *mut u32 = 0x0807_F800 as *mut u32;
const NUMBER: u8 = 127;

/// Waits until the flash is at rest; true without an error, which is cleared.
fn rests() -> bool {
    while FLASH.sr().read().bsy() {}
    let status = FLASH.sr().read();
    FLASH.sr().write_value(status);
    !(status.progerr() || status.pgaerr() || status.sizerr() || status.pgserr())
}

fn erase() -> bool {
    FLASH.cr().write(|w| {
        w.set_per(true);
        w.set_bker(true);
        w.set_pnb(NUMBER);
        w.set_strt(true);
    });
    let done = rests();
    FLASH.cr().write(|w| w.set_per(false));
    done
}

/// Programs the double word of this number in the page.
fn program(number: usize, words: [u32; 2]) -> bool {
    FLASH.cr().write(|w| w.set_pg(true));
    // SAFETY: inside the page, which holds nothing else.
    unsafe {
        PAGE.add(2 * number).write_volatile(words[0]);
        PAGE.add(2 * number + 1).write_volatile(words[1]);
    }
    let done = rests();
    FLASH.cr().write(|w| w.set_pg(false));
    done
}

fn read(number: usize) -> [u32; 2] {
    // SAFETY: as above.
    unsafe { [0, 1].map(|word| PAGE.add(2 * number + word).read_volatile()) }
}

/// Erased flash takes a double word once; what breaks a rule takes nothing.
pub(crate) fn flash() -> bool {
    for key in [0x4567_0123, 0xCDEF_89AB] {
        FLASH.keyr().write_value(key);
    }
    let written = erase()
        && program(0, [0x0123_4567, 0x89AB_CDEF])
        && program(255, [1, 2])
        && [read(0), read(255), read(1)] == [[0x0123_4567, 0x89AB_CDEF], [1, 2], [u32::MAX; 2]];
    let refused = !program(0, [0, 1]) && read(0) == [0x0123_4567, 0x89AB_CDEF];
    // Not told to program.
    // SAFETY: as above.
    unsafe { PAGE.add(4).write_volatile(0) };
    let sequence = !rests() && read(2) == [u32::MAX; 2];
    let erased = erase() && [read(0), read(255)] == [[u32::MAX; 2]; 2];
    FLASH.cr().write(|w| w.set_lock(true));
    written && refused && sequence && erased && FLASH.cr().read().lock()
}
