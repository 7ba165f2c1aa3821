//! Accesses of the core and of DMA to the chip's registers, with the rules between blocks.

use super::Chip;
use super::map::{self, Place};
use crate::core::{Access, Bus};
use crate::description::{self, *};
use crate::exceptions::number::NMI;
use crate::peripherals::{Why, Write};

impl Chip {
    /// The register of an access, if a model with a clock answers it. Other accesses are noted.
    fn target(&mut self, access: Access, write: bool) -> Option<Place> {
        let Some(place) = map::find(access.address & !3) else {
            let register = ("unknown peripheral", access.address & !3);
            self.strays.note(register, access, write, Why::NoModel);
            return None;
        };
        if !place.block.is_clocked(&self.rcc) {
            self.strays.note((place.block.name, place.offset), access, write, Why::NoClock);
            return None;
        }
        Some(place)
    }

    /// Updates what an access to a register can change.
    fn settle_after(&mut self, Place { block, offset }: Place, write: bool, now: u64) {
        // Reading a data register changes state.
        let by_reading = (block.is(ADC1) || block.is(ADC3)) && offset % 0x100 == adc1::DR
            || block.is(SPI1) && offset == spi1::DR;
        let is_port = (GPIOA.address..=GPIOG.address).contains(&block.base);
        let pins = [SYSCFG, TIM1, TIM8, EXTI, PWR, FLASH];
        if write && (is_port || pins.into_iter().any(|of| block.is(of))) {
            if is_port {
                self.look_at_wheel();
            }
            self.settle(now);
        } else if block.base == map::CORE && (0x100..0x500).contains(&offset) {
            // The interrupt controller updates itself.
        } else if write || by_reading {
            self.settle_lines();
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
        let word = (place.block.model)(self).read(place.offset, access.now);
        if word.is_none() {
            self.strays.note((place.block.name, place.offset), access, false, Why::NoModel);
        }
        self.settle_after(place, false, access.now);
        word.unwrap_or(0) >> (8 * (access.address & 3)) & lowest(access.size)
    }

    fn write(&mut self, access: Access, value: u32) {
        let Some(place) = self.target(access, true) else { return };
        let Place { block, offset } = place;
        let (shift, kept) = (8 * (access.address & 3), lowest(access.size));
        let mut write = Write { value: (value & kept) << shift, mask: kept << shift };
        let (known, reserved) = description::writable(access.address & !3, write.ones());
        if reserved != 0 {
            self.strays.note((block.name, offset), access, true, Why::Reserved(reserved));
        }
        write.mask &= known;
        write.value &= known;
        if block.is(RCC) && offset == rcc::CFGR {
            let (wait_states, boosts) = (self.flash.wait_states(), self.power.boosts());
            if let Some(rule) = self.rcc.broken_rule(write, wait_states, boosts, access.now) {
                self.strays.note((block.name, offset), access, true, Why::Broken(rule));
                if !rule.is_accepted() {
                    return;
                }
            }
        }
        let sticks = self.defects.timer_flags_stick && block.is(TIM2) && offset == tim2::SR;
        if !sticks && let Err(why) = (block.model)(self).write(offset, write, access.now) {
            self.strays.note((block.name, offset), access, true, why);
        }
        self.settle_after(place, true, access.now);
    }

    fn read_spoilt(&mut self, access: Access) {
        if self.flash.read_memory(access.address, access.size) {
            self.system.exceptions.pend(NMI);
            self.settle(access.now);
        }
    }

    fn write_code(&mut self, access: Access, value: u32) -> bool {
        self.flash.store(access.address, access.size, value);
        self.settle_lines();
        true
    }

    fn deadline(&self) -> u64 {
        self.deadline
    }

    fn urgent(&self) -> Option<i16> {
        self.system.exceptions.urgent().map(|(_, priority)| priority)
    }

    fn slow_hz(&self) -> Option<u64> {
        self.rcc.slow_hz.filter(|_| !self.defects.full_clock)
    }

    fn event(&mut self) {
        self.system.exceptions.event = true;
    }
}
