//! Address map, and the clock of each block.

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

/// Clock enable registers of the RCC.
const AHB1: u32 = 0x48;
const AHB2: u32 = 0x4C;
const APB1: u32 = 0x58;
const APB2: u32 = 0x60;

/// Enable register and bit of a clock.
type Clock = (u32, u32);
/// A clock that is always on, or not modelled.
const ON: Clock = (0, 0);

/// First address, bytes, block, name in the reference manual, clock. Source: RM0440, table 3
/// and chapter 7.
const BLOCKS: [(u32, u32, Block, &str, Clock); 19] = [
    (0x4000_0000, 0x400, Block::Time, "TIM2", (APB1, 0)),
    (0x4000_0C00, 0x400, Block::Encoder, "TIM5", (APB1, 3)),
    (0x4000_1400, 0x400, Block::Basic, "TIM7", (APB1, 5)),
    (0x4000_3000, 0x400, Block::Watchdog, "IWDG", ON),
    (0x4000_7000, 0x400, Block::Pwr, "PWR", (APB1, 28)),
    (0x4001_0000, 0x030, Block::Syscfg, "SYSCFG", (APB2, 0)),
    (0x4001_0400, 0x400, Block::Exti, "EXTI", ON),
    (0x4001_2C00, 0x400, Block::Motor(0), "TIM1", (APB2, 11)),
    (0x4001_3000, 0x400, Block::Spi, "SPI1", (APB2, 12)),
    (0x4001_3400, 0x400, Block::Motor(1), "TIM8", (APB2, 13)),
    (0x4002_0000, 0x400, Block::Dma, "DMA1", (AHB1, 0)),
    (0x4002_0800, 0x400, Block::Mux, "DMAMUX", (AHB1, 2)),
    (0x4002_1000, 0x400, Block::Rcc, "RCC", ON),
    (0x4002_2000, 0x400, Block::Flash, "FLASH", ON),
    (0x5000_0000, 0x400, Block::Adc, "ADC12", (AHB2, 13)),
    (0x5000_0400, 0x400, Block::Readback, "ADC345", (AHB2, 14)),
    (0xE000_1000, 0x1000, Block::Counter, "DWT", ON),
    (0xE000_E000, 0x1000, Block::System, "SCS", ON),
    (0xE004_2000, 0x400, Block::Debug, "DBGMCU", ON),
];

const PORTS: u32 = 0x4800_0000;
const PORT_BYTES: u32 = 0x400;
const PORT_NAMES: [&str; 7] = ["GPIOA", "GPIOB", "GPIOC", "GPIOD", "GPIOE", "GPIOF", "GPIOG"];

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
        self.clock == ON || rcc.is_clocked(self.clock.0, self.clock.1)
    }
}

/// The word at an address.
pub(super) fn find(address: u32) -> Option<Place> {
    if let Some(offset) = address.checked_sub(PORTS)
        && offset < 7 * PORT_BYTES
    {
        let (port, offset) = ((offset / PORT_BYTES) as usize, offset % PORT_BYTES);
        let (name, clock) = (PORT_NAMES[port], (AHB2, port as u32));
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
