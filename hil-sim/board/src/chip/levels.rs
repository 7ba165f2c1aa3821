//! Levels at the chip's pins: what the board applies to them, and what they put out.

use super::Chip;
use super::pins::{ANALOG, ANGLE, BRIDGES, Carried, Lines, Motor, Pin, SENSORS, WHEEL};
use crate::peripherals::gpio::Role;
use crate::peripherals::spi::Frame;

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

    /// Presses or releases the button of the emergency stop.
    pub fn press_stop(&mut self, pressed: bool, now: u64) {
        let level = self.defects.stop_wire.unwrap_or(pressed);
        for pin in [Pin::STOP_DRIVE, Pin::STOP_PRELOAD] {
            self.drive(pin, level, now);
        }
    }

    /// Turns the wheel encoder's lines to this position, in quarters of a line pair, at a
    /// constant rate over `cycles`.
    pub(crate) fn turn_wheel(&mut self, position: i64, cycles: u64) {
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
    pub(crate) fn set_analog(&mut self, sensors: [u16; SENSORS], bridges: [u16; 2]) {
        self.inputs[..SENSORS].copy_from_slice(&sensors);
        self.inputs[SENSORS..].copy_from_slice(&bridges);
        self.apply_analog();
    }

    fn apply_analog(&mut self) {
        for (input, (pin, converter, channel)) in ANALOG.into_iter().enumerate() {
            let wired = self.role(pin) == Role::Analog;
            let voltage = if wired { self.inputs[input] } else { 0 };
            let voltage = self.defects.stuck_codes[input].unwrap_or(voltage);
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
            let open = self.carries(wired.stop) && self.level(stop);
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
