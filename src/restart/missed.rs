//! Tasks that keep the watchdog from being fed.

use serde::{Deserialize, Serialize};

/// Tasks that had not checked in when the watchdog was no longer fed, one bit a task.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct MissedCheckIns(u16);

impl MissedCheckIns {
    /// All tasks have checked in.
    pub const NOBODY: Self = Self(0);
    /// The control tick began and did not end.
    pub const TICK: Self = Self(1 << 14);
    /// The control tick did not start: something of higher priority keeps the processor.
    pub const STARVED: Self = Self(1 << 15);

    /// Names by bit; the bits after them are operators' tasks and the host's line, in the order
    /// of their start.
    const NAMES: [&'static str; 6] =
        ["wheel encoder", "preload sensor", "compression sensor", "arm angle", "model", "journal"];

    /// The task of this number, by [`TaskId`](crate::tasks::TaskId).
    pub const fn task(index: usize) -> Self {
        Self(1 << (index & 0xF))
    }

    /// The tasks of both.
    pub const fn and(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Whether all tasks have checked in.
    pub const fn is_nobody(self) -> bool {
        self.0 == 0
    }

    /// The bits.
    pub const fn bits(self) -> u16 {
        self.0
    }

    /// From the bits.
    pub const fn from_bits(bits: u16) -> Self {
        Self(bits)
    }

    /// Name of the first task.
    pub fn name(self) -> &'static str {
        match self.0.trailing_zeros() as usize {
            16 => "nobody",
            15 => "the control tick, kept from the processor",
            14 => "the control tick",
            bit => Self::NAMES.get(bit).copied().unwrap_or("an operator's task or the host's line"),
        }
    }
}
