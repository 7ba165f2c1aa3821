//! Address map, and the clock of each block.

use super::description::rcc::{ahb1enr, ahb2enr, apb1enr1, apb2enr};
use super::description::*;
use crate::peripherals::rcc::Rcc;
use interstage::params::slots::SLOT_BYTES;

/// Address of the first of the two parameter sets in the board's flash.
pub const PARAMETER_SETS: u32 = 0x0808_0000 - 2 * SLOT_BYTES as u32;

/// A block of registers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Block {
    Time,
    Basic,
    Encoder,
    Motor(usize),
    Watchdog,
    Pwr,
    Syscfg,
    Exti,
    Spi,
    Dma,
    Mux,
    Rcc,
    Flash,
    Port(usize),
    Adc,
    Readback,
    Counter,
    System,
    Debug,
}

/// Address ranges of the buses. An access outside is a bus fault, as on the chip.
pub(super) const RANGES: [(u32, u32); 6] = [
    (0x4000_0000, 0x3_0000),
    (0x4800_0000, 0x2000),
    (0x5000_0000, 0x1000),
    (0x5006_0000, 0x1000),
    (0xE000_0000, 0x1_0000),
    (0xE004_2000, 0x1000),
];

/// The bit that enables a block's clock; none if that is always on, or not modelled.
type Clock = Option<Field>;
/// First address, bytes, block, name in the reference manual, clock. Source: RM0440, table 3
/// and chapter 7.
const BLOCKS: [(u32, u32, Block, &str, Clock); 19] = [
    (TIM2.address, 0x400, Block::Time, "TIM2", Some(apb1enr1::TIM2EN)),
    (TIM5.address, 0x400, Block::Encoder, "TIM5", Some(apb1enr1::TIM5EN)),
    (TIM7.address, 0x400, Block::Basic, "TIM7", Some(apb1enr1::TIM7EN)),
    (IWDG.address, 0x400, Block::Watchdog, "IWDG", None),
    (PWR.address, 0x400, Block::Pwr, "PWR", Some(apb1enr1::PWREN)),
    (SYSCFG.address, 0x030, Block::Syscfg, "SYSCFG", Some(apb2enr::SYSCFGEN)),
    (EXTI.address, 0x400, Block::Exti, "EXTI", None),
    (TIM1.address, 0x400, Block::Motor(0), "TIM1", Some(apb2enr::TIM1EN)),
    (SPI1.address, 0x400, Block::Spi, "SPI1", Some(apb2enr::SPI1EN)),
    (TIM8.address, 0x400, Block::Motor(1), "TIM8", Some(apb2enr::TIM8EN)),
    (DMA1.address, 0x400, Block::Dma, "DMA1", Some(ahb1enr::DMA1EN)),
    (DMAMUX.address, 0x400, Block::Mux, "DMAMUX", Some(ahb1enr::DMAMUX1EN)),
    (RCC.address, 0x400, Block::Rcc, "RCC", None),
    (FLASH.address, 0x400, Block::Flash, "FLASH", None),
    (ADC1.address, 0x400, Block::Adc, "ADC12", Some(ahb2enr::ADC12EN)),
    (ADC3.address, 0x400, Block::Readback, "ADC345", Some(ahb2enr::ADC345EN)),
    (0xE000_1000, 0x1000, Block::Counter, "DWT", None),
    (0xE000_E000, 0x1000, Block::System, "SCS", None),
    (DBGMCU.address, 0x400, Block::Debug, "DBGMCU", None),
];

/// The ports, one after the other, with their clocks.
const PORTS: [(Peripheral, Field); 7] = [
    (GPIOA, ahb2enr::GPIOAEN),
    (GPIOB, ahb2enr::GPIOBEN),
    (GPIOC, ahb2enr::GPIOCEN),
    (GPIOD, ahb2enr::GPIODEN),
    (GPIOE, ahb2enr::GPIOEEN),
    (GPIOF, ahb2enr::GPIOFEN),
    (GPIOG, ahb2enr::GPIOGEN),
];
const PORT_BYTES: u32 = 0x400;

/// A word of a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Place {
    pub(super) block: Block,
    /// Offset in the block, bytes.
    pub(super) offset: u32,
    /// Name of the block in the reference manual.
    pub(super) name: &'static str,
    clock: Clock,
}

impl Place {
    /// Whether the block's clock is on; without it a register reads as zero and ignores writes.
    pub(super) fn is_clocked(&self, rcc: &Rcc) -> bool {
        self.clock.is_none_or(|enable| rcc.is_clocked(enable))
    }
}

/// The word at an address.
pub(super) fn find(address: u32) -> Option<Place> {
    if let Some(offset) = address.checked_sub(GPIOA.address)
        && let Some((of, clock)) = PORTS.get((offset / PORT_BYTES) as usize)
    {
        let (port, offset) = ((offset / PORT_BYTES) as usize, offset % PORT_BYTES);
        let (name, clock) = (of.name, Some(*clock));
        return Some(Place { block: Block::Port(port), offset, name, clock });
    }
    let after = BLOCKS.partition_point(|(base, ..)| *base <= address);
    let (base, bytes, block, name, clock) = *BLOCKS.get(after.checked_sub(1)?)?;
    let offset = address - base;
    (offset < bytes).then_some(Place { block, offset, name, clock })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_are_found_by_their_addresses() {
        for (address, expected) in [
            (0x4001_3434, Some(("TIM8", Block::Motor(1), 0x34))),
            (0x4800_0818, Some(("GPIOC", Block::Port(2), 0x18))),
            (0x5000_0308, Some(("ADC12", Block::Adc, 0x308))),
            (0xE000_ED08, Some(("SCS", Block::System, 0xD08))),
            (0x4000_5000, None),
            (0x4800_1C00, None),
            (0x1000, None),
        ] {
            let found = find(address).map(|place| (place.name, place.block, place.offset));
            assert_eq!(found, expected, "{address:#x}");
        }
    }

    #[test]
    fn the_blocks_are_in_order_inside_the_ranges() {
        assert!(BLOCKS.is_sorted_by_key(|(base, ..)| *base));
        for (base, bytes, ..) in BLOCKS {
            let holds = |(from, size): &(u32, u32)| *from <= base && base + bytes <= from + size;
            assert!(RANGES.iter().any(holds), "{base:#x}");
        }
    }
}
