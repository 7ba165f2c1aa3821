//! The flash's interface: locks, programming by double words, erasing by pages and banks, and
//! its errors. Wait states, prefetch and instruction cache are kept and have no effect.
//!
//! The data cache holds no data either. What would corrupt it on the chip is counted: an
//! operation begun while it is on (code runs from the other bank meanwhile), and switching it
//! on after an operation without a reset of its content.
//!
//! A double word of 64 bits is written as two words, the lower one first, into erased flash.
//! The machine holds the memory: it supplies the old content, and applies the [`Change`].
//!
//! Source: RM0440, 3.3 (operations, caches) and 3.7 (registers); ES0430 (STM32G474 errata),
//! "Data cache might be corrupted during Flash memory read-while-write operation". Dual bank as
//! delivered; with the option bit `DBANK` cleared a page has 4 KiB and there is no second bank.

mod ecc;
mod power;
#[cfg(test)]
mod tests;

use super::registers::Registers;
use super::{HZ, Peripheral, Why, Write};
use crate::description::{FLASH, bits, flash::*};

use ecc::Ecc;
pub use ecc::Wrong;
pub use power::Cut;

const KEYS: [u32; 2] = [0x4567_0123, 0xCDEF_89AB];

/// Erasing of one bank or of both.
const ERASES_BANKS: u32 = bits(&[cr::MER1, cr::MER2]);
/// Of the control register: option bytes, fast programming and the area that can be secured are
/// not modelled.
const CONTROL: u32 = ERASES_BANKS
    | bits(&[cr::PG, cr::PER, cr::PNB, cr::BKER, cr::STRT, cr::EOPIE, cr::ERRIE])
    | bits(&[cr::OPTLOCK, cr::LOCK]);
const ERRORS: u32 = bits(&[sr::OPERR, sr::PROGERR, sr::WRPERR, sr::PGAERR, sr::SIZERR])
    | bits(&[sr::PGSERR, sr::MISERR, sr::FASTERR]);

/// First address of the flash, bytes of a bank and of a page.
const BASE: u32 = 0x0800_0000;
const BANK_BYTES: u32 = 256 * 1024;
const PAGE_BYTES: u32 = 2 * 1024;
/// Cycles that an operation takes, typical: 82 us a double word, 22 ms a page or bank.
/// Source: DS12288, flash memory characteristics.
const PROGRAM_CYCLES: u64 = 82 * (HZ / 1_000_000);
const ERASE_CYCLES: u64 = 22 * (HZ / 1000);

/// Change of the memory by an operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// A double word, or the part of it that was written before power was lost.
    Programmed {
        /// Where.
        address: u32,
        /// The new content.
        bytes: [u8; 8],
    },
    /// Every bit set.
    Erased {
        /// From where.
        address: u32,
        /// Bytes.
        size: u32,
    },
}

/// A current operation.
#[derive(Clone, Copy, Debug)]
struct Operation {
    change: Change,
    /// Old content of a double word.
    before: [u8; 8],
    due: u64,
}

/// The flash's interface.
#[derive(Clone, Debug)]
pub struct Flash {
    registers: Registers,
    /// Keys accepted; none is accepted after a wrong one until reset.
    keys: Option<usize>,
    /// The lower word of a double word, and where.
    first: Option<(u32, u32)>,
    /// A double word whose old content is not known yet.
    wanted: Option<(u32, [u8; 8])>,
    operation: Option<Operation>,
    finished: Option<Change>,
    ecc: Ecc,
    /// One bank, by an option byte.
    single_bank: bool,
    /// An operation has changed what the data cache may hold.
    stale: bool,
    /// Uses of the data cache that corrupt it, resets or not.
    pub cache_hazards: u64,
    /// Operations begun so far, resets or not.
    pub begun: u64,
    cut: Option<Cut>,
    ends: bool,
}

impl Default for Flash {
    fn default() -> Self {
        let mut registers = Registers::of(FLASH, &[ACR, SR], &[(CR, CONTROL)], &[OPTR]);
        // By RM0440, FLASH_ACR; the description has 0.
        registers.put(acr::DBG_SWEN, 1);
        Self {
            registers,
            keys: Some(0),
            first: None,
            wanted: None,
            operation: None,
            finished: None,
            ecc: Ecc::default(),
            single_bank: false,
            stale: false,
            cache_hazards: 0,
            begun: 0,
            cut: None,
            ends: false,
        }
    }
}

impl Flash {
    /// The program writes to the flash's memory.
    pub fn store(&mut self, address: u32, size: u32, value: u32) {
        let broken = if !self.registers.has(cr::PG) || self.has_failed() {
            sr::PGSERR
        } else if size != 4 {
            sr::SIZERR
        } else {
            match self.first.take() {
                None if address.is_multiple_of(8) => {
                    self.first = Some((address, value));
                    return;
                }
                Some((lower, word)) if lower + 4 == address => {
                    let double = u64::from(value) << 32 | u64::from(word);
                    self.wanted = Some((lower, double.to_le_bytes()));
                    return;
                }
                _ => sr::PGAERR,
            }
        };
        self.registers.put(broken, 1);
        self.first = None;
    }

    /// Whether an error is flagged.
    fn has_failed(&self) -> bool {
        self.registers.get(SR) & ERRORS != 0
    }

    /// Address whose content the interface needs.
    pub fn needs(&self) -> Option<u32> {
        self.wanted.map(|(address, _)| address)
    }

