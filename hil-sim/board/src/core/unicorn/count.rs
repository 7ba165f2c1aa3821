//! Counts instructions and cycles, block by block.

use std::collections::HashSet;

use super::hooks::NEEDLESS;
use super::{Counted, Meter, Stop};
use crate::accelerator::{Accelerator, WORD};
use crate::peripherals::HZ;
use crate::thumb::{self, Kind};
use crate::timing::{self, REFILL};

/// A straight piece of code.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Block {
    /// Bytes; 0 where no block has begun yet.
    size: u16,
    instructions: u16,
    cycles: u16,
    /// Whether its beginning is marked.
    pub(super) marked: bool,
}

/// What the hooks keep.
pub(super) struct Count {
    pub(super) base: u32,
    pub(super) bytes: Vec<u8>,
    /// Block by the halfword it begins at.
    blocks: Vec<Block>,
    /// Addresses whose coming up is noted.
    marked: HashSet<u32>,
    /// Instructions whose cycles are known only when they are reached, by their halfword.
    deferred: Vec<Option<Kind>>,
    /// Those of them that have a hook of their own.
    pub(super) hooked: Vec<(u32, Kind)>,
    /// Those that are still without it, and in a block that has just been met.
    pub(super) wanted: Vec<(u32, Kind)>,
    /// One hook counts all deferred instructions instead.
    pub(super) common: bool,
    /// Calls of that hook for instructions that are not deferred.
    pub(super) needless: u32,
    /// Such calls after which blocks are translated again.
    pub(super) patience: u32,
    /// Cycle at which a block was last met that had not been seen.
    pub(super) met: u64,
    /// Beginning of the current block.
    pub(super) block: u32,
    /// Where the program is if it does not branch.
    pub(super) next: u32,
    pub(super) meter: Meter,
    /// The core's clock, Hz, while it is slower than full.
    pub(super) slow_hz: Option<u64>,
    /// Cycles at which to stop.
    pub(super) limit: u64,
    /// Why a hook stopped the engine.
    pub(super) stop: Option<Stop>,
    /// The flash's interface, if its waits are counted.
    pub(super) flash: Option<Accelerator>,
    /// Double words of the block that begins at a halfword, and the cycles spent in each.
    words: Vec<Option<Words>>,
}

/// Addresses of double words, and the cycles spent in each.
type Words = Box<[(u32, u16)]>;

impl Count {
    pub(super) fn new(counted: &Counted<'_>) -> Self {
        let halfwords = counted.bytes.len() / 2;
        let mut deferred = vec![None; halfwords];
        for (address, instruction, conditional) in counted.instructions() {
            if timing::is_deferred(&instruction, conditional) {
                deferred[(address - counted.base) as usize / 2] = Some(instruction.kind);
            }
        }
        Self {
            base: counted.base,
            bytes: counted.bytes.to_vec(),
            blocks: vec![Block::default(); halfwords],
            marked: HashSet::new(),
            deferred,
            hooked: Vec::new(),
            wanted: Vec::new(),
            common: false,
            needless: 0,
            patience: NEEDLESS,
            met: 0,
            block: 0,
            next: 0,
            meter: Meter::default(),
            slow_hz: None,
            limit: u64::MAX,
            stop: None,
            flash: None,
            words: Vec::new(),
        }
    }

    /// Counts the waits of the flash from now on.
    pub(super) fn count_waits(&mut self) {
        self.flash = Some(Accelerator::default());
        self.words = vec![None; self.bytes.len() / 2];
    }

    /// Cycles that the flash would have cost so far.
    pub(super) fn waits(&self) -> u64 {
        self.flash.as_ref().map_or(0, |flash| flash.waits)
    }

