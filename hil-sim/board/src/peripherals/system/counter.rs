//! The cycle counter of the data watchpoint unit.

use super::super::{Peripheral, Write};

const CTRL: u32 = 0x0;
const CYCCNT: u32 = 0x4;

/// The counter; the rest of the unit is not modelled.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counter {
    on: bool,
    origin: u64,
    held: u32,
}

impl Peripheral for Counter {
    fn read(&mut self, offset: u32, now: u64) -> Option<u32> {
        match offset {
            // Four comparators, and whether it counts.
            CTRL => Some(4 << 28 | u32::from(self.on)),
            CYCCNT if self.on => Some(now.wrapping_sub(self.origin) as u32),
            CYCCNT => Some(self.held),
            _ => None,
        }
    }

    fn write(&mut self, offset: u32, write: Write, now: u64) -> Option<()> {
        let value = self.read(CYCCNT, now)?;
        match offset {
            // What the unit has is read-only.
            CTRL if write.ones() & !(1 | 0xFF << 24) == 0 => {
                self.on = write.onto(u32::from(self.on)) & 1 != 0;
                self.held = value;
            }
            CYCCNT => self.held = write.onto(value),
            _ => return None,
        }
        self.origin = now.wrapping_sub(u64::from(self.held));
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_counts_cycles_while_it_is_on() {
        let mut counter = Counter::default();
        let all = |value| Write { value, mask: u32::MAX };
        assert_eq!(counter.read(CYCCNT, 500), Some(0));
        counter.write(CTRL, all(4 << 28 | 1), 1000).expect("modelled");
        assert_eq!(counter.read(CYCCNT, 1250), Some(250));
        counter.write(CYCCNT, all(7), 2000).expect("modelled");
        assert_eq!(counter.read(CYCCNT, 2003), Some(10));
        counter.write(CTRL, all(0), 2010).expect("modelled");
        assert_eq!(counter.read(CYCCNT, 9999), Some(17));
    }
}
