//! Registers that keep what is written to them.

use super::{Peripheral, Write};

/// A register that keeps some of its bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Kept {
    /// Offset in its block, bytes.
    pub offset: u32,
    /// Value after reset.
    pub reset: u32,
    /// Bits that a program can change.
    pub mask: u32,
}

/// The value and the writable bits of each register, by word of the block.
#[derive(Clone, Debug)]
pub struct Registers(Vec<Option<(u32, u32)>>);

impl Registers {
    /// After reset: these registers, those at the offsets `words`, which keep all 32 bits and
    /// are zero after reset, and those at `zeros`, which read as zero and keep nothing.
    pub fn new(kept: &[Kept], words: &[u32], zeros: &[u32]) -> Self {
        let plain = |mask| move |offset: &u32| Kept { offset: *offset, reset: 0, mask };
        let plain = words.iter().map(plain(u32::MAX)).chain(zeros.iter().map(plain(0)));
        let mut registers = Vec::new();
        for Kept { offset, reset, mask } in kept.iter().copied().chain(plain) {
            let word = offset as usize / 4;
            registers.resize(registers.len().max(word + 1), None);
            registers[word] = Some((reset, mask));
        }
        Self(registers)
    }

    /// Value of a register; `None` if no model has it.
    pub fn read(&self, offset: u32) -> Option<u32> {
        self.0.get(offset as usize / 4).copied().flatten().map(|(value, _)| value)
    }

    /// Value of a register; 0 if no model has it.
    pub fn get(&self, offset: u32) -> u32 {
        self.read(offset).unwrap_or_default()
    }

    /// Writes a register; `None` if no model has it, or if other bits than it keeps would change.
    pub fn write(&mut self, offset: u32, write: Write) -> Option<()> {
        let (value, mask) = self.0.get_mut(offset as usize / 4)?.as_mut()?;
        let next = write.onto(*value);
        if (next ^ *value) & !*mask != 0 {
            return None;
        }
        *value = next;
        Some(())
    }

    /// Sets every bit of a register.
    pub fn set(&mut self, offset: u32, new: u32) {
        if let Some(Some((value, _))) = self.0.get_mut(offset as usize / 4) {
            *value = new;
        }
    }
}

impl Peripheral for Registers {
    fn read(&mut self, offset: u32, _: u64) -> Option<u32> {
        Self::read(self, offset)
    }

    fn write(&mut self, offset: u32, write: Write, _: u64) -> Option<()> {
        Self::write(self, offset, write)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_write_of_bits_that_are_not_kept_is_refused_and_other_registers_are_absent() {
        let kept = [Kept { offset: 0, reset: 0xF0, mask: 0xFF }];
        let mut registers = Registers::new(&kept, &[8], &[12]);
        for (offset, value, mask, expected) in [
            (0, u32::MAX, 0xFF0F, None),
            (0, 0x0F, 0xF, Some(0xFF)),
            (8, 0x0200_0001, 0xFF00_0000, Some(0x0200_0000)),
            (12, 0, u32::MAX, Some(0)),
            (12, 1, u32::MAX, None),
            (4, u32::MAX, u32::MAX, None),
            (16, u32::MAX, u32::MAX, None),
        ] {
            let taken = registers.write(offset, Write { value, mask });
            assert_eq!(taken, expected.map(|_| ()), "{offset:#x}");
            let value = registers.read(offset);
            assert!(expected.is_none() || value == expected, "{offset:#x}: {value:?}");
        }
    }
}
