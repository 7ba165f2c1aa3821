//! A quadrature counter: TIM5.

use super::registers::{Kept, Registers};
use super::{Peripheral, Write};

const CR1: u32 = 0x00;
const SMCR: u32 = 0x08;
const SR: u32 = 0x10;
const EGR: u32 = 0x14;
const CCMR1: u32 = 0x18;
const CCER: u32 = 0x20;
const CNT: u32 = 0x24;
const ARR: u32 = 0x2C;

const ALL: u32 = u32::MAX;
/// Mode of the slave controller.
const MODE: u32 = 7;

const REGISTERS: [Kept; 5] = [
    Kept { offset: CR1, reset: 0, mask: 0x87 },
    Kept { offset: SMCR, reset: 0, mask: MODE },
    Kept { offset: CCMR1, reset: 0, mask: 0xF3F3 },
    Kept { offset: CCER, reset: 0, mask: 0x33 },
    Kept { offset: ARR, reset: ALL, mask: ALL },
];

/// Cycles for which a level has to last to pass an input filter (`ICxF`, `BKF`) with the
/// timer's clock.
pub const fn filter_cycles(setting: u32) -> u64 {
    let (divider, samples) = match setting & 0xF {
        0 => (1, 0),
        1 => (1, 2),
        2 => (1, 4),
        3 => (1, 8),
        4 => (2, 6),
        5 => (2, 8),
        6 => (4, 6),
        7 => (4, 8),
        8 => (8, 6),
        9 => (8, 8),
        10 => (16, 5),
        11 => (16, 6),
        12 => (16, 8),
        13 => (32, 5),
        14 => (32, 6),
        _ => (32, 8),
    };
    divider * samples
}

/// The counter.
#[derive(Clone, Debug)]
pub struct Encoder {
    registers: Registers,
    lines: [bool; 2],
}

impl Encoder {
    /// After reset, with these levels at its inputs.
    pub fn new(lines: [bool; 2]) -> Self {
        Self {
            registers: Registers::new(&REGISTERS, &[CNT], &[0x04, 0x0C, 0x1C, 0x28, 0x34, 0x38]),
            lines,
        }
    }

    /// The lines take these levels for `cycles`; the filter drops shorter ones.
    pub fn set_lines(&mut self, lines: [bool; 2], cycles: u64) {
        for (line, level) in lines.into_iter().enumerate() {
            if level != self.lines[line] && cycles >= self.filter(line) {
                self.lines[line] = level;
                self.edge(line);
            }
        }
    }

    fn filter(&self, line: usize) -> u64 {
        filter_cycles(self.registers.get(CCMR1) >> (8 * line + 4))
    }

    fn edge(&mut self, line: usize) {
        let mode = self.registers.get(SMCR) & MODE;
        let counts = matches!((mode, line), (1 | 3, 0) | (2 | 3, 1));
        // Each channel has to look at its own input.
        let mapped = self.registers.get(CCMR1) >> (8 * line) & 3 == 1;
        if !counts || !mapped || self.registers.get(CR1) & 1 == 0 {
            return;
        }
        let inverted = |line: usize| self.registers.get(CCER) >> (4 * line + 1) & 1 != 0;
        let level = |line: usize| self.lines[line] ^ inverted(line);
        // The first line leads when counting up: its edges find the other line at the
        // level that it left, those of the second line at the one that it takes.
        let up = (level(0) == level(1)) == (line == 1);
        let (count, reload) = (self.registers.get(CNT), self.registers.get(ARR));
        let next = match (up, count) {
            (true, count) if count >= reload => 0,
            (true, count) => count + 1,
            (false, 0) => reload,
            (false, count) => count - 1,
        };
        self.registers.set(CNT, next);
    }
}

impl Peripheral for Encoder {
    fn read(&mut self, offset: u32, _: u64) -> Option<u32> {
        match offset {
            SR | EGR => Some(0),
            _ => self.registers.read(offset),
        }
    }

    fn write(&mut self, offset: u32, write: Write, _: u64) -> Option<()> {
        match offset {
            // Nothing here raises a flag that could be cleared.
            SR => Some(()),
            EGR if write.ones() & !1 == 0 => {
                if write.ones() & 1 != 0 {
                    self.registers.set(CNT, 0);
                }
                Some(())
            }
            EGR => None,
            SMCR if write.ones() & !MODE != 0 || write.ones() & MODE > 3 => None,
            _ => self.registers.write(offset, write),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Levels of the two lines at a position of so many quarters of a line pair.
    fn at(quarters: i32) -> [bool; 2] {
        let phase = quarters.rem_euclid(4);
        [matches!(phase, 1 | 2), matches!(phase, 2 | 3)]
    }

    fn ready(mode: u32) -> Encoder {
        let mut encoder = Encoder::new(at(0));
        for (offset, value) in [(ARR, 0xFFFF), (CCMR1, 0xF1F1), (CCER, 0), (SMCR, mode), (CR1, 1)] {
            encoder.write(offset, Write { value, mask: ALL }, 0).expect("modelled");
        }
        encoder
    }

    fn count(encoder: &mut Encoder) -> u16 {
        encoder.read(CNT, 0).expect("modelled") as u16
    }

    #[test]
    fn every_edge_counts_up_and_down() {
        let mut encoder = ready(3);
        for quarters in 1..=10 {
            encoder.set_lines(at(quarters), 1000);
            assert_eq!(count(&mut encoder), quarters as u16);
        }
        for quarters in (-3..10).rev() {
            encoder.set_lines(at(quarters), 1000);
            assert_eq!(count(&mut encoder), quarters as u16);
        }
    }

    #[test]
    fn the_modes_of_one_line_count_half_of_them() {
        for mode in [1, 2] {
            let mut encoder = ready(mode);
            for quarters in 1..=8 {
                encoder.set_lines(at(quarters), 1000);
            }
            assert_eq!(count(&mut encoder), 4);
        }
    }

    #[test]
    fn a_broken_line_holds_the_count_within_one() {
        let mut encoder = ready(3);
        for quarters in 1..=40 {
            encoder.set_lines([at(quarters)[0], false], 1000);
        }
        assert!(matches!(count(&mut encoder), 0 | 1));
    }

    #[test]
    fn the_filter_drops_shorter_levels() {
        let mut encoder = ready(3);
        encoder.set_lines(at(1), 255);
        assert_eq!(count(&mut encoder), 0);
        encoder.set_lines(at(1), 256);
        assert_eq!(count(&mut encoder), 1);
    }
}
