//! Debug support: identity, and what stands still while a debugger halts the core. No
//! debugger halts it here, so that the rest is only kept.

use super::registers::{Kept, Registers};
use super::{Peripheral, Write};

/// IDCODE (category 3, revision X), CR, APB1FZR1, APB1FZR2, APB2FZR.
const REGISTERS: [Kept; 5] = [
    Kept { offset: 0x00, reset: 0x2003_6469, mask: 0 },
    Kept { offset: 0x04, reset: 0, mask: u32::MAX },
    Kept { offset: 0x08, reset: 0, mask: u32::MAX },
    Kept { offset: 0x0C, reset: 0, mask: u32::MAX },
    Kept { offset: 0x10, reset: 0, mask: u32::MAX },
];

/// Debug support.
#[derive(Clone, Debug)]
pub struct Dbgmcu(Registers);

impl Default for Dbgmcu {
    fn default() -> Self {
        Self(Registers::new(&REGISTERS))
    }
}

impl Peripheral for Dbgmcu {
    fn read(&mut self, offset: u32, _: u64) -> Option<u32> {
        self.0.read(offset)
    }

    fn write(&mut self, offset: u32, write: Write, _: u64) -> Option<()> {
        self.0.write(offset, write)
    }
}
