//! Start, panic and the list of what can be called.

mod rollout;
mod slot;
mod tick;

use cortex_m::asm::bkpt;
use defmt as _;
use embassy_stm32 as _;

/// Runs once; the host takes over at the breakpoint.
#[cortex_m_rt::entry]
fn main() -> ! {
    // Keeps what only the host calls.
    core::hint::black_box([
        rollout::model_build as *const (),
        rollout::rollout as *const (),
        tick::tick_build as *const (),
        tick::tick_skip_nothing as *const (),
        tick::tick_load as *const (),
        tick::tick_step as *const (),
        tick::tick_plan as *const (),
        tick::tick_save as *const (),
    ]);
    loop {
        bkpt();
    }
}

/// A breakpoint outside of `main` reports it to the host.
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {
        bkpt();
    }
}
