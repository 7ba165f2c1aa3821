//! Cycles of repeated calls.

use serde::Serialize;

use crate::core::Meter;

/// What calls of one function took, textbook cycles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Spread {
    pub calls: u64,
    pub cycles: u64,
    pub instructions: u64,
    /// Cycles of the cheapest call.
    pub min: u64,
    /// Cycles of the costliest call.
    pub max: u64,
    /// Index of that call.
    pub worst_input: usize,
}

impl Spread {
    /// Adds call number `index`.
    pub(crate) fn note(&mut self, cost: Meter, index: usize) {
        if self.calls == 0 || cost.cycles < self.min {
            self.min = cost.cycles;
        }
        if cost.cycles > self.max {
            (self.max, self.worst_input) = (cost.cycles, index);
        }
        self.calls += 1;
        self.cycles += cost.cycles;
        self.instructions += cost.instructions;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spread_knows_its_ends_and_its_sums() {
        let mut spread = Spread::default();
        for (index, cycles) in [30, 10, 50, 50].into_iter().enumerate() {
            spread.note(Meter { cycles, instructions: 1 }, index);
        }
        assert_eq!((spread.min, spread.max, spread.worst_input), (10, 50, 2));
        assert_eq!((spread.calls, spread.cycles, spread.instructions), (4, 140, 4));
    }
}
