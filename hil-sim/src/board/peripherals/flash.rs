//! The flash's interface: wait states and caches are kept (and cost nothing here), the
//! locks are real.

use super::registers::{Kept, Registers};
use super::{Peripheral, Write};

const KEYR: u32 = 0x08;
const SR: u32 = 0x10;
const CR: u32 = 0x14;

const LOCK: u32 = 1 << 31;
const KEYS: [u32; 2] = [0x4567_0123, 0xCDEF_89AB];

/// ACR, SR, CR, ECCR, OPTR (as delivered: two banks).
const REGISTERS: [Kept; 5] = [
    Kept { offset: 0x00, reset: 0x0004_0600, mask: 0x0004_7F0F },
    Kept { offset: SR, reset: 0, mask: 0 },
    Kept { offset: CR, reset: 0xC000_0000, mask: 0 },
    Kept { offset: 0x18, reset: 0, mask: 0 },
    Kept { offset: 0x20, reset: 0xFFEF_F8AA, mask: 0 },
];

/// The flash's interface. Programming and erasing are not modelled: setting their bits
/// counts as unmodelled.
#[derive(Clone, Debug)]
pub struct Flash {
    registers: Registers,
    /// Keys taken; none more is taken after a wrong one until reset.
    keys: Option<usize>,
}

impl Default for Flash {
    fn default() -> Self {
        Self { registers: Registers::new(&REGISTERS), keys: Some(0) }
    }
}

impl Peripheral for Flash {
    fn read(&mut self, offset: u32, _: u64) -> Option<u32> {
        self.registers.read(offset)
    }

    fn write(&mut self, offset: u32, write: Write, _: u64) -> Option<()> {
        match offset {
            KEYR => {
                let next = self.keys.and_then(|taken| KEYS.get(taken).map(|key| (taken, *key)));
                self.keys = next.filter(|(_, key)| *key == write.value).map(|(taken, _)| taken + 1);
                if self.keys == Some(KEYS.len()) {
                    self.registers.set(CR, self.registers.get(CR) & !LOCK);
                    self.keys = Some(0);
                }
                Some(())
            }
            CR if write.ones() & !LOCK == 0 => {
                self.registers.set(CR, self.registers.get(CR) | write.ones());
                Some(())
            }
            CR => None,
            _ => self.registers.write(offset, write),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn write(flash: &mut Flash, offset: u32, value: u32) -> Option<()> {
        flash.write(offset, Write { value, mask: u32::MAX }, 0)
    }

    fn locked(flash: &mut Flash) -> bool {
        flash.read(CR, 0).is_some_and(|cr| cr & LOCK != 0)
    }

    #[test]
    fn two_keys_in_their_order_open_it() {
        let mut flash = Flash::default();
        assert!(locked(&mut flash));
        for key in KEYS {
            assert_eq!(write(&mut flash, KEYR, key), Some(()));
        }
        assert!(!locked(&mut flash));
        assert_eq!(write(&mut flash, CR, LOCK), Some(()));
        assert!(locked(&mut flash));
    }

    #[test]
    fn a_wrong_key_locks_it_until_reset() {
        let mut flash = Flash::default();
        let _ = write(&mut flash, KEYR, 1);
        for key in KEYS {
            let _ = write(&mut flash, KEYR, key);
        }
        assert!(locked(&mut flash));
    }

    #[test]
    fn programming_is_not_modelled() {
        assert_eq!(write(&mut Flash::default(), CR, 1), None);
    }
}
