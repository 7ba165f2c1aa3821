//! The clock: it advances with the host's ticks.

use core::cell::{Cell, RefCell};
use core::task::Waker;

use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_time_driver::{Driver, TICK_HZ as CLOCK_HZ, time_driver_impl};
use embassy_time_queue_utils::Queue;
use interstage::hal::hil::FIRST;
use interstage::units::{TICK_HZ, Tick};

/// Clock ticks in a control tick.
const CLOCKS: u64 = CLOCK_HZ / TICK_HZ as u64;

/// Time that advances in whole control ticks.
struct Steps {
    now: Mutex<CriticalSectionRawMutex, Cell<u64>>,
    timers: Mutex<CriticalSectionRawMutex, RefCell<Queue>>,
}

time_driver_impl!(static CLOCK: Steps = Steps {
    now: Mutex::new(Cell::new((FIRST as u64 - 1) * CLOCKS)),
    timers: Mutex::new(RefCell::new(Queue::new())),
});

impl Driver for Steps {
    fn now(&self) -> u64 {
        self.now.lock(Cell::get)
    }

    fn schedule_wake(&self, at: u64, waker: &Waker) {
        let now = self.now();
        self.timers.lock(|timers| {
            let mut timers = timers.borrow_mut();
            if timers.schedule_wake(at, waker) {
                // Wakes what is due already; the next tick wakes the rest.
                timers.next_expiration(now);
            }
        });
    }
}

/// Advances time to the start of a tick. What is due runs before this returns to thread mode.
pub(super) fn advance(to: Tick) {
    let now = u64::from(to) * CLOCKS;
    CLOCK.now.lock(|place| place.set(now));
    CLOCK.timers.lock(|timers| {
        timers.borrow_mut().next_expiration(now);
    });
    settle();
}

/// Runs every woken task: takes the executors' pending interrupts now.
pub(super) fn settle() {
    cortex_m::asm::dsb();
    cortex_m::asm::isb();
}
