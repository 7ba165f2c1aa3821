//! Accesses of the core and of DMA to the chip's registers, with the rules between blocks.

use super::Chip;
use super::description;
use super::description::{rcc, tim2};
use super::map::{self, Block, Place};
use super::stray::Why;
use crate::core::{Access, Bus};
use crate::exceptions::number::NMI;
use crate::peripherals::Write;
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

    /// After an access that a model took or not: notes what was wrong with it, and updates what
    /// it can have changed.
    fn close(&mut self, place: Place, access: Access, write: bool, taken: bool) {
        let Place { block, offset, name, .. } = place;
        if let Some(rule) = self.block(block).take_broken_rule() {
            self.strays.note((name, offset), access, write, Why::Broken(rule));
        }
        if !taken {
            self.strays.note((name, offset), access, write, Why::NoModel);
        }
        self.settle_after(block, offset, write, access.now);
    }

    /// The rule between several blocks that this write would break.
    fn broken_rule(&mut self, block: Block, offset: u32, write: Write, now: u64) -> Option<Rule> {
        match (block, offset) {
            (Block::Rcc, rcc::CFGR) => {
                let (wait_states, boosts) = (self.flash.wait_states(), self.power.boosts());
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
        let Some(place) = self.target(access, false) else { return 0 };
        let word = self.block(place.block).read(place.offset, access.now);
        self.close(place, access, false, word.is_some());
        word.unwrap_or(0) >> (8 * (access.address & 3)) & lowest(access.size)
    }

    fn write(&mut self, access: Access, value: u32) {
        let Some(place) = self.target(access, true) else { return };
        let Place { block, offset, name, .. } = place;
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
            if !rule.is_accepted() {
                return;
            }
        }
        let sticks = self.defects.timer_flags_stick && (block, offset) == (Block::Time, tim2::SR);
        let taken = sticks || self.block(block).write(offset, write, access.now).is_some();
        self.close(place, access, true, taken);
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
