//! Cycles by phase.

use std::fmt;

use interstage::estimate::ContactStage;
use interstage::supervise::{Leg, Mode};
use serde::{Serialize, Serializer};

use crate::core::Meter;

/// What the drive is doing and how the wheel touches the wall.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Phase {
    /// Mode after the tick.
    pub mode: Mode,
    /// Contact stage after the tick.
    pub stage: ContactStage,
}

impl Phase {
    /// Under way on the continuous wall, no step inside the horizon.
    #[must_use]
    pub fn is_smooth(&self) -> bool {
        matches!(self.mode, Mode::Run(_, Leg::Cruise)) && self.stage == ContactStage::Continuous
    }
}

impl fmt::Display for Phase {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.mode {
            Mode::Run(way, leg) => write!(f, "{way:?} {leg:?}")?,
            Mode::Preload(way) => write!(f, "{way:?} Preload")?,
            Mode::Stopping(way) => write!(f, "{way:?} Stopping")?,
            Mode::Complete(way) => write!(f, "{way:?} Complete")?,
            mode => write!(f, "{mode:?}")?,
        }
        write!(f, ", {:?}", self.stage)
    }
}

impl Serialize for Phase {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// What calls of one function took, textbook cycles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Spread {
    /// Calls.
    pub calls: u64,
    /// Cycles of all calls.
    pub cycles: u64,
    /// Instructions of all calls.
    pub instructions: u64,
    /// Cycles of the cheapest call.
    pub least: u64,
    /// Cycles of the dearest call.
    pub most: u64,
    /// Which call that was.
    pub dearest: usize,
}

impl Spread {
    /// Adds call number `index`.
    pub fn note(&mut self, cost: Meter, index: usize) {
        if self.calls == 0 || cost.cycles < self.least {
            self.least = cost.cycles;
        }
        if cost.cycles > self.most {
            (self.most, self.dearest) = (cost.cycles, index);
        }
        self.calls += 1;
        self.cycles += cost.cycles;
        self.instructions += cost.instructions;
    }

    /// Mean cycles of a call; 0 without any.
    #[must_use]
    pub fn mean(&self) -> f64 {
        self.cycles as f64 / self.calls.max(1) as f64
    }
}

impl Serialize for Spread {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        #[derive(Serialize)]
        struct Printed {
            calls: u64,
            min: u64,
            mean: f64,
            max: u64,
            worst_input: usize,
            mean_instructions: f64,
        }
        let printed = Printed {
            calls: self.calls,
            min: self.least,
            mean: self.mean(),
            max: self.most,
            worst_input: self.dearest,
            mean_instructions: self.instructions as f64 / self.calls.max(1) as f64,
        };
        printed.serialize(serializer)
    }
}

/// What the tick takes in one phase.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct PhaseCost {
    /// The phase.
    pub phase: Phase,
    /// The tick in it.
    pub tick: Spread,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spread_knows_its_ends_and_its_mean() {
        let mut spread = Spread::default();
        for (index, cycles) in [30, 10, 50, 50].into_iter().enumerate() {
            spread.note(Meter { cycles, instructions: 1 }, index);
        }
        assert_eq!((spread.least, spread.most, spread.dearest), (10, 50, 2));
        assert_eq!(spread.mean(), 35.0);
        assert_eq!(spread.instructions, 4);
    }
}
