//! Address map, and the clock of each block.

use super::Chip;
use crate::description::rcc::{ahb1enr, ahb2enr, apb1enr1, apb2enr};
use crate::description::*;
use crate::peripherals;
use crate::peripherals::rcc::Rcc;
use interstage::params::slots::SLOT_BYTES;

/// Address of the first of the two parameter sets in the board's flash.
pub const PARAMETER_SETS: u32 = 0x0808_0000 - 2 * SLOT_BYTES as u32;

/// Address ranges of the buses. An access outside is a bus fault, as on the chip.
pub(super) const RANGES: [(u32, u32); 6] = [
    (0x4000_0000, 0x3_0000),
    (0x4800_0000, 0x2000),
    (0x5000_0000, 0x1000),
    (0x5006_0000, 0x1000),
    (0xE000_0000, 0x1_0000),
    (0xE004_2000, 0x1000),
];

pub(super) struct Block {
    /// First address, and bytes.
    pub(super) base: u32,
    bytes: u32,
    /// Name in the reference manual.
    pub(super) name: &'static str,
    /// The bit that enables its clock; none if that is always on, or not modelled.
    clock: Option<Field>,
    pub(super) model: Model,
}

type Model = fn(&mut Chip) -> &mut dyn peripherals::Peripheral;

impl Block {
    const fn of(peripheral: Peripheral, clock: Option<Field>, model: Model) -> Self {
        let Peripheral { name, address, .. } = peripheral;
        Self { base: address, bytes: 0x400, name, clock, model }
    }

    const fn of_core(name: &'static str, base: u32, model: Model) -> Self {
        Self { base, bytes: 0x1000, name, clock: None, model }
    }

    /// Whether it is that of a peripheral.
    pub(super) const fn is(&self, peripheral: Peripheral) -> bool {
        self.base == peripheral.address
    }

    /// Whether its clock is on; without it a register reads as zero and ignores writes.
    pub(super) fn is_clocked(&self, rcc: &Rcc) -> bool {
        self.clock.is_none_or(|enable| rcc.is_clocked(enable))
    }
}

/// All blocks, in the order of their addresses. Source: RM0440, table 3 and chapter 7.
static BLOCKS: [Block; 26] = [
    Block::of(TIM2, Some(apb1enr1::TIM2EN), |chip| &mut chip.time),
    Block::of(TIM5, Some(apb1enr1::TIM5EN), |chip| &mut chip.encoder),
    Block::of(TIM7, Some(apb1enr1::TIM7EN), |chip| &mut chip.basic),
    Block::of(IWDG, None, |chip| &mut chip.watchdog),
    Block::of(PWR, Some(apb1enr1::PWREN), |chip| &mut chip.power),
    // Other blocks follow in its place.
    Block { bytes: 0x30, ..Block::of(SYSCFG, Some(apb2enr::SYSCFGEN), |chip| &mut chip.syscfg) },
    Block::of(EXTI, None, |chip| &mut chip.exti),
    Block::of(TIM1, Some(apb2enr::TIM1EN), |chip| &mut chip.motors[0]),
    Block::of(SPI1, Some(apb2enr::SPI1EN), |chip| &mut chip.spi),
    Block::of(TIM8, Some(apb2enr::TIM8EN), |chip| &mut chip.motors[1]),
    Block::of(DMA1, Some(ahb1enr::DMA1EN), |chip| &mut chip.dma),
    Block::of(DMAMUX, Some(ahb1enr::DMAMUX1EN), |chip| &mut chip.mux),
    Block::of(RCC, None, |chip| &mut chip.rcc),
    Block::of(FLASH, None, |chip| &mut chip.flash),
    Block::of(GPIOA, Some(ahb2enr::GPIOAEN), |chip| &mut chip.ports[0]),
    Block::of(GPIOB, Some(ahb2enr::GPIOBEN), |chip| &mut chip.ports[1]),
    Block::of(GPIOC, Some(ahb2enr::GPIOCEN), |chip| &mut chip.ports[2]),
    Block::of(GPIOD, Some(ahb2enr::GPIODEN), |chip| &mut chip.ports[3]),
    Block::of(GPIOE, Some(ahb2enr::GPIOEEN), |chip| &mut chip.ports[4]),
    Block::of(GPIOF, Some(ahb2enr::GPIOFEN), |chip| &mut chip.ports[5]),
    Block::of(GPIOG, Some(ahb2enr::GPIOGEN), |chip| &mut chip.ports[6]),
    // With the other converter of the pair, and the common registers.
    Block::of(ADC1, Some(ahb2enr::ADC12EN), |chip| &mut chip.adcs[0]),
    Block::of(ADC3, Some(ahb2enr::ADC345EN), |chip| &mut chip.adcs[1]),
    Block::of_core("DWT", 0xE000_1000, |chip| &mut chip.counter),
    Block::of_core("SCS", CORE, |chip| &mut chip.system),
    Block::of(DBGMCU, None, |chip| &mut chip.debug),
];

/// First address of the system control space.
pub(super) const CORE: u32 = 0xE000_E000;

/// A word of a block.
#[derive(Clone, Copy)]
pub(super) struct Place {
    pub(super) block: &'static Block,
    /// Offset in the block, bytes.
    pub(super) offset: u32,
}

/// The word at an address.
pub(super) fn find(address: u32) -> Option<Place> {
    let after = BLOCKS.partition_point(|block| block.base <= address);
    let block = BLOCKS.get(after.checked_sub(1)?)?;
    let offset = address - block.base;
    (offset < block.bytes).then_some(Place { block, offset })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_blocks_are_in_order_inside_the_ranges() {
        assert!(BLOCKS.is_sorted_by_key(|block| block.base));
        for &Block { base, bytes, .. } in &BLOCKS {
            let holds = |(from, size): &(u32, u32)| *from <= base && base + bytes <= from + size;
            assert!(RANGES.iter().any(holds), "{base:#x}");
        }
    }
}
