//! The chip's pins as they are wired on the board (docs/HARDWARE.md): inputs and outputs.

use interstage::sense::raw::SensorId;

use super::Chip;
use crate::peripherals::gpio::Role;
use crate::peripherals::spi::Frame;

/// A pin: port (0 is A) and number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pin(usize, u32);

impl Pin {
    /// Emergency stop of the drive's timer: high is open.
    pub const STOP_DRIVE: Self = Self(1, 12);
    /// Emergency stop of the pre-tightener's timer: high is open.
    pub const STOP_PRELOAD: Self = Self(1, 7);
    /// Button: high is pressed.
    pub const BUTTON: Self = Self(2, 13);
    pub const LIGHT: Self = Self(0, 5);
    /// Select line of the angle sensor: low selects.
    const SELECT: Self = Self(1, 10);
}

/// Pins with an external level at power-up, by port, and the levels: emergency stop closed,
/// button released.
pub(super) const OUTSIDE: [(u32, u32); 7] =
    [(0, 0), (1 << 12 | 1 << 7, 0), (1 << 13, 0), (0, 0), (0, 0), (0, 0), (0, 0)];

/// A pin with the number of its alternate function.
type Carried = (Pin, u32);

/// Lines of the wheel encoder at TIM5.
const WHEEL: [Carried; 2] = [(Pin(0, 0), 2), (Pin(0, 1), 2)];
/// Lines of the angle sensor at SPI1: clock, to the board, from the board.
const ANGLE: [Carried; 3] = [(Pin(1, 3), 5), (Pin(0, 6), 5), (Pin(0, 7), 5)];
/// Sensors at analogue inputs.
const SENSORS: usize = SensorId::ANALOG.len();
/// Analogue inputs of the sensors, then of the bridges: pin, converter (0 is ADC1) and its channel.
pub(super) const ANALOG: [(Pin, usize, usize); SENSORS + 2] =
    [(Pin(2, 2), 0, 8), (Pin(2, 3), 1, 9), (Pin(1, 0), 2, 12), (Pin(1, 1), 2, 1)];

/// Wiring of a motor's bridge.
struct Wired {
    pwm: Carried,
    forward: Pin,
    enable: Pin,
    stop: Carried,
}

/// Drive and pre-tightener.
const BRIDGES: [Wired; 2] = [
    Wired {
        pwm: (Pin(0, 8), 6),
        forward: Pin(0, 9),
        enable: Pin(0, 10),
        stop: (Pin::STOP_DRIVE, 6),
    },
    Wired {
        pwm: (Pin(2, 6), 4),
        forward: Pin(2, 8),
        enable: Pin(2, 9),
        stop: (Pin::STOP_PRELOAD, 5),
    },
];

/// Mean command of a bridge over some time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Motor {
    /// Mean signed duty, -1 to 1, over the time in which the bridge was enabled.
    pub duty: f64,
    /// Part of the time in which the bridge was enabled.
    pub enabled: f64,
}

/// A bridge's lines, integrated over time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bridge {
    /// Its lines at present.
    lines: Lines,
    since: u64,
    /// Cycles for which its timer was high up to then.
    high: u64,
    /// Integrals since `from`: signed cycles of a PWM that is high, and cycles enabled.
    driven: i64,
    enabled: u64,
    from: u64,
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Lines {
    /// The PWM line is the timer's; else it is high or low.
    timed: bool,
    high: bool,
    forward: bool,
    on: bool,
}

impl Bridge {
    /// Books up to `now`, when the timer was high for so many cycles since its start; the lines
    /// are others from then on.
    fn set(&mut self, lines: Lines, high: u64, now: u64) {
        let cycles = now.saturating_sub(self.since);
        if self.lines.on {
            let constant = if self.lines.high { cycles } else { 0 };
            let driven = if self.lines.timed { high.wrapping_sub(self.high) } else { constant };
            self.driven += if self.lines.forward { driven as i64 } else { -(driven as i64) };
            self.enabled += cycles;
        }
        (self.lines, self.high, self.since) = (lines, high, now);
    }

