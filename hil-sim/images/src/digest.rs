//! A digest that both sides can make of whatever they computed.

use core::fmt::{self, Write};

/// FNV-1a, 64 bits, over what is written to it.
///
/// Used on the `Debug` text of a value, it sees every field without naming one: fixed
/// point prints enough digits to distinguish any two values. Not cryptographic; the
/// chance that two different outputs meet is 2^-64.
///
/// Source: Fowler, Noll and Vo, IETF draft-eastlake-fnv.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Digest(u64);

impl Default for Digest {
    fn default() -> Self {
        Self(0xCBF2_9CE4_8422_2325)
    }
}

impl Digest {
    /// The digest of a value's `Debug` text.
    pub fn of(value: &impl fmt::Debug) -> u64 {
        let mut digest = Self::default();
        // Writing to a digest cannot fail.
        let _ = write!(digest, "{value:?}");
        digest.0
    }
}

impl Write for Digest {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        for byte in text.bytes() {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x100_0000_01B3);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_digest_is_that_of_the_draft() {
        let mut digest = Digest::default();
        digest.write_str("foobar").unwrap();
        assert_eq!(digest.0, 0x8594_4171_F739_67E8);
    }

    #[test]
    fn neighbouring_values_differ() {
        let one = interstage::units::q16(1_000_000);
        // One part in 2^16 up.
        assert_ne!(Digest::of(&one), Digest::of(&(one + interstage::units::q16(16))));
    }
}
