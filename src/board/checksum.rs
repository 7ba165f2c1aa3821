//! The CRC unit, which sums up the binary log's frames: four cycles a word, where the
//! library's own code takes eight a byte.

use embassy_stm32::Peri;
use embassy_stm32::crc::{Config, Crc, InputReverseConfig, PolySize};
use embassy_stm32::pac;
use embassy_stm32::peripherals::CRC;
use interstage::log::frame::{Checker, check};

/// The unit, set up for the check of Ethernet on whole words.
pub(crate) struct Checksum(Option<Crc<'static>>);

impl Checksum {
    /// The unit; its one user is the journal.
    pub(crate) fn new(unit: Peri<'static, CRC>) -> Self {
        // A word holds its first byte lowest, and a byte its first bit: reversed, they come
        // in their order.
        let config =
            Config::new(InputReverseConfig::Word, true, PolySize::Width32, u32::MAX, 0x04C1_1DB7);
        Self(config.ok().map(|config| Crc::new(unit, config)))
    }

    /// What sums up by it.
    pub(crate) fn checker(&self) -> Checker {
        if self.0.is_some() { by_unit } else { check }
    }
}

/// [`check`] by the unit.
fn by_unit(bytes: &[u8]) -> u32 {
    let (words, []) = bytes.as_chunks() else { return check(bytes) };
    pac::CRC.cr().modify(|w| w.set_reset(true));
    for word in words {
        pac::CRC.dr32().write_value(u32::from_le_bytes(*word));
    }
    !pac::CRC.dr32().read()
}