    /// Books up to a reset, which starts its timer over.
    pub(super) fn reset(&mut self, high: u64, now: u64) {
        self.set(self.lines, high, now);
        self.high = 0;
    }

    fn take(&mut self, high: u64, now: u64) -> Motor {
        self.set(self.lines, high, now);
        let cycles = now.saturating_sub(self.from).max(1);
        let motor = Motor {
            duty: if self.enabled == 0 { 0.0 } else { self.driven as f64 / self.enabled as f64 },
            enabled: self.enabled as f64 / cycles as f64,
        };
        (self.driven, self.enabled, self.from) = (0, 0, now);
        motor
    }
}

/// Levels of the wheel encoder's lines at a position in quarters of a line pair.
const fn lines_at(position: i64) -> [bool; 2] {
    let phase = position.rem_euclid(4);
    [matches!(phase, 1 | 2), matches!(phase, 2 | 3)]
}

impl Chip {
    fn role(&self, pin: Pin) -> Role {
        self.ports[pin.0].role(pin.1)
    }

    /// Whether a peripheral has this pin.
    fn carries(&self, (pin, function): Carried) -> bool {
        self.role(pin) == Role::Alternate(function)
    }

    pub fn level(&self, pin: Pin) -> bool {
        self.ports[pin.0].level(pin.1)
    }

    /// Applies an external level to a pin.
    pub fn drive(&mut self, pin: Pin, level: bool, now: u64) {
        self.ports[pin.0].drive(pin.1, Some(level));
        self.settle(now);
    }

    /// Turns the wheel encoder's lines to this position, in quarters of a line pair, at a
    /// constant rate over `cycles`.
    pub fn turn_wheel(&mut self, position: i64, cycles: u64) {
        let edges = self.wheel.abs_diff(position);
        for _ in 0..edges {
            self.wheel += (position - self.wheel).signum();
            self.encoder.set_lines(self.wheel_lines(), cycles / edges);
        }
        // An open line has its pull-up.
        let [a, b] = self.outside_lines();
        for ((pin, _), level) in WHEEL.into_iter().zip([a, b]) {
            self.ports[pin.0].drive(pin.1, level);
        }
    }

    /// Passes the present levels of the lines to the encoder's counter.
    pub(super) fn look_at_wheel(&mut self) {
        self.encoder.set_lines(self.wheel_lines(), u64::MAX);
    }

    /// Levels at the inputs of the encoder's counter; low until its pins are configured.
    fn wheel_lines(&self) -> [bool; 2] {
        let wired = WHEEL.into_iter().all(|line| self.carries(line));
        self.outside_lines().map(|level| wired && level.unwrap_or(true))
    }

    /// Levels that the encoder gives its lines at the board; none of one that is broken.
    fn outside_lines(&self) -> [Option<bool>; 2] {
        let [a, b] = lines_at(self.wheel);
        let lines = if self.defects.encoder_swapped { [b, a] } else { [a, b] };
        let broken = self.defects.encoder_lines;
        [0, 1].map(|line| (!broken[line]).then_some(lines[line]))
    }

    /// Voltages at the analogue inputs of the sensors and of the bridges of drive and pre-tightener,
    /// in parts of 2^16 of the reference.
    pub fn set_analog(&mut self, sensors: [u16; SENSORS], bridges: [u16; 2]) {
        self.inputs[..SENSORS].copy_from_slice(&sensors);
        self.inputs[SENSORS..].copy_from_slice(&bridges);
        self.apply_analog();
    }

