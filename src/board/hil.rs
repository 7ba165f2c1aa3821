//! Hardware in the loop: sensors, bridges, button and time are the host's
//! ([`interstage::hal::hil`]). Everything else is the firmware as it is flashed.
//!
//! The real bridges have no power: no timer drives their pins, which are held low.

mod clock;
mod host_io;
mod parts;
mod serve;

pub(crate) use parts::{Analog, Angle, Bridges, Button, Wheel, split};

use embassy_executor::{InterruptExecutor, Spawner};
use embassy_stm32::interrupt::{self, InterruptExt, Priority};
use rtt_target::DownChannel;

use super::registers::{IWDG, IwdgKey};
use super::rtt::{Channels, Frames};
use super::safety;

/// Replaces the thread executor.
static THREADS: InterruptExecutor = InterruptExecutor::new();

#[embassy_stm32::interrupt]
unsafe fn UART4() {
    // SAFETY: this is the executor's handler, unmasked by `start` alone.
    unsafe { THREADS.on_interrupt() }
}

/// In a pause of a plan: the host's time stands until it is there, and nobody feeds the watchdog.
pub(crate) fn paused() {
    IWDG.kr().write(|key| key.set_key(IwdgKey::RESET));
    safety::fed();
}

type Begin = fn(Spawner, Channels);

/// Runs the host's line in thread mode, where it advances time when every task waits; the tasks
/// that otherwise run there have an executor of their own.
pub(crate) fn run((channels, host): (Channels, (Frames, DownChannel)), begin: Begin) -> ! {
    defmt::warn!(
        "image for the loop with a host: it moves no motor; `cargo rig flash` puts the other back"
    );
    serve::serve(host, || {
        interrupt::UART4.set_priority(Priority::P15);
        THREADS.start(interrupt::UART4).spawn(boot(channels, begin).unwrap());
    })
}

#[embassy_executor::task]
async fn boot(channels: Channels, begin: Begin) {
    // SAFETY: a task's context is always the executor's.
    begin(unsafe { Spawner::for_current_executor().await }, channels);
}
