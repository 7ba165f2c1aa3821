//! Raw codes of the peripherals, one type each, their time stamp, and the sensors that give them.

use core::ops::{Index, IndexMut};

use serde::{Deserialize, Serialize};

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

/// Passes the sensors to the macro `$then`, behind what else it is given: each with its text, its
/// name and that in a scenario's faults, the ticks from one reading to the next, and its columns in
/// the log: the code, what may be wrong with it, and the tick at which it was taken.
///
/// The order is that of codes in frames and messages, of the tasks, and of the bits of
/// [`MissedCheckIns`](crate::restart::MissedCheckIns).
#[macro_export]
macro_rules! sensors {
    ($then:ident $($given:tt)*) => {
        $then! { $($given)*
            /// Wheel encoder: its counter, 16 bits, wraps.
            WheelEncoder "wheel encoder" "encoder", 1:
                wheel_encoder_code, wheel_encoder_at;
            /// Preload sensor between pre-tightener and arm: code of the converter.
            PreloadSensor "preload sensor" "preload-sensor", 1:
                preload_code, preload_at;
            /// Compression sensor of the tread, between arm and wheel: code of the converter.
            CompressionSensor "compression sensor" "compression-sensor", 1:
                compression_code, compression_at;
            /// Arm angle sensor at the pillar: its 14-bit code, 16384 a turn.
            ArmAngle "arm angle" "angle", 2:
                arm_angle_code (arm_angle_error), arm_angle_at;
        }
    };
}

macro_rules! sensor_id {
    ($($(#[$doc:meta])* $id:ident $name:literal $fault:literal, $period:literal:
        $code:ident $(($error:ident))?, $at:ident;)*) => {
        /// A sensor.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
        pub enum SensorId {
            $($(#[$doc])* #[serde(rename = $fault)] $id,)*
        }

        impl SensorId {
            /// Every sensor.
            pub const ALL: [Self; Self::COUNT] = [$(Self::$id),*];
            /// How many there are.
            pub const COUNT: usize = Self::NAMES.len();
            /// Their names, in the same order.
            pub const NAMES: &[&str] = &[$($name),*];
            /// Ticks from one reading to the next, in the same order.
            pub const PERIODS: [u32; Self::COUNT] = [$($period),*];
        }
    };
}
crate::sensors!(sensor_id);

impl SensorId {
    /// Those that a converter of the board reads.
    pub const ANALOG: [Self; 2] = [Self::PreloadSensor, Self::CompressionSensor];
}

/// The latest code of each sensor; none until its first answer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SensorFrame {
    /// By [`SensorId`].
    pub samples: [Option<Sample<u16>>; SensorId::COUNT],
    /// Output of the bridges since the tick before; none if nothing was converted.
    pub bridges: Option<BridgeCodes>,
}

impl SensorFrame {
    /// Codes of the first sensors, by [`SensorId`], taken at the same tick; none of the others.
    pub fn taken<const N: usize>(at: Tick, codes: [u16; N]) -> Self {
        let mut frame = Self::default();
        for (sample, code) in frame.samples.iter_mut().zip(codes) {
            *sample = Some(Sample { code, at });
        }
        frame
    }

    /// The latest code of a sensor as its type, of which `new` makes one.
    pub fn get<T>(&self, sensor: SensorId, new: fn(u16) -> T) -> Option<Sample<T>> {
        self[sensor].map(|Sample { code, at }| Sample { code: new(code), at })
    }
}

impl Index<SensorId> for SensorFrame {
    type Output = Option<Sample<u16>>;

    fn index(&self, sensor: SensorId) -> &Self::Output {
        &self.samples[sensor as usize]
    }
}

impl IndexMut<SensorId> for SensorFrame {
    fn index_mut(&mut self, sensor: SensorId) -> &mut Self::Output {
        &mut self.samples[sensor as usize]
    }
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
