//! The chip around the core: every peripheral at its address, and the connections between
//! them: clocks, interrupt lines, DMA requests, pins.

mod bus;
mod levels;
pub mod map;
mod pins;
mod stray;

use super::description::{DBGMCU, dbgmcu::*};
use super::peripherals::Peripheral;
use super::peripherals::adc::{self, Adc};
use super::peripherals::dma::{self, CHANNELS, Dma, Move};
use super::peripherals::encoder::Encoder;
use super::peripherals::exti::Exti;
use super::peripherals::flash::{Change, Flash};
use super::peripherals::gpio::Gpio;
use super::peripherals::iwdg::Iwdg;
use super::peripherals::pwm::Pwm;
use super::peripherals::pwr::{Pwr, Then};
use super::peripherals::rcc::{Cause, Rcc};
use super::peripherals::registers::Registers;
use super::peripherals::spi::{AngleSensor, Spi};
use super::peripherals::syscfg::Syscfg;
use super::peripherals::system::{Counter, System};
use super::peripherals::time_base::TimeBase;

pub use pins::{Bridge, Motor, Pin};
pub use stray::{Stray, Strays};

/// External interrupt line of the voltage detector.
const SUPPLY_LINE: u32 = 16;

/// `DBGMCU_IDCODE`: category 3, revision X.
const DEBUG_IDENTITY: u32 = 0x2003_6469;

/// Requests of the multiplexer: ADC1 to ADC4.
const REQUESTS: [u32; 4] = [5, 36, 37, 38];

/// Faults of the hardware that a test or a campaign can switch on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Defects {
    /// Lines of the wheel encoder that are broken: the pull-up holds them high.
    pub encoder_lines: [bool; 2],
    /// They are exchanged.
    pub encoder_swapped: bool,
    /// PWM and enable of the drive's bridge have no pull-down: high while nothing drives them.
    pub drive_bridge_floats: bool,
    /// Codes, in parts of 2^16, that the inputs of sensors and bridges read instead of their
    /// voltages.
    pub stuck_codes: [Option<u16>; pins::ANALOG.len()],
    /// The noise at the analogue inputs is below half a step of 12 bits, and they have these
    /// errors.
    pub input_errors: Option<InputErrors>,
    /// The core has its full clock, which the system timer counts, without a program that sets it up.
    pub full_clock: bool,
    pub dma_stalled: bool,
    /// Writes that clear the flags of the time driver's timer have no effect.
    pub timer_flags_stick: bool,
    /// The line of the external interrupts 10 to 15, the button's, stays active.
    pub button_storm: bool,
    /// Level of the emergency stop's line with its wire torn or shorted to ground, whatever its
    /// button does.
    pub stop_wire: Option<bool>,
}

/// Errors at every analogue input, parts of 2^16 of the reference.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct InputErrors {
    /// Always.
    pub offset: i32,
    /// While a bridge's PWM is high: its current in ground and supply.
    pub common_mode: i32,
    /// Just after a rising edge of a bridge's PWM; negative just after a falling one.
    pub crosstalk: i32,
}

impl InputErrors {
    /// Cycles for which an edge shows at an input, 0.3 us: an estimate, the recovery of an
    /// amplifier of some MHz.
    const RINGS: u64 = 51;

    /// Large ones of this sign: ten steps of 12 bits (DS12288, ADC accuracy, has less in all), six
    /// for 0.5 A over 10 mOhm of shared ground, and forty, 33 mV, for 5 pF of 500 at an edge. The
    /// last two are estimates.
    pub fn large(sign: i32) -> Self {
        let [offset, common_mode, crosstalk] = [10, 6, 40].map(|steps| steps * 16 * sign);
        Self { offset, common_mode, crosstalk }
    }

    /// Their sum, by the bridges' levels and the cycles since their edges.
    fn sum(self, bridges: [(bool, u64); 2]) -> i32 {
        let of_one = |(high, since): (bool, u64)| {
            let edge = if since < Self::RINGS { self.crosstalk } else { 0 };
            if high { self.common_mode + edge } else { -edge }
        };
        bridges.into_iter().map(of_one).sum::<i32>() + self.offset
    }
}

