//! Check of frames, messages and parameter sets: CRC-32 (ISO-HDLC).

use crc::{CRC_32_ISO_HDLC, Crc, Table};

static CRC: Crc<u32, Table<1>> = Crc::<u32, Table<1>>::new(&CRC_32_ISO_HDLC);

/// CRC-32 (ISO-HDLC, as of Ethernet) of these bytes. Cost: eight cycles a byte.
pub fn crc32(bytes: &[u8]) -> u32 {
    CRC.checksum(bytes)
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_check_is_the_one_of_ethernet() {
        assert_eq!(super::crc32(b"123456789"), 0xCBF4_3926);
    }
}
