//! Accesses of the core and of DMA to the chip's registers, with the rules between blocks.

use super::description;
use super::map::{self, Block, Place};
use super::stray::Why;
use super::{Chip, pwr, rcc};
use crate::core::{Access, Bus};
use crate::exceptions::number::NMI;
use crate::peripherals::{Peripheral, Write};
use crate::rules::Rule;

impl Chip {
    /// The register of an access, if a model with a clock answers it. Other accesses are noted.
    fn target(&mut self, access: Access, write: bool) -> Option<Place> {
        let Some(place) = map::find(access.address & !3) else {
            let register = ("unknown peripheral", access.address & !3);
            self.strays.note(register, access, write, Why::NoModel);
            return None;
        };
        if !place.is_clocked(&self.rcc) {
            self.strays.note((place.name, place.offset), access, write, Why::NoClock);
            return None;
        }
        Some(place)
    }

    /// Notes the rule that the last access to a block broke.
    fn note_broken_rule(
        &mut self,
        block: Block,
        register: (&'static str, u32),
        access: Access,
        write: bool,
    ) {
        if let Some(rule) = self.block(block).take_broken_rule() {
            self.strays.note(register, access, write, Why::Broken(rule));
        }
    }

    /// The rule between several blocks that this write would break.
    fn broken_rule(&mut self, block: Block, offset: u32, write: Write, now: u64) -> Option<Rule> {
        match (block, offset) {
            (Block::Rcc, rcc::CFGR) => {
                let wait_states = self.flash.read(0, now)? & 0xF;
                let boosts = self.power.read(pwr::CR5, now)? & pwr::R1MODE == 0;
                self.rcc.broken_rule(write, wait_states, boosts, now)
            }
            _ => None,
        }
    }
}

/// Bits of an access in the lowest bytes of a word.
const fn lowest(bytes: u32) -> u32 {
    if bytes >= 4 { u32::MAX } else { (1 << (8 * bytes)) - 1 }
}

impl Bus for Chip {
    fn ranges(&self) -> Vec<(u32, u32)> {
        map::RANGES.to_vec()
    }

    fn read(&mut self, access: Access) -> u32 {
        let Some(Place { block, offset, name, .. }) = self.target(access, false) else { return 0 };
        let word = self.block(block).read(offset, access.now);
        self.note_broken_rule(block, (name, offset), access, false);
        self.settle_after(block, offset, false, access.now);
        if word.is_none() {
            self.strays.note((name, offset), access, false, Why::NoModel);
        }
        word.unwrap_or(0) >> (8 * (access.address & 3)) & lowest(access.size)
    }

    fn write(&mut self, access: Access, value: u32) {
        let Some(Place { block, offset, name, .. }) = self.target(access, true) else { return };
        let (shift, kept) = (8 * (access.address & 3), lowest(access.size));
        let mut write = Write { value: (value & kept) << shift, mask: kept << shift };
        let (known, reserved) = description::writable(access.address & !3, write.ones());
        if reserved != 0 {
            self.strays.note((name, offset), access, true, Why::Reserved(reserved));
        }
        write.mask &= known;
        write.value &= known;
        if let Some(rule) = self.broken_rule(block, offset, write, access.now) {
            self.strays.note((name, offset), access, true, Why::Broken(rule));
            if rule.accepted().is_none() {
                return;
            }
        }
        let sticks = self.defects.timer_flags_stick && (block, offset) == (Block::Time, 0x10);
        if !sticks && self.block(block).write(offset, write, access.now).is_none() {
            self.strays.note((name, offset), access, true, Why::NoModel);
        }
        self.note_broken_rule(block, (name, offset), access, true);
        self.settle_after(block, offset, true, access.now);
    }

    fn read_spoilt(&mut self, access: Access) {
        if self.flash.read_memory(access.address, access.size) {
            self.system.exceptions.pend(NMI, access.now);
            self.settle(access.now);
        }
    }

    fn write_code(&mut self, access: Access, value: u32) -> bool {
        self.flash.store(access.address, access.size, value);
        self.settle_lines(access.now);
        true
    }

    fn deadline(&self) -> u64 {
        self.deadline
    }

    fn urgent(&self) -> Option<i16> {
        self.system.exceptions.urgent().map(|(_, priority)| priority)
    }

    fn event(&mut self) {
        self.system.exceptions.event = true;
    }
}
