//! Loss of power, or a reset, during a flash operation.

use super::{Change, Flash};
use crate::peripherals::rcc::Cause;

/// When power is lost, counted in operations from when this is set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cut {
    /// In the middle of the n-th, from 1.
    Within(u64),
    /// At the end of the n-th.
    After(u64),
    /// Not power, but the reset pin, in the middle of the n-th.
    Pulled(u64),
}

impl Flash {
    /// Sets the operation at which power is lost.
    pub fn cut_power(&mut self, cut: Cut) {
        self.cut = Some(match cut {
            Cut::Within(count) => Cut::Within(self.begun + count),
            Cut::After(count) => Cut::After(self.begun + count),
            Cut::Pulled(count) => Cut::Pulled(self.begun + count),
        });
    }

    /// Cycle at which an operation from `now` to `due` ends or is interrupted.
    pub(super) fn cut_short(&self, due: u64, now: u64) -> u64 {
        if self.cuts_current() { now + (due - now) / 2 } else { due }
    }

    /// Whether the current operation is interrupted.
    fn cuts_current(&self) -> bool {
        [Some(Cut::Within(self.begun)), Some(Cut::Pulled(self.begun))].contains(&self.cut)
    }

    /// Whether power is lost in the operation that is due.
    pub(super) fn is_interrupted(&mut self) -> bool {
        let within = self.cuts_current();
        self.ends |= within || self.cut == Some(Cut::After(self.begun));
        within
    }

    /// Cause of the reset that is due.
    pub(crate) fn ends_by(&self) -> Option<Cause> {
        let pulled = matches!(self.cut, Some(Cut::Pulled(_)));
        self.ends.then_some(if pulled { Cause::Pin } else { Cause::Power })
    }

    /// A reset. A current operation is left half done: the lower word of a double word, the
    /// first half of a page or bank. The error correction finds the rest undefined.
    pub fn reset(&mut self) -> Option<Change> {
        let over = self.finished;
        let torn = self.operation.map(|operation| match operation.change {
            Change::Programmed { address, mut bytes } => {
                bytes[4..].copy_from_slice(&operation.before[4..]);
                Change::Programmed { address, bytes }
            }
            Change::Erased { address, size } => Change::Erased { address, size: size / 2 },
        });
        if let Some(operation) = self.operation {
            self.torn(operation.change);
        }
        let cut = self.cut.filter(|_| !self.ends);
        let (begun, cache_hazards) = (self.begun, self.cache_hazards);
        let single_bank = self.single_bank;
        let ecc = self.ecc.after_reset();
        *self = Self { begun, cache_hazards, cut, ecc, ..Self::default() };
        self.set_single_bank(single_bank);
        over.or(torn)
    }
}
