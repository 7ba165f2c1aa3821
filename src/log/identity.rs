//! Head of every log: firmware, image, rig and parameters.

use serde::{Deserialize, Serialize};

use super::crc32;
use crate::sense::raw::SensorId;
use crate::tick::Telemetry;
use crate::units::Millimetres;

/// Number of the frames' layout beside the names of sensors and quantities, changed with it.
/// Today's names have schema 9.
const LAYOUT: u16 = 0x79B8;

/// Layout of the frames: a hash of the names in it (FNV-1a, folded). A reader of another number
/// reports that and decodes nothing.
pub const SCHEMA: u16 = {
    let mut hash = 0x811C_9DC5_u32;
    let all = [SensorId::NAMES, Telemetry::COLUMNS];
    let (mut list, mut name, mut byte) = (0, 0, 0);
    while list < all.len() {
        if name == all[list].len() {
            (list, name) = (list + 1, 0);
        } else if byte == all[list][name].len() {
            (name, byte) = (name + 1, 0);
        } else {
            hash = (hash ^ all[list][name].as_bytes()[byte] as u32).wrapping_mul(0x0100_0193);
            byte += 1;
        }
    }
    LAYOUT ^ hash as u16 ^ (hash >> 16) as u16
};

/// Longest version, build and name, bytes.
pub const MAX_TEXT: usize = 24;

/// A short text.
pub type Text = heapless::String<MAX_TEXT>;

/// Source of a log. Sent first and every second, for readers that join late.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Identity {
    /// Layout of the frames, [`SCHEMA`].
    pub schema: u16,
    /// Version of the firmware.
    pub version: Text,
    /// Hash of the image, first eight bytes; zero on a host.
    pub build: [u8; 8],
    /// Name of the rig.
    pub rig: Text,
    /// CRC-32 of the rig's parameters.
    pub parameters: u32,
    /// CRC-32 of its sensors' parameters alone.
    pub calibration: u32,
    /// Travel of the wheel over a corner, mm.
    pub corner: Millimetres,
}

impl Identity {
    /// Not known yet.
    pub const NOBODY: Self = Self {
        schema: 0,
        version: Text::new(),
        build: [0; 8],
        rig: Text::new(),
        parameters: 0,
        calibration: 0,
        corner: Millimetres::ZERO,
    };
}

/// As much of a text as fits.
pub fn text(from: &str) -> Text {
    let mut text = Text::new();
    let _ = from.chars().try_for_each(|letter| text.push(letter));
    text
}

/// CRC-32 of a value as postcard, 4 KiB at most; for the host.
pub fn fingerprint(value: &impl Serialize) -> u32 {
    postcard::to_slice(value, &mut [0; 4096]).map_or(0, |written| crc32(written))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_text_is_cut_between_letters() {
        assert_eq!(text("prototype").as_str(), "prototype");
        assert_eq!(text("eine Länge über alles ä").len(), 24 + 1 - 1);
        assert_eq!(text(&"ä".repeat(20)).as_str(), "ä".repeat(12));
    }
}
