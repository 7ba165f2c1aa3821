//! What makes the bridges safe when the software no longer does.

use cortex_m_rt::{ExceptionFrame, exception};
use embassy_stm32::Peri;
use embassy_stm32::pac;
use embassy_stm32::peripherals::IWDG;
use embassy_stm32::wdg::IndependentWatchdog;
use interstage::hal::Watchdog;

/// Time-out of the watchdog, us, by the nominal 32 kHz of its oscillator.
const TIMEOUT_US: u32 = 100_000;

/// The independent watchdog.
pub(crate) struct Guard(IndependentWatchdog<'static, IWDG>);

impl Guard {
    /// The watchdog, not yet running.
    pub(crate) fn new(watchdog: Peri<'static, IWDG>) -> Self {
        Self(IndependentWatchdog::new(watchdog, TIMEOUT_US))
    }

    /// Starts it; from here on nothing but a reset stops it.
    pub(crate) fn start(&mut self) {
        self.0.unleash();
    }
}

impl Watchdog for Guard {
    fn feed(&mut self) {
        self.0.pet();
    }
}

/// Ties the core's failures to the PWM timers' break and lets a debugger halt
/// the core without running into the watchdog.
pub(crate) fn arm() {
    // A locked-up core (a fault inside the fault handler, as after a stack
    // overflow) executes nothing any more: the timers cut the bridges themselves.
    pac::SYSCFG.cfgr2().modify(|w| w.set_cll(true));
    // Halted at a breakpoint, TIM1 and TIM8 stop with their outputs off.
    pac::DBGMCU.apb1lfzr().modify(|w| w.set_iwdg(true));
    pac::DBGMCU.apb2fzr().modify(|w| {
        w.set_tim1(true);
        w.set_tim8(true);
    });
}

/// Says why the board restarted, if it was not the operator, and forgets it.
pub(crate) fn report_restart() {
    let cause = pac::RCC.csr().read();
    if cause.iwdgrstf() {
        defmt::error!("restarted by the watchdog");
    } else if cause.sftrstf() {
        defmt::info!("restarted by software or debugger");
    }
    pac::RCC.csr().modify(|w| w.set_rmvf(true));
}

/// Panics and faults end here: bridges off, then wait for the watchdog.
#[exception]
unsafe fn HardFault(_frame: &ExceptionFrame) -> ! {
    pac::TIM1.bdtr().modify(|w| w.set_moe(false));
    pac::TIM8.bdtr().modify(|w| w.set_moe(false));
    loop {
        cortex_m::asm::nop();
    }
}
