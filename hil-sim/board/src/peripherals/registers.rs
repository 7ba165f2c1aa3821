//! Registers that only keep what is written.

use super::Write;

/// A register that keeps some of its bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Kept {
    /// Offset.
    pub offset: u32,
    /// Value after reset.
    pub reset: u32,
    /// Bits that can be written.
    pub mask: u32,
}

/// Several of them.
#[derive(Clone, Debug)]
pub struct Registers {
    kept: &'static [Kept],
    values: Vec<u32>,
    /// Place among these by word of the block, for those in its beginning.
    places: [u8; WORDS],
}

/// Words of a block whose registers are found without a search.
const WORDS: usize = 64;
/// No register at a word.
const NONE: u8 = u8::MAX;

impl Registers {
    /// After reset.
    #[must_use]
    pub fn new(kept: &'static [Kept]) -> Self {
        let mut places = [NONE; WORDS];
        for (index, register) in kept.iter().enumerate() {
            if let Some(place) = places.get_mut(register.offset as usize / 4) {
                *place = index as u8;
            }
        }
        Self { kept, values: kept.iter().map(|register| register.reset).collect(), places }
    }

    fn index(&self, offset: u32) -> Option<usize> {
        match self.places.get(offset as usize / 4) {
            Some(&place) => (place != NONE && offset.is_multiple_of(4)).then_some(place.into()),
            None => self.kept.iter().position(|register| register.offset == offset),
        }
    }

    /// What a register holds; `None` if it is not among these.
    #[must_use]
    pub fn read(&self, offset: u32) -> Option<u32> {
        self.index(offset).map(|index| self.values[index])
    }

    /// What a register holds, of which it is known that it is among these.
    #[must_use]
    pub fn get(&self, offset: u32) -> u32 {
        self.read(offset).unwrap_or_default()
    }

    /// Writes; `None` if it is not among these.
    pub fn write(&mut self, offset: u32, write: Write) -> Option<()> {
        let index = self.index(offset)?;
        let mask = write.mask & self.kept[index].mask;
        self.values[index] = Write { mask, ..write }.onto(self.values[index]);
        Some(())
    }

    /// Sets a register whatever may be written.
    pub fn set(&mut self, offset: u32, value: u32) {
        if let Some(index) = self.index(offset) {
            self.values[index] = value;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TWO: [Kept; 2] =
        [Kept { offset: 0, reset: 0xF0, mask: 0xFF }, Kept { offset: 8, reset: 1, mask: u32::MAX }];

    #[test]
    fn only_the_bits_that_can_be_written_change() {
        let mut registers = Registers::new(&TWO);
        assert_eq!(registers.write(0, Write { value: u32::MAX, mask: 0xFF0F }), Some(()));
        assert_eq!(registers.read(0), Some(0xFF));
        assert_eq!(registers.write(8, Write { value: 0x0200_0000, mask: 0xFF00_0000 }), Some(()));
        assert_eq!(registers.get(8), 0x0200_0001);
    }

    #[test]
    fn others_are_not_there() {
        let mut registers = Registers::new(&TWO);
        assert_eq!(registers.read(4), None);
        assert_eq!(registers.write(4, Write { value: 0, mask: 0 }), None);
    }
}
