//! Power control: the core's voltage stands as soon as it is asked for.

use super::registers::{Kept, Registers};
use super::{Peripheral, Write};

/// CR1 to CR4, CR5 (with the boost of the main regulator), and the status registers,
/// which report no change under way. Pull-ups in standby are not used.
const REGISTERS: [Kept; 7] = [
    Kept { offset: 0x00, reset: 0x200, mask: 0x4707 },
    Kept { offset: 0x04, reset: 0, mask: 0xFFFF },
    Kept { offset: 0x08, reset: 0x8000, mask: 0xFFFF },
    Kept { offset: 0x0C, reset: 0, mask: 0xFFFF },
    Kept { offset: 0x10, reset: 0, mask: 0 },
    Kept { offset: 0x14, reset: 0, mask: 0 },
    Kept { offset: 0x80, reset: 0x100, mask: 0x100 },
];

/// Power control.
#[derive(Clone, Debug)]
pub struct Pwr(Registers);

impl Default for Pwr {
    fn default() -> Self {
        Self(Registers::new(&REGISTERS))
    }
}

impl Peripheral for Pwr {
    fn read(&mut self, offset: u32, _: u64) -> Option<u32> {
        self.0.read(offset)
    }

    fn write(&mut self, offset: u32, write: Write, _: u64) -> Option<()> {
        self.0.write(offset, write)
    }
}
