//! Raw codes of the peripherals, one type each, and their time stamp.

use crate::units::Tick;

/// Declares raw codes of 16 bits.
macro_rules! raw_codes {
    ($($(#[$doc:meta])* $name:ident;)*) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
        pub struct $name(u16);

        impl $name {
            /// A code as read from the peripheral.
            pub const fn new(code: u16) -> Self {
                Self(code)
            }

            /// The bare code.
            pub const fn get(self) -> u16 {
                self.0
            }
        }
    )*};
}

raw_codes! {
    /// Quadrature counter of the wheel encoder: 16 bits, wraps. At most half a turn of the counter
    /// (32767 counts, 628 mm) may lie between two readings.
    EncoderCount;
    /// Result of an oversampled conversion, left-justified to 16 bits whatever the
    /// oversampling: 0 is the negative reference, 65535 the positive one.
    AdcCode;
    /// A 16-bit frame of the magnetic angle encoder, undecoded: bit 15 even parity
    /// over the frame, bit 14 error flag, bits 13 to 0 the angle (16384 a turn).
    AngleFrame;
    /// Mean output of a motor's bridge, the difference of its two legs, through divider and
    /// low-pass: 12 bits, [`BridgeCode::CENTRE`] is no voltage. A code is 20 parts in 2^15 of the
    /// supply: the range ends at a duty of 1.25 in both directions, and the noise fits one byte a
    /// tick in the log.
    BridgeCode;
}

impl EncoderCount {
    /// Counts from `earlier` to `self`, positive in the direction of deployment.
    pub const fn since(self, earlier: Self) -> i16 {
        self.0.wrapping_sub(earlier.0) as i16
    }
}

impl AngleFrame {
    /// In place of an angle whose sensor reports that its magnet is missing, too weak or too
    /// strong: the error flag with code 0 and right parity.
    pub const NO_FIELD: Self = Self(0xC000);
}

impl BridgeCode {
    /// Code without voltage.
    pub const CENTRE: u16 = 2048;
    /// Duty of a code, LSB of Q15.
    pub const DUTY: i32 = 20;

    /// The code of a duty, Q15, at the nominal supply; saturates.
    pub const fn of(duty: i32) -> Self {
        let code = (duty + Self::DUTY * Self::CENTRE as i32 + Self::DUTY / 2) / Self::DUTY;
        let end = 2 * Self::CENTRE as i32 - 1;
        Self(if code < 0 { 0 } else { (if code > end { end } else { code }) as u16 })
    }

    /// The duty that gives it at the nominal supply, Q15.
    pub const fn duty(self) -> i32 {
        (self.0 as i32 - Self::CENTRE as i32) * Self::DUTY
    }
}

/// Readback of both bridges, converted one after the other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BridgeCodes {
    /// Drive.
    pub drive: BridgeCode,
    /// Pre-tightener.
    pub pretightener: BridgeCode,
}

/// Why a sensor gave no code this time. Its last good one stays valid and ages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BusFault {
    /// The transfer did not end in time.
    Timeout,
    /// The peripheral reported an error (overrun, framing, DMA).
    Transfer,
}

/// A raw code with the tick at which it was taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sample<T> {
    /// The code.
    pub code: T,
    /// When it was taken.
    pub at: Tick,
}

/// The latest code of each sensor; none until its first answer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SensorFrame {
    /// Wheel encoder.
    pub wheel_encoder: Option<Sample<EncoderCount>>,
    /// Preload sensor between pre-tightener and arm.
    pub preload_sensor: Option<Sample<AdcCode>>,
    /// Tread compression between arm and wheel.
    pub compression_sensor: Option<Sample<AdcCode>>,
    /// Arm angle at the pillar.
    pub arm_angle: Option<Sample<AngleFrame>>,
    /// Output of the bridges since the tick before; none if nothing was converted.
    pub bridges: Option<BridgeCodes>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_of_a_bridge_is_the_nearest_to_its_duty() {
        for code in 0..2 * BridgeCode::CENTRE {
            let duty = BridgeCode::new(code).duty();
            for off in [-BridgeCode::DUTY / 2, 0, BridgeCode::DUTY / 2 - 1] {
                assert_eq!(BridgeCode::of(duty + off).get(), code, "{off}");
            }
        }
        assert_eq!(BridgeCode::of(0).get(), BridgeCode::CENTRE);
        assert_eq!(
            (BridgeCode::of(i32::MIN / 2).get(), BridgeCode::of(i32::MAX / 2).get()),
            (0, 4095)
        );
    }
}
