//! The watchdog, and the bridges' reaction to a debugger or a locked-up core.

use embassy_stm32::Peri;
use embassy_stm32::pac;
use embassy_stm32::peripherals::IWDG;
use embassy_stm32::wdg::IndependentWatchdog;
use interstage::estimate::Place;
use interstage::hal::Watchdog;
use interstage::restart::DriveSnapshot;

use super::{retained, safety};

/// Time-out of the watchdog, us, by the nominal 32 kHz of its oscillator.
const TIMEOUT_US: u32 = 100_000;

pub(crate) struct Guard {
    dog: IndependentWatchdog<'static, IWDG>,
    /// Position of the wheel by the record of the run before.
    pub(crate) place: Option<Place>,
}

impl Guard {
    /// The watchdog, not yet running.
    pub(crate) fn new(watchdog: Peri<'static, IWDG>) -> Self {
        Self { dog: IndependentWatchdog::new(watchdog, TIMEOUT_US), place: None }
    }

    /// Starts it; only a reset stops it.
    pub(crate) fn start(&mut self) {
        self.dog.unleash();
        safety::watch_feeding();
    }
}

impl Watchdog for Guard {
    fn feed(&mut self) {
        self.dog.pet();
        safety::fed();
    }

    fn keep(&mut self, snapshot: &DriveSnapshot) {
        retained::keep(snapshot);
    }

    fn place(&self) -> Option<Place> {
        self.place
    }
}

/// Connects a lock-up of the core to the break of the PWM timers, and stops the watchdog while a
/// debugger halts the core.
pub(crate) fn arm() {
    // A locked-up core (a fault inside the fault handler, as after a stack overflow) executes
    // nothing any more: the timers cut the bridges themselves.
    pac::SYSCFG.cfgr2().modify(|w| w.set_cll(true));
    // Halted at a breakpoint, TIM1 and TIM8 stop with their outputs off, and the clock stops.
    pac::DBGMCU.apb1lfzr().modify(|w| {
        w.set_iwdg(true);
        w.set_tim2(true);
    });
    pac::DBGMCU.apb2fzr().modify(|w| {
        w.set_tim1(true);
        w.set_tim8(true);
    });
}
