//! Start, panic, and what the host reads and writes.

use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::asm::bkpt;
use defmt as _;

use crate::assembly::conditional;
use crate::checks;

/// One bit for each check that failed, in the order of [`checks::ALL`].
#[unsafe(no_mangle)]
static FAILED: AtomicU32 = AtomicU32::new(u32::MAX);
/// What the host gives to the conditional block, and what comes out of it.
#[unsafe(no_mangle)]
static GIVEN: AtomicU32 = AtomicU32::new(0);
#[unsafe(no_mangle)]
static RETURNED: AtomicU32 = AtomicU32::new(0);

#[cortex_m_rt::entry]
fn main() -> ! {
    checks::prepare();
    let mut failed = 0;
    for (bit, check) in checks::ALL.iter().enumerate() {
        if !check() {
            failed |= 1 << bit;
        }
    }
    FAILED.store(failed, Ordering::Relaxed);
    loop {
        bkpt();
        // SAFETY: plain arithmetic.
        let returned = unsafe { conditional(GIVEN.load(Ordering::Relaxed)) };
        RETURNED.store(returned, Ordering::Relaxed);
    }
}

/// A breakpoint outside of `main` reports it to the host.
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {
        bkpt();
    }
}
