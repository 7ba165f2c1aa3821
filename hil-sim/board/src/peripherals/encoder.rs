//! A quadrature counter: TIM5.

use super::registers::Registers;
use super::{Peripheral, Why, Write};
use crate::description::{Field, TIM5, bits, tim2::*};

/// Registers that the model has in part: two inputs with their filters, and quadrature modes.
const PARTS: [(u32, u32); 4] = [
    (CR1, bits(&[cr1::CEN, cr1::UDIS, cr1::URS, cr1::ARPE])),
    (SMCR, smcr::SMS.mask),
    (CCMR1_INPUT, bits(&[MAPPED[0], FILTER[0], MAPPED[1], FILTER[1]])),
    (CCER, bits(&[ccer::CC1E, ccer::CC2E, INVERTED[0], INVERTED[1]])),
];
const FIXED: [u32; 8] = [CR2, DIER, SR, EGR, CCMR2_INPUT, PSC, CCR1, CCR2];

/// Mode in which every edge of both lines counts, the one that is modelled.
const BOTH: u32 = 3;

/// Of the two lines: which input the channel looks at, its filter, its polarity.
const MAPPED: [Field; 2] = [ccmr1_input::CC1S, ccmr1_input::CC2S];
const FILTER: [Field; 2] = [ccmr1_input::IC1F, ccmr1_input::IC2F];
const INVERTED: [Field; 2] = [ccer::CC1P, ccer::CC2P];

/// Cycles for which a level has to last to pass an input filter (`ICxF`, `BKF`) with the
/// timer's clock.
pub(crate) const fn filter_cycles(setting: u32) -> u64 {
    // Divider of the clock, and samples.
    const FILTERS: [[[u64; 2]; 4]; 4] = [
        [[1, 0], [1, 2], [1, 4], [1, 8]],
        [[2, 6], [2, 8], [4, 6], [4, 8]],
        [[8, 6], [8, 8], [16, 5], [16, 6]],
        [[16, 8], [32, 5], [32, 6], [32, 8]],
    ];
    let [divider, samples] = FILTERS[setting as usize >> 2 & 3][setting as usize & 3];
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
        Self { registers: Registers::of(TIM5, &[CNT, ARR], &PARTS, &FIXED), lines }
    }

    /// The lines take these levels for `cycles`; the filter drops shorter ones.
    pub(crate) fn set_lines(&mut self, lines: [bool; 2], cycles: u64) {
        for (line, level) in lines.into_iter().enumerate() {
            let filter = filter_cycles(self.registers.field(FILTER[line]));
            if level != self.lines[line] && cycles >= filter {
                self.lines[line] = level;
                self.edge(line);
            }
        }
    }

    fn edge(&mut self, line: usize) {
        let counts = self.registers.field(smcr::SMS) == BOTH;
        // Each channel has to look at its own input.
        let mapped = self.registers.field(MAPPED[line]) == 1;
        if !counts || !mapped || !self.registers.has(cr1::CEN) {
            return;
        }
        let level = |line: usize| self.lines[line] ^ self.registers.has(INVERTED[line]);
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
        self.registers.read(offset)
    }

    fn write(&mut self, offset: u32, write: Write, _: u64) -> Result<(), Why> {
        match offset {
            // Nothing here raises a flag that could be cleared.
            SR => Ok(()),
            EGR if write.ones() == egr::UG.mask => {
                self.registers.set(CNT, 0);
                Ok(())
            }
            SMCR if ![0, BOTH].contains(&smcr::SMS.of(write.ones())) => Err(Why::NoModel),
            _ => self.registers.write(offset, write),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::peripherals::tests::write;

    /// Levels of the two lines at a position of so many quarters of a line pair.
    fn at(quarters: i32) -> [bool; 2] {
        let phase = quarters.rem_euclid(4);
        [matches!(phase, 1 | 2), matches!(phase, 2 | 3)]
    }

    fn ready() -> Encoder {
        let mut encoder = Encoder::new(at(0));
        for (offset, value) in
            [(ARR, 0xFFFF), (CCMR1_INPUT, 0xF1F1), (CCER, 0), (SMCR, BOTH), (CR1, 1)]
        {
            write(&mut encoder, offset, value, 0);
        }
        encoder
    }

    fn count(encoder: &mut Encoder) -> u16 {
        encoder.read(CNT, 0).expect("modelled") as u16
    }

    #[test]
    fn a_broken_line_holds_the_count_within_one() {
        let mut encoder = ready();
        for quarters in 1..=40 {
            encoder.set_lines([at(quarters)[0], false], 1000);
        }
        assert!(matches!(count(&mut encoder), 0 | 1));
    }

    #[test]
    fn the_filter_drops_shorter_levels() {
        let mut encoder = ready();
        encoder.set_lines(at(1), 255);
        assert_eq!(count(&mut encoder), 0);
        encoder.set_lines(at(1), 256);
        assert_eq!(count(&mut encoder), 1);
    }
}
