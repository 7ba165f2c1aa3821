//! Counts instructions and cycles, block by block.

use std::collections::{HashMap, HashSet};

use super::{Counted, Meter, Stop};
use crate::thumb::{self, Kind};
use crate::timing::{self, REFILL};

/// Marks a halfword at which no block has begun yet.
pub(super) const UNSEEN: u32 = u32::MAX;

/// A straight piece of code.
#[derive(Clone, Copy, Debug)]
pub(super) struct Block {
    pub(super) address: u32,
    pub(super) size: u32,
    instructions: u64,
    cycles: u64,
    /// Address of the instruction that ends it, if that shuts interrupts out or lets them
    /// in. The engine ends a block behind each of these.
    masks: Option<u32>,
    /// Cycles spent here since last asked.
    pub(super) heat: u64,
}

/// What the hooks keep.
pub(super) struct Count {
    pub(super) base: u32,
    pub(super) bytes: Vec<u8>,
    /// Block by the halfword it begins at.
    begins: Vec<u32>,
    pub(super) blocks: Vec<Block>,
    /// Instructions whose cycles a hook of their own counts.
    late: HashMap<u32, Kind>,
    /// Those of them that are still without it, as no block with them has been met.
    unhooked: HashSet<u32>,
    /// A block has been met that holds some of those.
    pub(super) wanted: Vec<(u32, Kind)>,
    /// Blocks that have heat.
    pub(super) warm: Vec<u32>,
    /// The block under way.
    pub(super) current: u32,
    /// Its end, see [`Block::masks`], if it is still to be looked at.
    pub(super) masks: Option<u32>,
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
            warm: Vec::new(),
            current: UNSEEN,
            masks: None,
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

    /// Adds cycles to the total and to the block under way.
    pub(super) fn spend(&mut self, cycles: u64) {
        self.meter.cycles += cycles;
        if let Some(block) = self.blocks.get_mut(self.current as usize) {
            if block.heat == 0 {
                self.warm.push(self.current);
            }
            block.heat += cycles;
        }
    }

    /// Counts the block that begins here.
    pub(super) fn enter(&mut self, address: u32, size: u32) {
        if self.next != address {
            // The branch belongs to the block that ends with it.
            self.spend(REFILL);
        }
        self.next = address.wrapping_add(size);
        let Some(index) = self.block(address, size) else {
            self.current = UNSEEN;
            return;
        };
        let Block { instructions, cycles, masks, .. } = self.blocks[index as usize];
        (self.current, self.masks) = (index, masks);
        self.meter.instructions += instructions;
        self.spend(cycles);
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
        let (mut instructions, mut cycles, mut masks) = (0, 0, None);
        // A block may begin under a condition, so the sweep of the whole code decides
        // what is late, not this one.
        for (at, instruction, _) in thumb::sweep(code, address) {
            let late = self.late.contains_key(&at);
            instructions += 1;
            masks = code
                .get((at - address) as usize..)
                .filter(|rest| masks_interrupts(rest))
                .map(|_| at);
            cycles += 1 + if late { 0 } else { timing::extra(instruction.kind) };
        }
        let index = u32::try_from(self.blocks.len()).ok()?;
        self.blocks.push(Block { address, size, instructions, cycles, masks, heat: 0 });
        *self.begins.get_mut(offset / 2)? = index;
        Some(index)
    }
}

/// Whether code begins with an instruction that shuts interrupts out or lets them in:
/// `CPSID i`, `CPSIE i` or `MSR PRIMASK, Rn`.
fn masks_interrupts(code: &[u8]) -> bool {
    match *code {
        [0x72 | 0x62, 0xB6, ..] => true,
        [first, 0xF3, 0x10, 0x88, ..] => first >> 4 == 8,
        _ => false,
    }
}
