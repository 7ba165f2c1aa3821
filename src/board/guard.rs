//! The watchdog, and the bridges' reaction to a debugger or a locked-up core.

use cortex_m::peripheral::DWT;
use embassy_stm32::Peri;
use embassy_stm32::peripherals::{IWDG, TIM7};
use embassy_stm32::timer::low_level::Timer;
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_time::{Instant, TICK_HZ};
use interstage::estimate::Place;
use interstage::fault::Limit;
use interstage::hal::Watchdog;
use interstage::restart::DriveSnapshot;
use interstage::tick::{Entry, Event};

use super::registers::{self, DBGMCU, SYSCFG};
use super::{EXCHANGE, retained, safety};

/// Time-out of the watchdog, us, by the nominal 32 kHz of its oscillator.
pub(super) const TIMEOUT_US: u32 = 100_000;

/// Polls for the update of the time-out, of four cycles at least: 1 ms, six times what it takes.
const UPDATE_ROUNDS: u32 = 42_500;

pub(crate) struct Guard {
    dog: IndependentWatchdog<'static, IWDG>,
    halts: HaltWatch,
    /// Position of the wheel by the record of the run before.
    pub(crate) place: Option<Place>,
}

impl Guard {
    /// The watchdog, not yet running.
    pub(crate) fn new(watchdog: Peri<'static, IWDG>, timer: Peri<'static, TIM7>) -> Self {
        let dog = IndependentWatchdog::new(watchdog, TIMEOUT_US);
        Self { dog, halts: HaltWatch::new(timer), place: None }
    }

    /// Starts it; only a reset stops it.
    pub(crate) fn start(&mut self) {
        self.dog.unleash();
        // It counts from its reset value, half a second, up to the first feed after its own
        // oscillator has taken the time-out over, five periods or so.
        let updating = || registers::IWDG.sr().read().0 != 0;
        let _ = (0..UPDATE_ROUNDS).any(|_| !updating());
        self.dog.pet();
        // A probe that flashes the image or resets the chip halts it.
        self.halts.was_halted();
        // A double word of flash with two wrong bits breaks the PWM from here on: what a start reads
        // may be torn by a lost supply, and the checks of sets and records reject it.
        SYSCFG.cfgr2().modify(|w| w.set_eccl(true));
        count_cycles();
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
        if self.halts.was_halted() {
            let event = Event::Limit(Limit::CoreHalted);
            EXCHANGE.log(Entry { at: snapshot.tick, event });
        }
    }

    fn cycles(&self) -> u32 {
        DWT::cycle_count()
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
    // A low supply does not: its detector has no filter, and a bounce would end a run.
    SYSCFG.cfgr2().modify(|w| w.set_cll(true));
    // Halted at a breakpoint, TIM1 and TIM8 stop with their outputs off, and the clock stops.
    DBGMCU.apb1lfzr().modify(|w| {
        w.set_iwdg(true);
        w.set_tim2(true);
    });
    DBGMCU.apb2fzr().modify(|w| {
        w.set_tim1(true);
        w.set_tim8(true);
    });
}

/// Finds a halt of the core by two timers: the clock's stops with it, see [`arm`], TIM7 does not.
/// What the core itself notes of a halt (DFSR) the probe clears.
struct HaltWatch {
    timer: Timer<'static, TIM7>,
    /// By how much TIM7 is ahead of the clock, counts.
    ahead: u16,
}

impl HaltWatch {
    /// A count takes 2^7 us, so that a halt of 0.4 ms shows; all of them 8.4 s.
    const SHIFT: u32 = 7;

    fn new(timer: Peri<'static, TIM7>) -> Self {
        let timer = Timer::new(timer);
        let prescaler = (timer.get_clock_frequency().0 / TICK_HZ as u32) << Self::SHIFT;
        timer.regs_core().psc().write_value((prescaler - 1) as u16);
        timer.generate_update_event();
        timer.start();
        Self { timer, ahead: 0 }
    }

    /// Whether the core has been halted since the last call.
    fn was_halted(&mut self) -> bool {
        let clock = (Instant::now().as_ticks() as u32 >> Self::SHIFT) as u16;
        let ahead = self.timer.regs_core().cnt().read().cnt().wrapping_sub(clock);
        // Both count in steps, at different moments.
        let moved = ahead.wrapping_sub(self.ahead);
        if matches!(moved, 0 | 1 | u16::MAX) {
            return false;
        }
        self.ahead = ahead;
        // In the loop with a host, time is the host's.
        !cfg!(feature = "hil")
    }
}

/// Starts the core's counter of cycles.
pub(crate) fn count_cycles() {
    // SAFETY: nothing else writes these registers.
    let mut core = unsafe { cortex_m::Peripherals::steal() };
    core.DCB.enable_trace();
    core.DWT.enable_cycle_counter();
}
