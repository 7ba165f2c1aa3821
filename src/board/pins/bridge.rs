//! The two motor bridges, each driven by PWM, direction and enable, and the
//! emergency stop on the timers' break inputs.

use core::mem::{self, ManuallyDrop};

use embassy_stm32::Peri;
use embassy_stm32::gpio::{AfType, AnyPin, Flex, Level, Output, OutputType, Pull, Speed};
use embassy_stm32::peripherals::{TIM1, TIM8};
use embassy_stm32::time::khz;
use embassy_stm32::timer::complementary_pwm::{
    BreakInputPolarity, ComplementaryPwm, FilterValue, Ossi,
};
use embassy_stm32::timer::low_level::CountingMode;
use embassy_stm32::timer::simple_pwm::{PwmPin, PwmPinConfig};
use embassy_stm32::timer::{
    AdvancedInstance4Channel, BkIn1, BreakInputPin, Ch1, Channel, TimerPin,
};
use interstage::hal::Motors;
use interstage::sense::raw::BridgeCodes;
use interstage::units::MotorCommand;

use super::readback::Readback;
use crate::board::registers::{Ocm, TimAdv};

/// Periods of the PWM, 50 us each, that a tick gives: 2.5 ms.
const DEAD_MAN: u16 = 50;

/// One bridge in phase/enable control: PWM chops, the direction line sets the sign, the enable
/// line wakes the bridge.
///
/// The timer makes one pulse of [`DEAD_MAN`] periods and stops, its output low: each tick has to
/// begin it again. A tick that does not come loses the motor's voltage without any software.
///
/// It is never dropped: that would release the lines that hold the bridge off.
pub(crate) struct Bridge<T: AdvancedInstance4Channel> {
    pwm: ManuallyDrop<ComplementaryPwm<'static, T>>,
    /// The timer's registers: the driver's own access checks and can panic in every tick.
    registers: TimAdv,
    /// Counts of a period.
    period: u32,
    forward: ManuallyDrop<Output<'static>>,
    enable: ManuallyDrop<Output<'static>>,
}

impl<T: AdvancedInstance4Channel> Bridge<T> {
    /// A bridge that is off, with a timer and its registers.
    ///
    /// `stop` is the emergency stop: a contact to ground that opens. High, and so
    /// a broken wire too, takes the PWM away in hardware, whatever the software does.
    pub(crate) fn new<S: BreakInputPin<T, BkIn1>>(
        (timer, registers): (Peri<'static, T>, TimAdv),
        pwm: Peri<'static, impl TimerPin<T, Ch1>>,
        forward: Peri<'static, AnyPin>,
        enable: Peri<'static, AnyPin>,
        stop: Peri<'static, S>,
    ) -> Self {
        let enable = Output::new(enable, Level::Low, Speed::Low);
        let forward = Output::new(forward, Level::Low, Speed::Low);
        let pin =
            PwmPinConfig { output_type: OutputType::PushPull, speed: Speed::Low, pull: Pull::Down };
        let pin = PwmPin::new_with_config(pwm, pin);
        // The plain PWM driver has no break input; the second outputs of the complementary one
        // have no pin.
        let mut pwm = ComplementaryPwm::new(
            timer,
            Some(pin),
            None,
            None,
            None,
            None,
            None,
            None,
            None,
            khz(20),
            CountingMode::EdgeAlignedUp,
        );
        let alternate = stop.af_num();
        let mut stop = Flex::new(stop);
        stop.set_as_af_unchecked(alternate, AfType::input(Pull::Up));
        mem::forget(stop);
        pwm.set_break_polarity(BreakInputPolarity::ACTIVE_HIGH);
        pwm.set_break_filter(FilterValue::FDTS_DIV32_N8);
        pwm.set_break_input_pin_enable(true);
        // With the outputs off the timer keeps the PWM line low.
        pwm.set_off_state_selection_idle(Ossi::IDLE_LEVEL);
        pwm.set_repetition_counter(DEAD_MAN - 1);
        registers.cr1().modify(|w| w.set_opm(true));
        let period = pwm.get_max_duty();
        let mut bridge = Self {
            pwm: ManuallyDrop::new(pwm),
            registers,
            period,
            forward: ManuallyDrop::new(forward),
            enable: ManuallyDrop::new(enable),
        };
        bridge.chop(0);
        // Low at the begin of a period, where a pulse stops, and high behind the compare.
        registers.ccmr_output(0).modify(|w| w.set_ocm(0, Ocm::PWM_MODE2));
        bridge.pwm.enable(Channel::Ch1);
        bridge.pwm.set_break_enable(true);
        bridge
    }

    fn stopped(&self) -> bool {
        !self.pwm.get_master_output_enable()
    }

    /// Re-enables the outputs; without effect while a break is active. One by the chip itself
    /// (damaged flash) holds them off until its own flag is cleared as well.
    fn rearm(&mut self) {
        self.registers.sr().modify(|w| {
            w.set_bif(0, false);
            w.set_sbif(false);
        });
        self.pwm.set_master_output_enable(true);
    }

    /// Sets direction and duty, and begins a pulse of the timer.
    fn set(&mut self, command: MotorCommand) {
        if !command.enable {
            self.enable.set_low();
            self.chop(0);
            return;
        }
        let duty = command.duty.to_bits();
        // |duty| <= 2^15 and a period of 8500 counts: the product stays below 2^29.
        let counts = (u32::from(duty.unsigned_abs()) * self.period) >> 15;
        self.forward.set_level(if duty < 0 { Level::Low } else { Level::High });
        self.chop(counts);
        self.enable.set_high();
    }

    /// Begins a pulse with this duty, counts of the period, of which one stays low: the stopped
    /// counter stands there.
    fn chop(&self, counts: u32) {
        self.registers.ccr(0).write(|w| w.set_ccr((self.period - counts).max(1) as u16));
        // The update loads the duty and the repetitions; in this mode it also stops the counter.
        self.registers.egr().write(|w| w.set_ug(true));
        self.registers.cr1().modify(|w| w.set_cen(true));
    }
}

/// Both bridges: of the wheel's motor and of the pre-tightener's.
pub(crate) struct Bridges {
    pub(crate) drive: Bridge<TIM1>,
    pub(crate) preload: Bridge<TIM8>,
    pub(crate) readback: Readback,
}

impl Motors for Bridges {
    fn apply(&mut self, drive: MotorCommand, preload: MotorCommand) {
        self.drive.set(drive);
        self.preload.set(preload);
    }

    fn readback(&mut self) -> Option<BridgeCodes> {
        self.readback.take()
    }

    fn stopped(&mut self) -> bool {
        self.drive.stopped() || self.preload.stopped()
    }

    // Called only by a reset out of the fault hold: releasing the button starts nothing.
    fn rearm(&mut self) {
        self.drive.rearm();
        self.preload.rearm();
    }
}