pub struct Chip {
    /// The core's own registers.
    pub system: System,
    counter: Counter,
    /// Reset and clock control.
    pub rcc: Rcc,
    /// Power control, with the supply.
    pub power: Pwr,
    pub flash: Flash,
    syscfg: Syscfg,
    exti: Exti,
    ports: [Gpio; 7],
    time: TimeBase,
    /// TIM7.
    basic: TimeBase,
    encoder: Encoder,
    /// The timers of drive and pre-tightener.
    motors: [Pwm; 2],
    /// ADC1 and ADC2, ADC3 and ADC4; ADC3 reads the bridges.
    adcs: [Adc; 2],
    dma: Dma,
    mux: Registers,
    /// The angle sensor's bus.
    pub spi: Spi,
    pub watchdog: Iwdg,
    /// Debug support: its freeze bits act while a debugger halts the core.
    debug: Registers,
    pub angle: AngleSensor,
    /// The select line was high during the current frame.
    deselected: bool,
    /// The wheel encoder's position, in quarters of a line pair.
    wheel: i64,
    inputs: [u16; pins::ANALOG.len()],
    bridges: [Bridge; 2],
    pub defects: Defects,
    locked_up: bool,
    /// Accesses that no model answered.
    pub strays: Strays,
    /// A reset that is due.
    pub(crate) reset: Option<Cause>,
    deadline: u64,
}

impl Chip {
    /// The chip as power comes up, with the vectors at `vectors`: emergency stop closed,
    /// button released.
    pub fn new(vectors: u32) -> Self {
        let ports = std::array::from_fn(|port| Gpio::new(port, pins::OUTSIDE[port]));
        let mut debug = Registers::all(DBGMCU, &[]);
        debug.set(IDCODE, DEBUG_IDENTITY);
        let mut chip = Self {
            system: System::new(vectors),
            counter: Counter::default(),
            rcc: Rcc::new(Cause::Power, 0),
            power: Pwr::default(),
            flash: Flash::default(),
            syscfg: Syscfg::default(),
            exti: Exti::new(0),
            ports,
            time: TimeBase::default(),
            basic: TimeBase::basic(),
            encoder: Encoder::new([false; 2]),
            motors: [Pwm::new(false), Pwm::new(false)],
            adcs: Default::default(),
            dma: Dma::default(),
            mux: dma::multiplexer(),
            spi: Spi::default(),
            watchdog: Iwdg::default(),
            debug,
            angle: AngleSensor::default(),
            deselected: false,
            wheel: 0,
            inputs: [0; pins::ANALOG.len()],
            bridges: [Bridge::default(); 2],
            defects: Defects::default(),
            locked_up: false,
            strays: Strays::default(),
            reset: None,
            deadline: 0,
        };
        chip.settle(0);
        chip
    }

    /// Resets every register; everything outside the chip stays. Returns the change of an
    /// interrupted flash operation.
    pub fn reset(&mut self, cause: Cause, vectors: u32, now: u64) -> Option<Change> {
        let torn = self.flash.reset();
        for (bridge, motor) in self.bridges.iter_mut().zip(&self.motors) {
            bridge.reset(motor.high(now), now);
        }
        let old = std::mem::replace(self, Self::new(vectors));
        // A loss of power clears the flags of earlier resets.
        let earlier = if cause == Cause::Power { 0 } else { old.rcc.flags() };
        self.rcc = Rcc::new(cause, earlier);
        self.ports = std::array::from_fn(|port| Gpio::new(port, old.ports[port].outside));
        self.angle = old.angle;
        match cause {
            Cause::Power => self.angle.power_up(),
            _ if old.spi.is_busy() => self.angle.cut_off(),
            _ => {}
        }
        self.wheel = old.wheel;
        self.bridges = old.bridges;
        self.defects = old.defects;
        self.strays = old.strays;
        self.inputs = old.inputs;
        self.flash = old.flash;
        self.watchdog = old.watchdog.after_reset();
        self.power = old.power.after_reset(now);
        self.settle(now);
        torn
    }

    /// The supply is below the detector's threshold until this cycle.
    pub fn supply_falls(&mut self, until: u64, then: Then, now: u64) {
        self.power.fall(until, then);
        self.settle(now);
    }

