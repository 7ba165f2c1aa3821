//! Counts instructions and cycles, block by block.

use std::collections::HashSet;

use super::{Counted, Meter, Stop};
use crate::thumb::{self, Kind};
use crate::timing::{self, REFILL};

/// Marks a halfword at which no block has begun yet.
const UNSEEN: u32 = u32::MAX;

/// A straight piece of code.
#[derive(Clone, Copy, Debug)]
struct Block {
    size: u32,
    instructions: u64,
    cycles: u64,
    /// Whether its beginning is marked.
    marked: bool,
}

/// What the hooks keep.
pub(super) struct Count {
    pub(super) base: u32,
    pub(super) bytes: Vec<u8>,
    /// Block by the halfword it begins at.
    begins: Vec<u32>,
    blocks: Vec<Block>,
    /// Addresses whose coming up is noted.
    marked: HashSet<u32>,
    /// Instructions whose cycles are known only when they are reached, by their halfword.
    late: Vec<Option<Kind>>,
    /// Those of them that have a hook of their own.
    pub(super) hooked: Vec<(u32, Kind)>,
    /// Those that are still without it, and in a block that has just been met.
    pub(super) wanted: Vec<(u32, Kind)>,
    /// One hook counts all late instructions instead.
    pub(super) common: bool,
    /// Calls of that hook for instructions that are not late.
    pub(super) needless: u32,
    /// Cycle at which a block was last met that had not been seen.
    pub(super) met: u64,
    /// Where the program is if it does not branch.
    pub(super) next: u32,
    pub(super) meter: Meter,
    /// Cycles at which to stop.
    pub(super) limit: u64,
    /// Why a hook stopped the engine.
    pub(super) stop: Option<Stop>,
}

impl Count {
    pub(super) fn new(counted: &Counted<'_>) -> Self {
        let halfwords = counted.bytes.len() / 2;
        let mut late = vec![None; halfwords];
        for range in counted.code {
            let from = range.start.wrapping_sub(counted.base) as usize;
            let to = range.end.wrapping_sub(counted.base) as usize;
            let code = counted.bytes.get(from..to).unwrap_or_default();
            for (address, instruction, conditional) in thumb::sweep(code, range.start) {
                if timing::is_late(&instruction, conditional) {
                    late[(address - counted.base) as usize / 2] = Some(instruction.kind);
                }
            }
        }
        Self {
            base: counted.base,
            bytes: counted.bytes.to_vec(),
            begins: vec![UNSEEN; halfwords],
            blocks: Vec::new(),
            marked: HashSet::new(),
            late,
            hooked: Vec::new(),
            wanted: Vec::new(),
            common: false,
            needless: 0,
            met: 0,
            next: 0,
            meter: Meter::default(),
            limit: u64::MAX,
            stop: None,
        }
    }

    /// The instruction at an address of the counted code.
    pub(super) fn at(&self, address: u32) -> Option<thumb::Instruction> {
        thumb::decode(self.bytes.get((address & !1).wrapping_sub(self.base) as usize..)?)
    }

    /// What decides about the cycles of the instruction at this address, if that is known
    /// only when it is reached.
    pub(super) fn late(&self, address: u32) -> Option<Kind> {
        *self.late.get(address.wrapping_sub(self.base) as usize / 2)?
    }

    /// Adds cycles.
    pub(super) fn spend(&mut self, cycles: u64) {
        self.meter.cycles += cycles;
    }

    /// Counts the block that begins here; whether its beginning is marked.
    pub(super) fn enter(&mut self, address: u32, size: u32) -> bool {
        if self.next != address {
            // The branch belongs to the block that ends with it.
            self.spend(REFILL);
        }
        self.next = address.wrapping_add(size);
        let Some(index) = self.known(address, size).or_else(|| self.block(address, size)) else {
            return self.marked.contains(&address);
        };
        let Block { instructions, cycles, marked, .. } = self.blocks[index as usize];
        self.meter.instructions += instructions;
        self.spend(cycles);
        marked
    }

    /// Marks an address from now on.
    pub(super) fn mark(&mut self, address: u32) {
        self.marked.insert(address);
        self.forget();
    }

    /// Every block is met as if for the first time.
    pub(super) fn forget(&mut self) {
        self.begins.fill(UNSEEN);
        self.blocks.clear();
        self.met = self.meter.cycles;
    }

    /// Whether a block begins here.
    pub(super) fn begins(&self, address: u32) -> bool {
        let at = address.wrapping_sub(self.base) as usize / 2;
        self.begins.get(at).is_some_and(|block| *block != UNSEEN)
    }

    /// Whether the block that begins here needs hooks before it can be counted; they are
    /// then in [`Count::wanted`].
    pub(super) fn wants_hooks(&mut self, address: u32, size: u32) -> bool {
        if self.common || self.known(address, size).is_some() {
            return false;
        }
        for at in (address..address.saturating_add(size)).step_by(2) {
            if let Some(kind) = self.late(at)
                && !self.hooked.contains(&(at, kind))
            {
                self.wanted.push((at, kind));
            }
        }
        !self.wanted.is_empty()
    }

    /// The block of this place, if it has been seen.
    fn known(&self, address: u32, size: u32) -> Option<u32> {
        let index = *self.begins.get(address.wrapping_sub(self.base) as usize / 2)?;
        self.blocks.get(index as usize).filter(|block| block.size == size).map(|_| index)
    }

    /// The block of this place, seen for the first time.
    fn block(&mut self, address: u32, size: u32) -> Option<u32> {
        let offset = address.wrapping_sub(self.base) as usize;
        let code = self.bytes.get(offset..offset + size as usize)?;
        let (mut instructions, mut cycles) = (0, 0);
        // A block may begin under a condition, so the sweep of the whole code decides
        // what is late, not this one.
        for (at, instruction, _) in thumb::sweep(code, address) {
            instructions += 1;
            let late = self.late(at).is_some();
            cycles += 1 + if late { 0 } else { timing::extra(instruction.kind) };
        }
        let index = u32::try_from(self.blocks.len()).ok()?;
        let marked = self.marked.contains(&address);
        self.blocks.push(Block { size, instructions, cycles, marked });
        *self.begins.get_mut(offset / 2)? = index;
        self.met = self.meter.cycles;
        Some(index)
    }
}
