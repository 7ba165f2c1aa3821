//! System configuration: which port an external interrupt line looks at, and what else
//! stops the motor timers.

use super::registers::Registers;
use super::{Peripheral, Why, Write};
use crate::description::{SYSCFG, bits, syscfg::*};

/// System configuration.
#[derive(Clone, Debug)]
pub struct Syscfg(Registers);

impl Default for Syscfg {
    fn default() -> Self {
        let whole = [MEMRMP, CFGR1, EXTICR1, EXTICR2, EXTICR3, EXTICR4];
        let breaks = bits(&[cfgr2::CLL, cfgr2::SPL, cfgr2::ECCL]);
        Self(Registers::of(SYSCFG, &whole, &[(CFGR2, breaks)], &[]))
    }
}

impl Syscfg {
    /// The port that line `line` (0 to 15) looks at: 0 is port A.
    pub fn port(&self, line: u32) -> u32 {
        self.0.get(EXTICR1 + line / 4 * 4) >> (line % 4 * 4) & 0xF
    }

    /// Whether a locked-up core stops the motor timers.
    pub(crate) fn lockup_breaks(&self) -> bool {
        self.0.has(cfgr2::CLL)
    }

    /// Whether two wrong bits in flash do.
    pub(crate) fn flash_breaks(&self) -> bool {
        self.0.has(cfgr2::ECCL)
    }
}

impl Peripheral for Syscfg {
    fn read(&mut self, offset: u32, _: u64) -> Option<u32> {
        self.0.read(offset)
    }

    fn write(&mut self, offset: u32, write: Write, _: u64) -> Result<(), Why> {
        let set_only = offset == CFGR2;
        // Locks of the break inputs can be set, never taken back.
        let value = if set_only { write.value | self.0.get(CFGR2) } else { write.value };
        self.0.write(offset, Write { value, ..write })
    }
}
