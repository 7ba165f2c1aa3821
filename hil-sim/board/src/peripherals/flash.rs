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

use super::registers::{Kept, Registers};
use super::{HZ, Peripheral, Write};

use ecc::Ecc;
pub use ecc::Wrong;
pub use power::Cut;

const ACR: u32 = 0x00;
const KEYR: u32 = 0x08;
const SR: u32 = 0x10;
const CR: u32 = 0x14;
const ECCR: u32 = 0x18;
const OPTR: u32 = 0x20;

/// Of the access control register: data cache on, and reset of its content.
const DATA_CACHE: u32 = 1 << 10;
const DATA_CACHE_RESET: u32 = 1 << 12;
/// Of the option register: two banks.
const DBANK: u32 = 1 << 22;

const LOCK: u32 = 1 << 31;
const KEYS: [u32; 2] = [0x4567_0123, 0xCDEF_89AB];

/// Of the control register: program, erase a page (with number and bank) or a bank,
/// start, interrupt at the end and on an error.
const PROGRAM: u32 = 1;
const PAGE: u32 = 1 << 1;
const BANKS: [u32; 2] = [1 << 2, 1 << 15];
const SECOND_BANK: u32 = 1 << 11;
const START: u32 = 1 << 16;
const END_INTERRUPT: u32 = 1 << 24;
const ERROR_INTERRUPT: u32 = 1 << 25;
/// Bits that can be written; option bytes, fast programming and the area that can be
/// secured are not modelled.
const CONTROL: u32 = PROGRAM
    | PAGE
    | BANKS[0]
    | BANKS[1]
    | 0x7F << 3
    | SECOND_BANK
    | START
    | END_INTERRUPT
    | ERROR_INTERRUPT
    | 1 << 30
    | LOCK;

/// Of the status register.
const END: u32 = 1;
/// The double word is not erased.
const NOT_ERASED: u32 = 1 << 3;
/// The second word does not belong to the first, or the first is not the lower one.
const ALIGNMENT: u32 = 1 << 5;
/// Written by bytes or halfwords.
const SIZE: u32 = 1 << 6;
/// Written without `PG`, or with an error that is not cleared.
const SEQUENCE: u32 = 1 << 7;
const ERRORS: u32 = NOT_ERASED | 1 << 4 | ALIGNMENT | SIZE | SEQUENCE | 1 << 1 | 1 << 8 | 1 << 9;
const BUSY: u32 = 1 << 16;

/// First address of the flash, bytes of a bank and of a page.
const BASE: u32 = 0x0800_0000;
const BANK_BYTES: u32 = 256 * 1024;
const PAGE_BYTES: u32 = 2 * 1024;
/// Cycles that an operation takes, typical: 82 us a double word, 22 ms a page or bank.
/// Source: DS12288, flash memory characteristics.
const PROGRAM_CYCLES: u64 = 82 * (HZ / 1_000_000);
const ERASE_CYCLES: u64 = 22 * (HZ / 1000);

/// ACR, and OPTR as delivered.
const REGISTERS: [Kept; 2] = [
    Kept { offset: ACR, reset: 0x0004_0600, mask: 0x0004_7F0F },
    Kept { offset: OPTR, reset: 0xFFEF_F8AA, mask: 0 },
];

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
    control: u32,
    flags: u32,
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
    cache_hazards: u64,
    /// Operations begun so far, resets or not.
    begun: u64,
    cut: Option<Cut>,
    ends: bool,
}