    fn apply_analog(&mut self) {
        for (input, (pin, converter, channel)) in ANALOG.into_iter().enumerate() {
            let wired = self.role(pin) == Role::Analog;
            let voltage = if wired { self.inputs[input] } else { 0 };
            let voltage = self.defects.stuck_codes[input].unwrap_or(voltage);
            // What all conversions of a mean read as the same is a step of theirs.
            let voltage = if self.defects.quiet_inputs { voltage & !0xF } else { voltage };
            self.adcs[converter / 2].set_input(converter % 2, channel, voltage);
        }
    }

    /// Mean commands of drive and pre-tightener since the last call.
    pub fn take_motors(&mut self, now: u64) -> [Motor; 2] {
        [0, 1].map(|index| self.bridges[index].take(self.motors[index].high(now), now))
    }

    /// A frame on the angle sensor's bus.
    pub(super) fn exchange(&mut self, frame: Frame) -> u16 {
        let wired = ANGLE.into_iter().all(|line| self.carries(line));
        let low = self.role(Pin::SELECT) == Role::Output && !self.level(Pin::SELECT);
        let selected = wired && low && !self.deselected;
        self.deselected = !low;
        self.angle.exchange(frame, selected)
    }

    /// Updates pins and bridges after a change of registers.
    pub(super) fn settle_pins(&mut self, now: u64) {
        if self.level(Pin::SELECT) {
            self.deselected = true;
        } else if !self.spi.is_busy() {
            self.deselected = false;
        }
        self.apply_analog();
        let levels = (0..16).filter(|line| {
            let port = self.syscfg.port(*line) as usize;
            self.ports.get(port).is_some_and(|port| port.level(*line))
        });
        let supply = u32::from(self.power.signals_low()) << super::SUPPLY_LINE;
        self.exti.sample(levels.fold(supply, |word, line| word | 1 << line));
        let broken = self.system_breaks();
        for (index, wired) in BRIDGES.iter().enumerate() {
            self.motors[index].set_system_break(broken, now);
            let (stop, _) = wired.stop;
            let open = self.carries(wired.stop) && self.level(stop) && !self.defects.stop_shorted;
            self.motors[index].set_break(open, now);
            let floats = index == 0 && self.defects.drive_bridge_floats;
            let out = |pin: Pin| self.ports[pin.0].puts_out(pin.1);
            let lines = Lines {
                timed: self.carries(wired.pwm),
                high: floats && self.role(wired.pwm.0) != Role::Output,
                forward: out(wired.forward),
                on: out(wired.enable) || floats && self.role(wired.enable) != Role::Output,
            };
            self.bridges[index].set(lines, self.motors[index].high(now), now);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::{Access, Bus};

    const COUNT: u32 = 0x4000_0C24;

    fn at(address: u32) -> Access {
        Access { address, size: 4, pc: 0, now: 0 }
    }

    fn write(chip: &mut Chip, writes: &[(u32, u32)]) {
        for (address, value) in writes {
            chip.write(at(*address), *value);
        }
    }

    #[test]
    fn counting_begins_with_the_configuration_of_the_pins_and_loses_nothing() {
        for early in -6..=6 {
            let mut chip = Chip::new(0);
            chip.turn_wheel(early, 1_000_000);
            // Clocks of the port and of the timer; pins to the timer, which counts then.
            write(&mut chip, &[(0x4002_104C, 1), (0x4002_1058, 1 << 3)]);
            write(&mut chip, &[(0x4800_0020, 0x22), (0x4800_0000, 0xABFF_FFFA)]);
            write(&mut chip, &[(0x4000_0C2C, 0xFFFF), (0x4000_0C18, 0xF1F1)]);
            write(&mut chip, &[(0x4000_0C08, 3), (0x4000_0C00, 1)]);
            for turned in [1, 2, 3, 4, 5, 4, 3, 2, 1, 0, -1, -2, -3, -4, -5] {
                chip.turn_wheel(early + turned, 1_000_000);
                assert_eq!(chip.read(at(COUNT)) as u16 as i16, turned as i16, "{early} {turned}");
            }
        }
    }
}
