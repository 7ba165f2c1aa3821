//! A port of sixteen pins.
//!
//! Source: RM0440, 9.3 (functions) and 9.4 (registers).

use super::registers::Registers;
use super::{Peripheral, Why, Write};
use crate::description;
use crate::description::{GPIOA, GPIOB, GPIOC, GPIOD, GPIOE, GPIOF, GPIOG, gpioc::*};

/// The ports: those with pins of the debug probe have values of their own after reset.
const PORTS: [description::Peripheral; 7] = [GPIOA, GPIOB, GPIOC, GPIOD, GPIOE, GPIOF, GPIOG];

/// What a pin does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    Input,
    /// Output by the program.
    Output,
    /// Of the peripheral with this number of the pin's list.
    Alternate(u32),
    /// Analogue.
    Analog,
}

/// A port.
#[derive(Clone, Debug)]
pub struct Gpio {
    registers: Registers,
    /// What the world outside does: pins driven, and their levels.
    pub outside: (u32, u32),
}

impl Gpio {
    /// Port number `port` (0 is A) after reset, with what the world outside does.
    pub fn new(port: usize, outside: (u32, u32)) -> Self {
        let whole = [MODER, OTYPER, OSPEEDR, PUPDR, ODR, AFRL, AFRH];
        let registers = Registers::of(PORTS[port], &whole, &[], &[BSRR, BRR]);
        Self { registers, outside }
    }

    pub(crate) fn role(&self, pin: u32) -> Role {
        match self.registers.get(MODER) >> (2 * pin) & 3 {
            0 => Role::Input,
            1 => Role::Output,
            2 => {
                let register = self.registers.get(AFRL + pin / 8 * 4);
                Role::Alternate(register >> (pin % 8 * 4) & 0xF)
            }
            _ => Role::Analog,
        }
    }

    /// Level at a pin: what the program drives, or else the world outside, or else the
    /// pull resistor. What a peripheral puts out is not among these.
    pub fn level(&self, pin: u32) -> bool {
        if self.role(pin) == Role::Output {
            return self.registers.get(ODR) >> pin & 1 != 0;
        }
        let (driven, levels) = self.outside;
        if driven >> pin & 1 != 0 {
            return levels >> pin & 1 != 0;
        }
        self.registers.get(PUPDR) >> (2 * pin) & 3 == 1
    }

    /// Whether the program drives this pin high.
    pub(crate) fn puts_out(&self, pin: u32) -> bool {
        self.role(pin) == Role::Output && self.level(pin)
    }

    /// The world outside drives a pin, or lets go of it.
    pub fn drive(&mut self, pin: u32, level: Option<bool>) {
        let bit = 1 << pin;
        let with = |word: u32, on: bool| if on { word | bit } else { word & !bit };
        let (driven, levels) = self.outside;
        self.outside = (with(driven, level.is_some()), with(levels, level == Some(true)));
    }
}

impl Peripheral for Gpio {
    fn read(&mut self, offset: u32, _: u64) -> Option<u32> {
        match offset {
            IDR => {
                let high = |pin: &u32| self.role(*pin) != Role::Analog && self.level(*pin);
                Some((0..16).filter(high).fold(0, |word, pin| word | 1 << pin))
            }
            _ => self.registers.read(offset),
        }
    }

    fn write(&mut self, offset: u32, write: Write, _: u64) -> Result<(), Why> {
        let ones = write.ones();
        let old = self.registers.get(ODR);
        match offset {
            // Setting goes before resetting.
            BSRR => self.registers.set(ODR, old & !(ones >> 16) | ones & 0xFFFF),
            BRR => self.registers.set(ODR, old & !ones),
            _ => return self.registers.write(offset, write),
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::peripherals::tests::write;

    #[test]
    fn an_input_shows_the_world_or_else_its_pull_resistor() {
        let mut port = Gpio::new(2, (0, 0));
        write(&mut port, MODER, 0, 0);
        write(&mut port, PUPDR, 0b01 << 8, 0);
        assert_eq!(port.read(IDR, 0), Some(1 << 4));
        port.drive(4, Some(false));
        port.drive(5, Some(true));
        assert_eq!(port.read(IDR, 0), Some(1 << 5));
        port.drive(4, None);
        port.drive(5, None);
        assert_eq!(port.read(IDR, 0), Some(1 << 4));
    }
}
