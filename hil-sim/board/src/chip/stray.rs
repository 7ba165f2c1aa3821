//! Accesses that no model answered.

use std::collections::BTreeMap;
use std::fmt;

use serde::Serialize;

use crate::core::Access;

/// Why an access was not answered.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Why {
    /// No model implements the register, or this use of it.
    NoModel,
    /// The peripheral's clock is off.
    NoClock,
}

/// Accesses of one kind to one register.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Stray {
    /// Name of the peripheral in the reference manual.
    pub peripheral: &'static str,
    /// Offset of the register; its address if the peripheral is unknown.
    pub register: u32,
    /// A write, else a read.
    pub write: bool,
    /// Why it was not answered.
    pub why: Why,
    /// Number of accesses.
    pub count: u64,
    /// Program counter at the first.
    pub pc: u32,
}

impl fmt::Display for Stray {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let access = if self.write { "write to" } else { "read of" };
        let why = match self.why {
            Why::NoModel => "not modelled",
            Why::NoClock => "clock off",
        };
        let Self { peripheral, register, count, pc, .. } = self;
        write!(
            f,
            "{access} {peripheral} {register:#05x}: {why}, {count} times, first at {pc:#010x}"
        )
    }
}

/// All unanswered accesses.
#[derive(Clone, Debug, Default)]
pub struct Strays(BTreeMap<(&'static str, u32, bool, Why), Stray>);

impl Strays {
    pub(super) fn note(
        &mut self,
        (peripheral, register): (&'static str, u32),
        access: Access,
        write: bool,
        why: Why,
    ) {
        let key = (peripheral, register, write, why);
        let first = Stray { peripheral, register, write, why, count: 0, pc: access.pc };
        self.0.entry(key).or_insert(first).count += 1;
    }

    /// Each kind, in the order of peripheral and register.
    pub fn iter(&self) -> impl Iterator<Item = &Stray> {
        self.0.values()
    }

    /// Number of all accesses.
    pub fn count(&self) -> u64 {
        self.0.values().map(|stray| stray.count).sum()
    }
}
