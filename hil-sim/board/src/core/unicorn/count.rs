//! Counts instructions and cycles, block by block.

use std::collections::{HashMap, HashSet};

use super::{Counted, Meter, Stop};
use crate::thumb::{self, Kind};
use crate::timing::{self, REFILL};

/// Marks a halfword at which no block has begun yet.
pub(super) const UNSEEN: u32 = u32::MAX;

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
    /// Instructions whose cycles a hook of their own counts.
    late: HashMap<u32, Kind>,
    /// Those of them that are still without it, as no block with them has been met.
    unhooked: HashSet<u32>,
    /// A block has been met that holds some of those.
    pub(super) wanted: Vec<(u32, Kind)>,
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
        Self {
            base: counted.base,
            bytes: counted.bytes.to_vec(),
            begins: vec![UNSEEN; counted.bytes.len() / 2],
            blocks: Vec::new(),
            late: HashMap::new(),
            unhooked: HashSet::new(),
            wanted: Vec::new(),
            marked: HashSet::new(),
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
        let Some(index) = self.block(address, size) else {
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
        // What is known of blocks was decided before.
        self.begins.fill(UNSEEN);
        self.blocks.clear();
    }

    /// This instruction's cycles are known only when it is reached.
    pub(super) fn is_late(&mut self, address: u32, kind: Kind) {
        self.late.insert(address, kind);
        self.unhooked.insert(address);
    }

    /// Whether the block that begins here needs hooks before it can be counted; they are
    /// then in [`Count::wanted`].
    ///
    /// The engine goes through all hooks of instructions whenever it calls one, so only
    /// what the program comes to gets any.
    pub(super) fn wants_hooks(&mut self, address: u32, size: u32) -> bool {
        if self.unhooked.is_empty() || self.known(address, size).is_some() {
            return false;
        }
        for at in (address..address.saturating_add(size)).step_by(2) {
            if let (true, Some(kind)) = (self.unhooked.remove(&at), self.late.get(&at)) {
                self.wanted.push((at, *kind));
            }
        }
        !self.wanted.is_empty()
    }

    /// The block of this place, if it has been seen.
    fn known(&self, address: u32, size: u32) -> Option<u32> {
        let index = *self.begins.get(address.wrapping_sub(self.base) as usize / 2)?;
        self.blocks.get(index as usize).filter(|block| block.size == size).map(|_| index)
    }

    /// The block of this place, decoded when first seen.
    fn block(&mut self, address: u32, size: u32) -> Option<u32> {
        if let Some(index) = self.known(address, size) {
            return Some(index);
        }
        let offset = address.wrapping_sub(self.base) as usize;
        let code = self.bytes.get(offset..offset + size as usize)?;
        let (mut instructions, mut cycles) = (0, 0);
        // A block may begin under a condition, so the sweep of the whole code decides
        // what is late, not this one.
        for (at, instruction, _) in thumb::sweep(code, address) {
            let late = self.late.contains_key(&at);
            instructions += 1;
            cycles += 1 + if late { 0 } else { timing::extra(instruction.kind) };
        }
        let index = u32::try_from(self.blocks.len()).ok()?;
        let marked = self.marked.contains(&address);
        self.blocks.push(Block { size, instructions, cycles, marked });
        *self.begins.get_mut(offset / 2)? = index;
        Some(index)
    }
}
