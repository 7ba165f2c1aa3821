//! System configuration: which port an external interrupt line looks at, and what else
//! stops the motor timers.

use super::registers::{Kept, Registers};
use super::{Peripheral, Write};

/// `EXTICR1`.
const EXTICR: u32 = 0x08;
/// `CFGR2`.
const CFGR2: u32 = 0x1C;

const REGISTERS: [Kept; 7] = [
    Kept { offset: 0x00, reset: 0, mask: 0x107 },
    Kept { offset: 0x04, reset: 0x7C00_0001, mask: 0xFDFF_0301 },
    Kept { offset: EXTICR, reset: 0, mask: 0xFFFF },
    Kept { offset: EXTICR + 4, reset: 0, mask: 0xFFFF },
    Kept { offset: EXTICR + 8, reset: 0, mask: 0xFFFF },
    Kept { offset: EXTICR + 12, reset: 0, mask: 0xFFFF },
    Kept { offset: CFGR2, reset: 0, mask: 0xB },
];

/// System configuration.
#[derive(Clone, Debug)]
pub struct Syscfg(Registers);

impl Default for Syscfg {
    fn default() -> Self {
        Self(Registers::new(&REGISTERS, &[], &[]))
    }
}

impl Syscfg {
    /// The port that line `line` (0 to 15) looks at: 0 is port A.
    pub fn port(&self, line: u32) -> u32 {
        self.0.get(EXTICR + line / 4 * 4) >> (line % 4 * 4) & 0xF
    }

    /// Whether a locked-up core stops the motor timers.
    pub fn lockup_breaks(&self) -> bool {
        self.0.get(CFGR2) & 1 != 0
    }

    /// Whether two wrong bits in flash do.
    pub fn flash_breaks(&self) -> bool {
        self.0.get(CFGR2) & 1 << 3 != 0
    }
}

impl Peripheral for Syscfg {
    fn read(&mut self, offset: u32, _: u64) -> Option<u32> {
        self.0.read(offset)
    }

    fn write(&mut self, offset: u32, write: Write, _: u64) -> Option<()> {
        let set_only = offset == CFGR2;
        // Locks of the break inputs can be set, never taken back.
        let value = if set_only { write.value | self.0.get(CFGR2) } else { write.value };
        self.0.write(offset, Write { value, ..write })
    }
}
