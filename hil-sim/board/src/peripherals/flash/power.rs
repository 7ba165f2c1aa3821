//! Power that goes, or a reset that comes, while the flash is at work.

use super::{Change, Flash};
use crate::peripherals::rcc::Cause;

/// When power is to go, counted in operations from the moment at which this is set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cut {
    /// In the middle of the n-th, from 1.
    Within(u64),
    /// As soon as the n-th is over.
    After(u64),
    /// Power stays, but the reset pin is pulled in the middle of the n-th.
    Pulled(u64),
}

impl Flash {
    /// Has power go at this operation.
    pub fn cut_power(&mut self, cut: Cut) {
        self.cut = Some(match cut {
            Cut::Within(count) => Cut::Within(self.begun + count),
            Cut::After(count) => Cut::After(self.begun + count),
            Cut::Pulled(count) => Cut::Pulled(self.begun + count),
        });
    }

    /// Operations begun since the board was made.
    pub const fn begun(&self) -> u64 {
        self.begun
    }

    /// When an operation that begins at `now` and would be over at `due` ends or is cut.
    pub(super) fn cut_short(&self, due: u64, now: u64) -> u64 {
        if self.is_torn() { now + (due - now) / 2 } else { due }
    }

    /// Whether the operation under way is not to come to its end.
    fn is_torn(&self) -> bool {
        [Some(Cut::Within(self.begun)), Some(Cut::Pulled(self.begun))].contains(&self.cut)
    }

    /// Whether power goes with the operation whose time has come; it is then not over.
    pub(super) fn goes_dark(&mut self) -> bool {
        let within = self.is_torn();
        self.ends |= within || self.cut == Some(Cut::After(self.begun));
        within
    }

    /// What ends it all now.
    pub fn ends_by(&self) -> Option<Cause> {
        let pulled = matches!(self.cut, Some(Cut::Pulled(_)));
        self.ends.then_some(if pulled { Cause::Pin } else { Cause::Power })
    }

    /// A reset. What was under way stays half done: of a double word the lower word is
    /// written, of a page or bank the first half erased.
    pub fn reset(&mut self) -> Option<Change> {
        let over = self.finished;
        let torn = self.operation.map(|operation| match operation.change {
            Change::Programmed { address, mut bytes } => {
                bytes[4..].copy_from_slice(&operation.before[4..]);
                Change::Programmed { address, bytes }
            }
            Change::Erased { address, size } => Change::Erased { address, size: size / 2 },
        });
        let cut = self.cut.filter(|_| !self.ends);
        *self = Self { begun: self.begun, cut, ..Self::default() };
        over.or(torn)
    }
}
