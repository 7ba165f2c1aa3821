//! External interrupts: edges at the pins that the system configuration selects, and of the
//! supply's detector.

use super::registers::Registers;
use super::{Peripheral, Why, Write};
use crate::description::{EXTI, exti::*};

/// External interrupts. Nothing here drives the lines of the second bank.
#[derive(Clone, Debug)]
pub struct Exti {
    registers: Registers,
    levels: u32,
}

impl Exti {
    /// After reset, with these levels at the lines.
    pub fn new(levels: u32) -> Self {
        Self { registers: Registers::all(EXTI, &[SWIER2, PR2]), levels }
    }

    /// Takes the present levels of the lines: 0 to 15 of pins, 16 of the voltage detector.
    pub(crate) fn sample(&mut self, levels: u32) {
        let rising = levels & !self.levels & self.registers.get(RTSR1);
        let falling = !levels & self.levels & self.registers.get(FTSR1);
        self.registers.set(PR1, self.registers.get(PR1) | rising | falling);
        self.levels = levels;
    }

    /// Whether one of these lines requests an interrupt.
    pub fn requests(&self, lines: u32) -> bool {
        self.registers.get(PR1) & self.registers.get(IMR1) & lines != 0
    }
}

impl Peripheral for Exti {
    fn read(&mut self, offset: u32, _: u64) -> Option<u32> {
        self.registers.read(offset)
    }

    fn write(&mut self, offset: u32, write: Write, _: u64) -> Result<(), Why> {
        match offset {
            PR1 => self.registers.clear(PR1, write.ones()),
            SWIER1 => {
                let set = write.ones() & self.registers.get(IMR1);
                self.registers.set(PR1, self.registers.get(PR1) | set);
            }
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
    fn the_selected_edge_is_kept_until_it_is_cleared() {
        let mut exti = Exti::new(0);
        let bit = 1 << 13;
        write(&mut exti, RTSR1, bit, 0);
        exti.sample(bit);
        assert!(!exti.requests(bit), "masked");
        write(&mut exti, IMR1, bit, 0);
        assert!(exti.requests(0xFC00) && !exti.requests(0x3E0));
        write(&mut exti, PR1, bit, 0);
        exti.sample(0);
        assert!(!exti.requests(bit), "the other edge is not selected");
    }
}
