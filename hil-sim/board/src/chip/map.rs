//! What lies where, and which clock it needs.

use crate::peripherals::rcc::Rcc;
use interstage::params::slots::SLOT_BYTES;

/// Where the two parameter sets begin in the board's flash.
pub const PARAMETER_SETS: u32 = 0x0808_0000 - 2 * SLOT_BYTES as u32;

/// A block of registers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Block {
    Time,
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
    Crc,
}

/// Everything on the buses. Outside of it an access is a bus fault, as on the chip.
pub(super) const RANGES: [(u32, u32); 6] = [
    (0x4000_0000, 0x3_0000),
    (0x4800_0000, 0x2000),
    (0x5000_0000, 0x1000),
    (0x5006_0000, 0x1000),
    (0xE000_0000, 0x1_0000),
    (0xE004_2000, 0x1000),
];

/// First address, bytes, block. Source: RM0440, table 3.
const BLOCKS: [(u32, u32, Block); 19] = [
    (0x4000_0000, 0x400, Block::Time),
    (0x4000_0C00, 0x400, Block::Encoder),
    (0x4000_3000, 0x400, Block::Watchdog),
    (0x4000_7000, 0x400, Block::Pwr),
    (0x4001_0000, 0x030, Block::Syscfg),
    (0x4001_0400, 0x400, Block::Exti),
    (0x4001_2C00, 0x400, Block::Motor(0)),
    (0x4001_3000, 0x400, Block::Spi),
    (0x4001_3400, 0x400, Block::Motor(1)),
    (0x4002_0000, 0x400, Block::Dma),
    (0x4002_0800, 0x400, Block::Mux),
    (0x4002_1000, 0x400, Block::Rcc),
    (0x4002_2000, 0x400, Block::Flash),
    (0x4002_3000, 0x400, Block::Crc),
    (0x5000_0000, 0x400, Block::Adc),
    (0x5000_0400, 0x400, Block::Readback),
    (0xE000_1000, 0x1000, Block::Counter),
    (0xE000_E000, 0x1000, Block::System),
    (0xE004_2000, 0x400, Block::Debug),
];

const PORTS: u32 = 0x4800_0000;
const PORT_BYTES: u32 = 0x400;

/// The block and the offset in it of a word.
pub(super) fn find(address: u32) -> Option<(Block, u32)> {
    if let Some(offset) = address.checked_sub(PORTS)
        && offset < 7 * PORT_BYTES
    {
        return Some((Block::Port((offset / PORT_BYTES) as usize), offset % PORT_BYTES));
    }
    let after = BLOCKS.partition_point(|(base, ..)| *base <= address);
    let (base, bytes, block) = *BLOCKS.get(after.checked_sub(1)?)?;
    (address - base < bytes).then_some((block, address - base))
}

/// Name of a block, as the reference manual has it.
pub(super) fn name(block: Block) -> &'static str {
    match block {
        Block::Time => "TIM2",
        Block::Encoder => "TIM5",
        Block::Motor(0) => "TIM1",
        Block::Motor(_) => "TIM8",
        Block::Watchdog => "IWDG",
        Block::Pwr => "PWR",
        Block::Syscfg => "SYSCFG",
        Block::Exti => "EXTI",
        Block::Spi => "SPI1",
        Block::Dma => "DMA1",
        Block::Mux => "DMAMUX",
        Block::Rcc => "RCC",
        Block::Flash => "FLASH",
        Block::Port(port) => {
            ["GPIOA", "GPIOB", "GPIOC", "GPIOD", "GPIOE", "GPIOF", "GPIOG"][port.min(6)]
        }
        Block::Adc => "ADC12",
        Block::Readback => "ADC345",
        Block::Counter => "DWT",
        Block::System => "SCS",
        Block::Debug => "DBGMCU",
        Block::Crc => "CRC",
    }
}

/// What an address without a block is called: everything there, and the address.
pub(super) const fn nobody(address: u32) -> (&'static str, u32) {
    ("unknown peripheral", address & !3)
}

/// Whether a block's clock is on; without it a register reads as zero and takes nothing.
pub(super) fn is_clocked(block: Block, rcc: &Rcc) -> bool {
    const AHB1: u32 = 0x48;
    const AHB2: u32 = 0x4C;
    const APB1: u32 = 0x58;
    const APB2: u32 = 0x60;
    let (register, bit) = match block {
        Block::Time => (APB1, 0),
        Block::Encoder => (APB1, 3),
        Block::Pwr => (APB1, 28),
        Block::Syscfg => (APB2, 0),
        Block::Motor(0) => (APB2, 11),
        Block::Motor(_) => (APB2, 13),
        Block::Spi => (APB2, 12),
        Block::Dma => (AHB1, 0),
        Block::Mux => (AHB1, 2),
        Block::Crc => (AHB1, 12),
        Block::Port(port) => (AHB2, port as u32),
        Block::Adc => (AHB2, 13),
        Block::Readback => (AHB2, 14),
        Block::Flash
        | Block::Rcc
        | Block::Exti
        | Block::Watchdog
        | Block::Counter
        | Block::System
        | Block::Debug => return true,
    };
    rcc.is_clocked(register, bit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_are_found_by_their_addresses() {
        assert_eq!(find(0x4001_3434), Some((Block::Motor(1), 0x34)));
        assert_eq!(find(0x4800_0818), Some((Block::Port(2), 0x18)));
        assert_eq!(find(0x5000_0308), Some((Block::Adc, 0x308)));
        assert_eq!(find(0xE000_ED08), Some((Block::System, 0xD08)));
        assert_eq!(find(0x4000_5000), None);
        assert_eq!(find(0x4800_1C00), None);
        assert_eq!(find(0x1000), None);
    }

    #[test]
    fn the_blocks_stand_in_order_inside_the_ranges() {
        assert!(BLOCKS.is_sorted_by_key(|(base, ..)| *base));
        for (base, bytes, _) in BLOCKS {
            let holds = |(from, size): &(u32, u32)| *from <= base && base + bytes <= from + size;
            assert!(RANGES.iter().any(holds), "{base:#x}");
        }
    }
}
