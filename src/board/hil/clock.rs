//! The clock: it stands until the host's next tick has come.

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

/// Time that moves in whole control ticks, when it is told to.
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
                // What is due already is woken here; the rest by the tick that comes.
                timers.next_expiration(now);
            }
        });
    }
}

/// Moves time on to the beginning of a tick. What is due runs before this returns to
/// thread mode.
pub(super) fn advance(to: Tick) {
    let now = u64::from(to) * CLOCKS;
    CLOCK.now.lock(|place| place.set(now));
    CLOCK.timers.lock(|timers| {
        timers.borrow_mut().next_expiration(now);
    });
    settle();
}

/// Lets every task run that has been woken: the executors' interrupts are pending, and
/// are taken here and not some instructions later.
pub(super) fn settle() {
    cortex_m::asm::dsb();
    cortex_m::asm::isb();
}