    /// The core executes this block, now.
    fn fetch(&mut self, address: u32, size: u32) {
        let at = self.halfword(address);
        let Some(flash) = &mut self.flash else { return };
        let Some(words) = self.words.get_mut(at) else { return };
        let bytes = &self.bytes;
        let words = words.get_or_insert_with(|| {
            let mut words: Vec<(u32, u16)> = Vec::new();
            let code = bytes.get(2 * at..2 * at + size as usize).unwrap_or_default();
            for (place, instruction, _) in thumb::sweep(code, address) {
                let word = place & !(WORD - 1);
                if words.last().is_none_or(|(last, _)| *last != word) {
                    words.push((word, 0));
                }
                if let Some((_, cycles)) = words.last_mut() {
                    *cycles += 1 + timing::extra(instruction.kind) as u16;
                }
                // An instruction may reach into the next double word.
                let last = (place + instruction.size - 1) & !(WORD - 1);
                if last != word {
                    words.push((last, 0));
                }
            }
            words.into()
        });
        let mut now = self.meter.cycles;
        for (word, cycles) in words {
            flash.execute(*word, now);
            now += u64::from(*cycles);
        }
    }

    /// The program reads data at this address.
    pub(super) fn load(&mut self, address: u32) {
        let now = self.meter.cycles;
        if let Some(flash) = &mut self.flash {
            flash.load(address, now);
        }
    }

    /// What decides about the cycles of the instruction at this address, if that is known
    /// only when it is reached.
    pub(super) fn deferred(&self, address: u32) -> Option<Kind> {
        *self.deferred.get(address.wrapping_sub(self.base) as usize / 2)?
    }

    /// Adds cycles of the core, in those of the full clock.
    pub(super) fn spend(&mut self, cycles: u64) {
        self.meter.cycles += self.slow_hz.map_or(cycles, |hz| cycles * HZ / hz);
    }

    /// Counts a block that begins here.
    #[inline]
    pub(super) fn enter(&mut self, address: u32, size: u32, block: Block) {
        if self.next != address {
            // The branch belongs to the block that ends with it.
            self.spend(REFILL);
        }
        (self.block, self.next) = (address, address.wrapping_add(size));
        if self.flash.is_some() {
            self.fetch(address, size);
        }
        self.meter.instructions += u64::from(block.instructions);
        self.spend(block.cycles.into());
    }

    /// Marks an address from now on.
    pub(super) fn mark(&mut self, address: u32) {
        self.marked.insert(address);
        self.forget();
    }

    /// Every block is met as if for the first time.
    pub(super) fn forget(&mut self) {
        self.blocks.fill(Block::default());
        self.met = self.meter.cycles;
    }

    fn halfword(&self, address: u32) -> usize {
        address.wrapping_sub(self.base) as usize / 2
    }

    /// Whether a block begins here.
    pub(super) fn begins(&self, address: u32) -> bool {
        self.blocks.get(self.halfword(address)).is_some_and(|block| block.size > 0)
    }

    /// Whether the block that begins here, and has not been seen, needs hooks before it can
    /// be counted; they are then in [`Count::wanted`].
    pub(super) fn wants_hooks(&mut self, address: u32, size: u32) -> bool {
        if self.common {
            return false;
        }
        for at in (address..address.saturating_add(size)).step_by(2) {
            if let Some(kind) = self.deferred(at)
                && !self.hooked.contains(&(at, kind))
            {
                self.wanted.push((at, kind));
            }
        }
        !self.wanted.is_empty()
    }

    /// The block of this place, if it has been seen.
    #[inline]
    pub(super) fn known(&self, address: u32, size: u32) -> Option<Block> {
        let block = self.blocks.get(self.halfword(address))?;
        (u32::from(block.size) == size).then_some(*block)
    }

    /// The block of this place, seen for the first time. What does not lie in the counted
    /// code costs nothing.
    pub(super) fn meet(&mut self, address: u32, size: u32) -> Block {
        let mut block = Block { marked: self.marked.contains(&address), ..Block::default() };
        let offset = address.wrapping_sub(self.base) as usize;
        let Some(code) = self.bytes.get(offset..offset + size as usize) else { return block };
        // A block may begin under a condition, so the sweep of the whole code decides
        // what is deferred, not this one.
        for (at, instruction, _) in thumb::sweep(code, address) {
            let is_deferred = self.deferred(at).is_some();
            let extra = if is_deferred { 0 } else { timing::extra(instruction.kind) };
            block.instructions += 1;
            block.cycles += 1 + extra as u16;
        }
        block.size = size as u16;
        self.blocks[offset / 2] = block;
        self.met = self.meter.cycles;
        block
    }
}
