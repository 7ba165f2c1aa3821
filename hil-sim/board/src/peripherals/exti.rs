//! External interrupts: edges at the pins that the system configuration selects, and of the
//! supply's detector.

use super::registers::{Kept, Registers};
use super::{Peripheral, Write};

const IMR: u32 = 0x00;
const RTSR: u32 = 0x08;
const FTSR: u32 = 0x0C;
const SWIER: u32 = 0x10;
const PR: u32 = 0x14;

const ALL: u32 = u32::MAX;

/// Masks of both banks: lines without an edge, of other peripherals, are not masked after reset.
/// Nothing here drives the lines of the second bank.
const REGISTERS: [Kept; 2] = [
    Kept { offset: IMR, reset: 0x1F84_0000, mask: ALL },
    Kept { offset: 0x20, reset: 0xC3C, mask: ALL },
];

/// External interrupts.
#[derive(Clone, Debug)]
pub struct Exti {
    registers: Registers,
    pending: u32,
    levels: u32,
}

impl Exti {
    /// After reset, with these levels at the lines.
    pub fn new(levels: u32) -> Self {
        Self {
            registers: Registers::new(
                &REGISTERS,
                &[0x04, RTSR, FTSR, 0x24, 0x28, 0x2C],
                &[0x30, 0x34],
            ),
            pending: 0,
            levels,
        }
    }

    /// Takes the present levels of the lines: 0 to 15 of pins, 16 of the voltage detector.
    pub fn sample(&mut self, levels: u32) {
        let rising = levels & !self.levels & self.registers.get(RTSR);
        let falling = !levels & self.levels & self.registers.get(FTSR);
        self.pending |= rising | falling;
        self.levels = levels;
    }

    /// Whether one of these lines requests an interrupt.
    pub fn requests(&self, lines: u32) -> bool {
        self.pending & self.registers.get(IMR) & lines != 0
    }
}

impl Peripheral for Exti {
    fn read(&mut self, offset: u32, _: u64) -> Option<u32> {
        match offset {
            PR => Some(self.pending),
            SWIER => Some(0),
            _ => self.registers.read(offset),
        }
    }

    fn write(&mut self, offset: u32, write: Write, _: u64) -> Option<()> {
        match offset {
            PR => self.pending &= !write.ones(),
            SWIER => self.pending |= write.ones() & self.registers.get(IMR),
            _ => return self.registers.write(offset, write),
        }
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_selected_edge_is_kept_until_it_is_cleared() {
        let mut exti = Exti::new(0);
        let bit = 1 << 13;
        let all = |value| Write { value, mask: ALL };
        exti.write(RTSR, all(bit), 0).expect("modelled");
        exti.sample(bit);
        assert!(!exti.requests(bit), "masked");
        exti.write(IMR, all(bit), 0).expect("modelled");
        assert!(exti.requests(0xFC00) && !exti.requests(0x3E0));
        exti.write(PR, all(bit), 0).expect("modelled");
        exti.sample(0);
        assert!(!exti.requests(bit), "the other edge is not selected");
    }
}
