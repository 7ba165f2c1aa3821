//! Registers that keep what is written to them.

use super::{Why, Write};
use crate::description::{Field, Peripheral};

/// The value and the writable bits of each register, by word of the block.
#[derive(Clone, Debug, Default)]
pub struct Registers(Vec<Option<(u32, u32)>>);

impl Registers {
    /// After reset, as described: the registers of a peripheral at the offsets `whole`, those of
    /// `parts`, of which the model has the bits given, and those at `fixed`, of which it has none.
    /// A change of other bits is refused.
    pub fn of(peripheral: Peripheral, whole: &[u32], parts: &[(u32, u32)], fixed: &[u32]) -> Self {
        let (whole, fixed) =
            (whole.iter().map(|at| (*at, u32::MAX)), fixed.iter().map(|at| (*at, 0)));
        let mut registers = Self::default();
        for (offset, bits) in whole.chain(parts.iter().copied()).chain(fixed) {
            for register in peripheral.registers.iter().filter(|known| known.offset == offset) {
                // Two layouts share their bits.
                let (reset, mask) = registers.word(offset).unwrap_or((register.reset, 0));
                registers.add(offset, reset, mask | register.writable & bits);
            }
        }
        registers
    }

    /// The same of all registers, whole but for the `fixed` ones.
    pub fn all(peripheral: Peripheral, fixed: &[u32]) -> Self {
        let whole = peripheral.registers.iter().map(|register| register.offset);
        let whole: Vec<u32> = whole.filter(|offset| !fixed.contains(offset)).collect();
        Self::of(peripheral, &whole, &[], fixed)
    }

    /// Adds a register of this value, of which a program can change the bits of a mask.
    pub fn add(&mut self, offset: u32, value: u32, mask: u32) {
        let word = offset as usize / 4;
        self.0.resize(self.0.len().max(word + 1), None);
        self.0[word] = Some((value, mask));
    }

    fn word(&self, offset: u32) -> Option<(u32, u32)> {
        self.0.get(offset as usize / 4).copied().flatten()
    }

    /// Value of a register; `None` if no model has it.
    pub fn read(&self, offset: u32) -> Option<u32> {
        self.word(offset).map(|(value, _)| value)
    }

    /// Value of a register; 0 if no model has it.
    pub fn get(&self, offset: u32) -> u32 {
        self.read(offset).unwrap_or_default()
    }

    /// Value of a field.
    pub fn field(&self, field: Field) -> u32 {
        field.of(self.get(field.register))
    }

    /// Whether a field is other than 0.
    pub fn has(&self, field: Field) -> bool {
        field.is_in(self.get(field.register))
    }

    /// Writes a register, unless no model has it, or other bits than it keeps would change.
    pub fn write(&mut self, offset: u32, write: Write) -> Result<(), Why> {
        let (value, mask) = self.word(offset).ok_or(Why::NoModel)?;
        let next = write.onto(value);
        if (next ^ value) & !mask != 0 {
            return Err(Why::NoModel);
        }
        self.set(offset, next);
        Ok(())
    }

    /// Sets every bit of a register.
    pub fn set(&mut self, offset: u32, new: u32) {
        if let Some(Some((value, _))) = self.0.get_mut(offset as usize / 4) {
            *value = new;
        }
    }

    /// Sets a field.
    pub fn put(&mut self, field: Field, value: u32) {
        self.set(field.register, self.get(field.register) & !field.mask | field.at(value));
    }

    /// Clears bits of a register.
    pub fn clear(&mut self, offset: u32, bits: u32) {
        self.set(offset, self.get(offset) & !bits);
    }
}

impl super::Peripheral for Registers {
    fn read(&mut self, offset: u32, _: u64) -> Option<u32> {
        Self::read(self, offset)
    }

    fn write(&mut self, offset: u32, write: Write, _: u64) -> Result<(), Why> {
        Self::write(self, offset, write)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description::{TIM1, bits, tim1::*};

    #[test]
    fn a_write_of_bits_that_are_not_kept_is_refused_and_other_registers_are_absent() {
        let plain = bits(&[cr1::CEN, cr1::ARPE]);
        let mut registers = Registers::of(TIM1, &[CCMR1_OUTPUT], &[(CR1, plain)], &[CR2]);
        for (offset, value, mask, expected) in [
            (CR1, u32::MAX, 0xFF7F, None),
            (CR1, 0x81, 0xF1, Some(0x81)),
            (CCMR1_OUTPUT, 0x0101_FFFF, 0xFF00_00FF, Some(0x0100_00FF)),
            (CR2, 0, u32::MAX, Some(0)),
            (CR2, 1, u32::MAX, None),
            (SMCR, u32::MAX, u32::MAX, None),
            (0x400, u32::MAX, u32::MAX, None),
        ] {
            let taken = registers.write(offset, Write { value, mask });
            assert_eq!(taken.ok(), expected.map(|_| ()), "{offset:#x}");
            let value = registers.read(offset);
            assert!(expected.is_none() || value == expected, "{offset:#x}: {value:?}");
        }
    }
}