impl Default for Flash {
    fn default() -> Self {
        Self {
            registers: Registers::new(&REGISTERS, &[], &[]),
            keys: Some(0),
            control: 0xC000_0000,
            flags: 0,
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
        let broken = if self.control & PROGRAM == 0 || self.flags & ERRORS != 0 {
            SEQUENCE
        } else if size != 4 {
            SIZE
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
                _ => ALIGNMENT,
            }
        };
        self.flags |= broken;
        self.first = None;
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
            self.flags |= NOT_ERASED;
            return;
        }
        self.begin(Change::Programmed { address, bytes }, before, now + PROGRAM_CYCLES, now);
    }

    fn erase(&mut self, now: u64) {
        let banks = [0, 1].map(|bank| self.control & BANKS[bank] != 0);
        let page = self.control & PAGE != 0;
        let both = page && banks != [false; 2] || self.control & PROGRAM != 0;
        if both || self.flags & ERRORS != 0 || !page && banks == [false; 2] {
            self.flags |= SEQUENCE;
            return;
        }
        let (address, size) = match (page, banks) {
            // The bank's bit has no meaning with one bank.
            (true, _) if self.single_bank => {
                (BASE + 2 * PAGE_BYTES * (self.control >> 3 & 0x7F), 2 * PAGE_BYTES)
            }
            (true, _) => {
                let bank = if self.control & SECOND_BANK != 0 { BANK_BYTES } else { 0 };
                (BASE + bank + PAGE_BYTES * (self.control >> 3 & 0x7F), PAGE_BYTES)
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
        self.cache_hazards += u64::from(self.caches_data());
        let due = self.cut_short(due, now);
        self.operation = Some(Operation { change, before, due });
    }

    fn caches_data(&self) -> bool {
        self.registers.get(ACR) & DATA_CACHE != 0
    }

    /// Uses of the data cache that corrupt its content on the chip.
    pub const fn cache_hazards(&self) -> u64 {
        self.cache_hazards
    }

    /// Sets the option byte: one bank of 4 KiB pages, or two as delivered.
    pub fn set_single_bank(&mut self, single: bool) {
        self.single_bank = single;
        let options = self.registers.get(OPTR) & !DBANK;
        self.registers.set(OPTR, options | if single { 0 } else { DBANK });
    }

    fn write_access(&mut self, write: Write) -> Option<()> {
        let before = self.caches_data();
        self.registers.write(ACR, write)?;
        // The content can be reset only while the cache is off.
        if write.ones() & DATA_CACHE_RESET != 0 && !before {
            self.stale = false;
        }
        if !before && self.caches_data() {
            self.cache_hazards += u64::from(self.stale);
        }
        Some(())
    }

    /// Takes the change of a finished operation.
    pub fn take_change(&mut self) -> Option<Change> {
        self.finished.take()
    }

    /// Whether it requests its interrupt.
    pub const fn requests(&self) -> bool {
        self.control & END_INTERRUPT != 0 && self.flags & END != 0
            || self.control & ERROR_INTERRUPT != 0 && self.flags & ERRORS != 0
    }

    const fn is_busy(&self) -> bool {
        self.operation.is_some() || self.wanted.is_some()
    }

    fn write_control(&mut self, write: Write, now: u64) -> Option<()> {
        // Locked or busy, it ignores writes.
        if self.control & LOCK != 0 || self.is_busy() {
            return Some(());
        }
        if write.ones() & !CONTROL != 0 {
            return None;
        }
        let kept = self.control & (LOCK | 1 << 30);
        self.control = write.onto(self.control) & !START | kept;
        if self.control & PROGRAM == 0 {
            self.first = None;
        }
        if write.ones() & START != 0 {
            self.erase(now);
        }
        Some(())
    }
}

impl Peripheral for Flash {
    fn read(&mut self, offset: u32, _: u64) -> Option<u32> {
        match offset {
            SR => Some(self.flags | if self.is_busy() { BUSY } else { 0 }),
            CR => Some(self.control),
            ECCR => Some(self.ecc.register),
            _ => self.registers.read(offset),
        }
    }

    fn write(&mut self, offset: u32, write: Write, now: u64) -> Option<()> {
        match offset {
            KEYR => {
                let next = self.keys.and_then(|taken| KEYS.get(taken).map(|key| (taken, *key)));
                self.keys = next.filter(|(_, key)| *key == write.value).map(|(taken, _)| taken + 1);
                if self.keys == Some(KEYS.len()) {
                    self.control &= !LOCK;
                    self.keys = Some(0);
                }
            }
            SR => self.flags &= !write.ones(),
            ACR => self.write_access(write)?,
            ECCR => self.ecc.write(write),
            CR => self.write_control(write, now)?,
            _ => self.registers.write(offset, write)?,
        }
        Some(())
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
            if self.control & END_INTERRUPT != 0 {
                self.flags |= END;
            }
        }
    }
}
