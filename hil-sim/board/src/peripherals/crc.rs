//! The CRC unit: words, halves and bytes into a checksum of 32 bits.

use super::registers::{Kept, Registers};
use super::{Peripheral, Write};

/// `DR`.
const DR: u32 = 0x00;
/// `CR`.
const CR: u32 = 0x08;
/// `INIT`.
const INIT: u32 = 0x10;
/// `POL`.
const POL: u32 = 0x14;

/// Bits of `CR`: reset, size of the polynomial, bit order of input and output.
const RESET: u32 = 1;
const SIZE: u32 = 3 << 3;
const REVERSE_IN: u32 = 3 << 5;
const REVERSE_OUT: u32 = 1 << 7;

const REGISTERS: [Kept; 3] = [
    // Polynomials of other sizes than 32 bits are not modelled.
    Kept { offset: CR, reset: 0, mask: REVERSE_IN | REVERSE_OUT },
    Kept { offset: INIT, reset: u32::MAX, mask: u32::MAX },
    Kept { offset: POL, reset: 0x04C1_1DB7, mask: u32::MAX },
];

#[derive(Clone, Debug)]
pub struct CrcUnit {
    registers: Registers,
    sum: u32,
}

impl Default for CrcUnit {
    fn default() -> Self {
        Self { registers: Registers::new(&REGISTERS, &[0x04], &[]), sum: u32::MAX }
    }
}

impl CrcUnit {
    /// Feeds the lowest `bits` of a word, the highest of them first.
    fn feed(&mut self, word: u32, bits: u32) {
        let word = match self.registers.get(CR) & REVERSE_IN {
            0 => word,
            0x20 => word.swap_bytes().reverse_bits(),
            0x40 => word.rotate_left(16).reverse_bits(),
            _ => word.reverse_bits() >> (32 - bits),
        };
        let polynomial = self.registers.get(POL);
        self.sum ^= word << (32 - bits);
        for _ in 0..bits {
            let out = self.sum >> 31;
            self.sum = (self.sum << 1) ^ (out * polynomial);
        }
    }
}

impl Peripheral for CrcUnit {
    fn read(&mut self, offset: u32, _: u64) -> Option<u32> {
        match offset {
            DR if self.registers.get(CR) & REVERSE_OUT != 0 => Some(self.sum.reverse_bits()),
            DR => Some(self.sum),
            _ => self.registers.read(offset),
        }
    }

    fn write(&mut self, offset: u32, write: Write, _: u64) -> Option<()> {
        match offset {
            // An access feeds its own width, in the lowest bytes.
            DR => {
                self.feed(write.ones(), write.mask.count_ones());
                Some(())
            }
            CR if write.ones() & SIZE != 0 => None,
            CR => {
                // The reset clears itself.
                self.registers.write(CR, Write { value: write.value & !RESET, ..write })?;
                if write.ones() & RESET != 0 {
                    self.sum = self.registers.get(INIT);
                }
                Some(())
            }
            _ => {
                self.registers.write(offset, write)?;
                if offset == INIT {
                    self.sum = self.registers.get(INIT);
                }
                Some(())
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use interstage::log::crc32;
    use proptest::prelude::*;

    fn write(unit: &mut CrcUnit, offset: u32, value: u32) {
        unit.write(offset, Write { value, mask: u32::MAX }, 0).expect("a register");
    }

    proptest! {
        #[test]
        fn set_up_as_the_board_does_it_gives_the_check_of_the_frames(
            words in prop::collection::vec(any::<u32>(), 0..130),
        ) {
            let mut unit = CrcUnit::default();
            write(&mut unit, CR, REVERSE_IN | REVERSE_OUT);
            for _ in 0..2 {
                write(&mut unit, CR, REVERSE_IN | REVERSE_OUT | RESET);
                for word in &words {
                    write(&mut unit, DR, *word);
                }
                let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
                prop_assert_eq!(unit.read(DR, 0).map(|sum| !sum), Some(crc32(&bytes)));
            }
        }
    }

    /// The reference manual's example of reversal.
    #[test]
    fn what_goes_in_is_reversed_by_bytes_halves_or_as_a_word() {
        for (mode, reversed) in
            [(0, 0x1A2B_3C4D), (1, 0x58D4_3CB2), (2, 0xD458_B23C), (3, 0xB23C_D458_u32)]
        {
            let (mut one, mut other) = (CrcUnit::default(), CrcUnit::default());
            write(&mut one, CR, mode << 5);
            write(&mut one, DR, 0x1A2B_3C4D);
            write(&mut other, DR, reversed);
            assert_eq!(one.read(DR, 0), other.read(DR, 0), "{mode}");
        }
    }

    #[test]
    fn the_polynomial_s_own_size_alone_is_known() {
        let mut unit = CrcUnit::default();
        assert_eq!(unit.write(CR, Write { value: 1 << 3, mask: u32::MAX }, 0), None);
    }
}
