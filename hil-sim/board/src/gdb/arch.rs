//! The core as GDB knows it: seventeen registers.

use gdbstub::arch::{Arch, Registers};

pub(super) enum CortexM {}

/// R0 to R12, stack pointer, link register, program counter, xPSR.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Core(pub(super) [u32; 17]);

/// Place of the program counter.
pub(super) const PC: usize = 15;

impl Registers for Core {
    type ProgramCounter = u32;

    fn pc(&self) -> u32 {
        self.0[PC]
    }

    fn gdb_serialize(&self, mut write_byte: impl FnMut(Option<u8>)) {
        for byte in self.0.iter().flat_map(|register| register.to_le_bytes()) {
            write_byte(Some(byte));
        }
    }

    fn gdb_deserialize(&mut self, bytes: &[u8]) -> Result<(), ()> {
        let (words, _) = bytes.as_chunks::<4>();
        if words.len() < self.0.len() {
            return Err(());
        }
        for (register, word) in self.0.iter_mut().zip(words) {
            *register = u32::from_le_bytes(*word);
        }
        Ok(())
    }
}

impl Arch for CortexM {
    type Usize = u32;
    type Registers = Core;
    type BreakpointKind = usize;
    type RegId = ();

    fn target_description_xml() -> Option<&'static str> {
        Some(include_str!("cortex-m.xml"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn registers_go_there_and_back() {
        let core = Core(std::array::from_fn(|index| 0x0102_0304 * index as u32));
        let mut bytes = Vec::new();
        core.gdb_serialize(|byte| bytes.extend(byte));
        let mut back = Core::default();
        assert_eq!(back.gdb_deserialize(&bytes), Ok(()));
        assert_eq!((back.pc(), back), (15 * 0x0102_0304, core));
        assert_eq!(Core::default().gdb_deserialize(&bytes[1..]), Err(()));
    }
}