    /// Does what is due at `now`.
    pub fn advance(&mut self, now: u64) {
        self.system.advance(now);
        self.time.advance(now);
        self.basic.advance(now);
        let motors = &self.motors;
        let errors = self
            .defects
            .input_errors
            .map(|errors| move |at| errors.sum([motors[0].level(at), motors[1].level(at)]));
        let errors = errors.as_ref().map(|errors| errors as adc::Errors<'_>);
        self.adcs.iter_mut().for_each(|pair| pair.advance_with(now, errors));
        if let Some(frame) = self.spi.over(now) {
            let answer = self.exchange(frame);
            self.spi.answer(answer, now);
        }
        self.flash.advance(now);
        let low = self.power.signals_low();
        self.power.advance(now);
        let watchdog = self.watchdog.has_expired(now).then_some(Cause::Watchdog);
        let power = self.power.is_gone(now).then_some(Cause::Power);
        self.reset = power.or(watchdog).or(self.flash.ends_by()).or(self.reset);
        let mut changed = self.power.signals_low() != low;
        for motor in &mut self.motors {
            if motor.deadline() <= now {
                motor.advance(now);
                changed = true;
            }
        }
        if changed {
            self.settle_pins(now);
        }
        self.settle_lines();
    }

    pub(crate) fn lock_up(&mut self, now: u64) {
        self.locked_up = true;
        self.settle_pins(now);
        self.advance(now);
        self.settle(now);
    }

    /// A debugger halts the core for so many cycles from `now` on: what the freeze bits name
    /// stands still with it. Source: RM0440, `DBGMCU_APB1FZR1` and `DBGMCU_APB2FZR`.
    pub(crate) fn halt(&mut self, cycles: u64, now: u64) {
        self.system.tick.freeze(cycles);
        self.counter.freeze(cycles);
        if self.debug.has(apb1l_fz::DBG_TIMER2_STOP) {
            self.time.freeze(cycles, now);
        }
        if self.debug.has(apb1l_fz::DBG_TIM7_STOP) {
            self.basic.freeze(cycles, now);
        }
        if self.debug.has(apb1l_fz::DBG_IWDG_STOP) {
            self.watchdog.freeze(cycles);
        }
        let stops = [apb2_fz::DBG_TIM1_STOP, apb2_fz::DBG_TIM8_STOP];
        for (motor, stop) in self.motors.iter_mut().zip(stops) {
            if self.debug.has(stop) {
                motor.freeze(true, cycles, now);
            }
        }
        self.settle(now);
    }

    pub(crate) fn resume(&mut self, now: u64) {
        for motor in &mut self.motors {
            motor.freeze(false, 0, now);
        }
        self.settle(now);
    }

    /// Whether the chip itself breaks the motors' timers. Source: RM0440, `SYSCFG_CFGR2`.
    pub(super) fn system_breaks(&self) -> bool {
        self.locked_up && self.syscfg.lockup_breaks()
            || self.flash.has_two_wrong_bits() && self.syscfg.flash_breaks()
    }

    /// The transfer that DMA makes next.
    pub(crate) fn next_move(&self) -> Option<Move> {
        if self.defects.dma_stalled {
            return None;
        }
        let requested = [0, 1, 2, 3].map(|at: usize| self.adcs[at / 2].wants_dma(at % 2));
        if requested == [false; REQUESTS.len()] {
            return None;
        }
        (0..CHANNELS).find_map(|channel| {
            let request = dma::request(&self.mux, channel);
            let source = REQUESTS.iter().position(|known| *known == request)?;
            if requested[source] { self.dma.due(channel) } else { None }
        })
    }

    /// A transfer is done, or `found` no memory or register at its address.
    pub fn moved(&mut self, channel: usize, found: bool) {
        self.dma.moved(channel, found);
        self.settle_lines();
    }

    /// Updates pins, lines and deadlines after a change.
    pub(crate) fn settle(&mut self, now: u64) {
        self.settle_pins(now);
        self.settle_lines();
    }

    /// Updates interrupt lines and the next deadline.
    fn settle_lines(&mut self) {
        if self.system.control.wants_reset {
            self.reset = Some(Cause::Software);
        }
        let lines = [
            (1, self.exti.requests(1 << SUPPLY_LINE)),
            (4, self.flash.requests()),
            (23, self.exti.requests(0x03E0)),
            (28, self.time.requests()),
            (55, self.basic.requests()),
            (40, self.exti.requests(0xFC00) || self.defects.button_storm),
        ];
        let exceptions = &mut self.system.exceptions;
        for (interrupt, high) in lines {
            exceptions.set_line(interrupt, high);
        }
        for line in 0..5 {
            exceptions.set_line(6 + line, self.exti.requests(1 << line));
        }
        for channel in 0..CHANNELS as u8 {
            // Channel 8 has an interrupt number of its own.
            let interrupt = if channel == 7 { 96 } else { 11 + channel };
            exceptions.set_line(interrupt, self.dma.requests(channel.into()));
        }
        let due = [
            self.system.deadline(),
            self.time.deadline(),
            self.basic.deadline(),
            self.motors[0].deadline(),
            self.motors[1].deadline(),
            self.adcs[0].deadline(),
            self.adcs[1].deadline(),
            self.spi.deadline(),
            self.watchdog.deadline(),
            self.flash.deadline(),
            self.power.deadline(),
        ];
        self.deadline = due.into_iter().min().unwrap_or(u64::MAX);
        if self.reset.is_some() || self.next_move().is_some() {
            self.deadline = 0;
        }
    }
}
