//! From a ratio to a duty.

#![deny(clippy::float_arithmetic)]

use crate::hal::Duty;
use crate::units::Ratio;

/// The duty nearest to `ratio`, saturating at full duty either way.
#[must_use]
pub fn duty(ratio: Ratio) -> Duty {
    // Q16 to Q15.
    let bits = ratio.to_bits() >> 1;
    Duty::from_bits(bits.clamp(-32_767, 32_767) as i16)
}

#[cfg(test)]
#[allow(clippy::float_arithmetic, reason = "the reference is in f64")]
mod tests {
    use super::*;
    use crate::units::Q16;

    #[test]
    fn duties_saturate_and_keep_their_sign() {
        assert_eq!(duty(Q16::from_num(0.5)).to_bits(), 16_384);
        assert_eq!(duty(Q16::from_num(7)).to_bits(), 32_767);
        assert_eq!(duty(Q16::from_num(-7)).to_bits(), -32_767);
        assert_eq!(duty(Q16::ZERO), Duty::ZERO);
    }
}