    /// Supplies the content at the address that was needed.
    pub fn found(&mut self, before: [u8; 8], now: u64) {
        let Some((address, bytes)) = self.wanted.take() else { return };
        // A double word of zeros overwrites any content.
        if before != [0xFF; 8] && bytes != [0; 8] {
            self.registers.put(sr::PROGERR, 1);
            return;
        }
        self.begin(Change::Programmed { address, bytes }, before, now + PROGRAM_CYCLES, now);
    }

    fn erase(&mut self, now: u64) {
        let banks = [cr::MER1, cr::MER2].map(|bank| self.registers.has(bank));
        let page = self.registers.has(cr::PER);
        if self.registers.has(cr::PG) || page == (banks != [false; 2]) || self.has_failed() {
            self.registers.put(sr::PGSERR, 1);
            return;
        }
        let number = self.registers.field(cr::PNB);
        let (address, size) = match (page, banks) {
            // The bank's bit has no meaning with one bank.
            (true, _) if self.single_bank => (BASE + 2 * PAGE_BYTES * number, 2 * PAGE_BYTES),
            (true, _) => {
                let bank = BANK_BYTES * self.registers.field(cr::BKER);
                (BASE + bank + PAGE_BYTES * number, PAGE_BYTES)
            }
            (_, [true, true]) => (BASE, 2 * BANK_BYTES),
            (_, [true, _]) => (BASE, BANK_BYTES),
            _ => (BASE + BANK_BYTES, BANK_BYTES),
        };
        self.begin(Change::Erased { address, size }, [0xFF; 8], now + ERASE_CYCLES, now);
    }

    fn begin(&mut self, change: Change, before: [u8; 8], due: u64, now: u64) {
        self.begun += 1;
        self.stale = true;
        self.cache_hazards += u64::from(self.registers.has(acr::DCEN));
        let due = self.cut_short(due, now);
        self.operation = Some(Operation { change, before, due });
    }

    /// Wait states, see [`super::rcc`].
    pub(crate) fn wait_states(&self) -> u32 {
        self.registers.field(acr::LATENCY)
    }

    /// Sets the option byte: one bank of 4 KiB pages, or two as delivered.
    pub fn set_single_bank(&mut self, single: bool) {
        self.single_bank = single;
        self.registers.put(optr::DBANK, (!single).into());
    }

    fn write_access(&mut self, write: Write) -> Result<(), Why> {
        let before = self.registers.has(acr::DCEN);
        self.registers.write(ACR, write)?;
        // The content can be reset only while the cache is off.
        if acr::DCRST.is_in(write.ones()) && !before {
            self.stale = false;
        }
        if !before && self.registers.has(acr::DCEN) {
            self.cache_hazards += u64::from(self.stale);
        }
        Ok(())
    }

    /// Takes the change of a finished operation.
    pub(crate) fn take_change(&mut self) -> Option<Change> {
        self.finished.take()
    }

    /// Whether it requests its interrupt.
    pub fn requests(&self) -> bool {
        self.registers.has(cr::EOPIE) && self.registers.has(sr::EOP)
            || self.registers.has(cr::ERRIE) && self.has_failed()
    }

    const fn is_busy(&self) -> bool {
        self.operation.is_some() || self.wanted.is_some()
    }

    fn write_control(&mut self, write: Write, now: u64) -> Result<(), Why> {
        // Locked or busy, it ignores writes.
        if self.registers.has(cr::LOCK) || self.is_busy() {
            return Ok(());
        }
        // The locks can be set alone.
        let locks = write.zeros() & bits(&[cr::LOCK, cr::OPTLOCK]);
        self.registers.write(CR, Write { mask: write.mask & !locks, ..write })?;
        self.registers.put(cr::STRT, 0);
        if !self.registers.has(cr::PG) {
            self.first = None;
        }
        if cr::STRT.is_in(write.ones()) {
            self.erase(now);
        }
        Ok(())
    }
}

impl Peripheral for Flash {
    fn read(&mut self, offset: u32, _: u64) -> Option<u32> {
        match offset {
            SR => Some(self.registers.get(SR) | sr::BSY.at(self.is_busy().into())),
            ECCR => Some(self.ecc.register),
            _ => self.registers.read(offset),
        }
    }

    fn write(&mut self, offset: u32, write: Write, now: u64) -> Result<(), Why> {
        match offset {
            KEYR => {
                let next = self.keys.and_then(|taken| KEYS.get(taken).map(|key| (taken, *key)));
                self.keys = next.filter(|(_, key)| *key == write.value).map(|(taken, _)| taken + 1);
                if self.keys == Some(KEYS.len()) {
                    self.registers.put(cr::LOCK, 0);
                    self.keys = Some(0);
                }
            }
            SR => self.registers.clear(SR, write.ones()),
            ACR => self.write_access(write)?,
            ECCR => self.ecc.write(write),
            CR => self.write_control(write, now)?,
            _ => self.registers.write(offset, write)?,
        }
        Ok(())
    }

    fn deadline(&self) -> u64 {
        let due = self.operation.map_or(u64::MAX, |operation| operation.due);
        if self.wanted.is_some() || self.finished.is_some() { 0 } else { due }
    }

    fn advance(&mut self, now: u64) {
        if let Some(operation) = self.operation
            && operation.due <= now
            && !self.is_interrupted()
        {
            self.operation = None;
            self.written(operation.change);
            self.finished = Some(operation.change);
            if self.registers.has(cr::EOPIE) {
                self.registers.put(sr::EOP, 1);
            }
        }
    }
}
