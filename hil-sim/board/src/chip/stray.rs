//! Accesses that no model answered, or that the chip does not allow.

use std::collections::BTreeMap;
use std::fmt;

use serde::Serialize;

use crate::core::Access;
use crate::description;
use crate::peripherals::Why;

/// Accesses of one kind to one register.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Stray {
    /// Name of the peripheral in the reference manual.
    pub peripheral: &'static str,
    /// Offset of the register; its address if the peripheral is unknown.
    pub register: u32,
    /// Name of the register in the vendor's description; empty if it has none.
    pub name: &'static str,
    /// A write, else a read.
    pub write: bool,
    /// What is wrong with it.
    pub why: Why,
    pub count: u64,
    /// Program counter at the first.
    pub pc: u32,
}

impl fmt::Display for Stray {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { peripheral, register, name, write, why, count, pc } = self;
        let access = if *write { "write to" } else { "read of" };
        let gap = if name.is_empty() { "" } else { " " };
        write!(
            f,
            "{access} {peripheral}{gap}{name} {register:#05x}: {why}, {count} times, first at {pc:#010x}"
        )
    }
}

/// Registers whose reserved bits the firmware's libraries write as 1: embassy-stm32 0.6 writes
/// the complement of the flags, and where a 0 clears, a 1 does nothing.
const ACCEPTED: [(&str, &str); 1] = [("TIM2", "SR")];

/// All such accesses.
#[derive(Clone, Debug, Default)]
pub struct Strays(Kinds, Kinds);

type Kinds = BTreeMap<(&'static str, u32, bool, Why), Stray>;

impl Strays {
    pub(super) fn note(
        &mut self,
        (peripheral, register): (&'static str, u32),
        access: Access,
        write: bool,
        why: Why,
    ) {
        let key = (peripheral, register, write, why);
        let described = description::at(access.address & !3)
            .and_then(|(of, mut layouts)| Some((of.name, layouts.next()?.name)));
        let (peripheral, name) = described.unwrap_or((peripheral, ""));
        let first = Stray { peripheral, register, name, write, why, count: 0, pc: access.pc };
        let accepted = match why {
            Why::Broken(rule) => rule.is_accepted(),
            Why::Reserved(_) => ACCEPTED.contains(&(peripheral, name)),
            Why::NoModel | Why::NoClock => false,
        };
        let list = if accepted { &mut self.1 } else { &mut self.0 };
        list.entry(key).or_insert(first).count += 1;
    }

    /// Each kind, in the order of peripheral and register.
    pub fn iter(&self) -> impl Iterator<Item = &Stray> {
        self.0.values()
    }

    /// Those for which there is a reason: `Rule::is_accepted`, and the time
    /// driver's flags.
    pub fn accepted(&self) -> impl Iterator<Item = &Stray> {
        self.1.values()
    }

    /// Number of all accesses, without the accepted ones.
    pub fn count(&self) -> u64 {
        self.0.values().map(|stray| stray.count).sum()
    }
}
