//! Error correction: double words whose bits are wrong, and what a read of them reports.
//!
//! Each double word has eight bits of correction. One wrong bit is corrected, two are reported by
//! the NMI, and the data comes as it is. A double word whose write lost its power has correction
//! bits that do not fit it; so have those of a page whose erasing was interrupted.
//!
//! Source: RM0440, 3.3.2 (error code correction) and 3.7.7 (`FLASH_ECCR`).

use std::collections::BTreeMap;

use super::{BANK_BYTES, BASE, Change, Flash, Write};
use crate::description::{Field, bits, flash::eccr};

/// Bytes that are corrected together.
const WORD: u32 = 8;

/// How many bits of a double word are wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrong {
    /// One, which is corrected.
    One,
    /// Two, which are reported.
    Two,
    /// Two of those that are for correction: the data is right, and they are reported too.
    Check,
}

/// Double words with wrong bits, by their addresses, and the register.
#[derive(Clone, Debug, Default)]
pub(super) struct Ecc {
    words: BTreeMap<u32, Wrong>,
    pub(super) register: u32,
}

impl Ecc {
    /// Forgets the double words of a range, which is written again.
    fn forget(&mut self, address: u32, size: u32) {
        self.words.retain(|at, _| !(address..address + size).contains(at));
    }

    /// The memory as it is, and the register cleared.
    pub(super) fn after_reset(&mut self) -> Self {
        Self { words: std::mem::take(&mut self.words), register: 0 }
    }

    /// An access to its register.
    pub(super) const fn write(&mut self, write: Write) {
        let interrupt = write.onto(self.register) & eccr::ECCIE.mask;
        let cleared = write.ones() & bits(&[eccr::ECCD, eccr::ECCC]);
        self.register = self.register & !cleared & !eccr::ECCIE.mask | interrupt;
    }

    /// Bits were found wrong in the double word at this address; the first report stays until it
    /// is cleared.
    fn report(&mut self, address: u32, wrong: Wrong) {
        let corrected = wrong == Wrong::One;
        let has = |field: Field| field.is_in(self.register);
        if has(eccr::ECCD) || corrected && has(eccr::ECCC) {
            return;
        }
        let offset = address - BASE;
        let place = eccr::BK_ECC.at(offset / BANK_BYTES) | (offset % BANK_BYTES / WORD);
        let flag = if corrected { eccr::ECCC } else { eccr::ECCD };
        self.register &= bits(&[eccr::ECCIE, eccr::ECCC]);
        self.register |= flag.mask | place;
    }
}

impl Flash {
    /// Makes bits of the double word at this address wrong, until it is erased.
    pub fn spoil(&mut self, address: u32, wrong: Wrong) {
        self.ecc.words.insert(address & !(WORD - 1), wrong);
    }

    /// Double words with wrong bits: first address and bytes of each run of them.
    pub(crate) fn spoilt(&self) -> Vec<(u32, u32)> {
        let mut runs: Vec<(u32, u32)> = Vec::new();
        for &at in self.ecc.words.keys() {
            match runs.last_mut() {
                Some((first, bytes)) if *first + *bytes == at => *bytes += WORD,
                _ => runs.push((at, WORD)),
            }
        }
        runs
    }

    /// The core reads these bytes; returns whether two wrong bits were found, which is an NMI.
    pub(crate) fn read_memory(&mut self, address: u32, size: u32) -> bool {
        let from = address & !(WORD - 1);
        let found = self.ecc.words.range(from..address.saturating_add(size));
        let found: Vec<(u32, Wrong)> = found.map(|(at, wrong)| (*at, *wrong)).collect();
        let before = self.has_two_wrong_bits();
        for (at, wrong) in found {
            self.ecc.report(at, wrong);
        }
        self.has_two_wrong_bits() != before
    }

    /// Whether two wrong bits are reported and not yet cleared.
    pub(crate) const fn has_two_wrong_bits(&self) -> bool {
        eccr::ECCD.is_in(self.ecc.register)
    }

    /// A change of the memory is done.
    pub(super) fn written(&mut self, change: Change) {
        match change {
            Change::Programmed { address, .. } => self.ecc.forget(address, WORD),
            Change::Erased { address, size } => self.ecc.forget(address, size),
        }
    }

    /// A change of the memory was interrupted: of an erasure the second half is undefined.
    pub(super) fn torn(&mut self, change: Change) {
        match change {
            Change::Programmed { address, .. } => self.spoil(address, Wrong::Two),
            Change::Erased { address, size } => {
                self.ecc.forget(address, size);
                let rest = address + size / 2..address + size;
                rest.step_by(WORD as usize).for_each(|at| self.spoil(at, Wrong::Two));
            }
        }
    }
}
