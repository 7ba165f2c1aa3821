//! How columns are written: modes and stages by name, bits as 0 and 1, the arm's frame as its code
//! and what is wrong with it.

use interstage::sense::raw::AngleFrame;
use interstage::units::Q16;

use super::Columns;
use crate::plant::sensors::with_parity;

/// Bits of an angle frame: the code, the sensor's error flag.
pub(super) const ANGLE: u16 = 0x3FFF;
const ERROR_FLAG: u16 = 1 << 14;

/// What is wrong with a frame: 1 the sensor's error flag is set, 2 the parity is odd.
pub(super) fn angle_error(frame: AngleFrame) -> u8 {
    let bits = frame.get();
    u8::from(bits & ERROR_FLAG != 0) | u8::from(bits != with_parity(bits)) << 1
}

/// The frame of a code and of what is wrong with it.
pub(super) fn angle_frame(code: u16, error: u8) -> AngleFrame {
    let bits = with_parity(code & ANGLE | if error & 1 != 0 { ERROR_FLAG } else { 0 });
    AngleFrame::new(bits ^ u16::from(error & 2) << 14)
}

/// A quantity of the controller.
pub(crate) struct Column {
    pub name: &'static str,
    /// The stage of the tick that gives it.
    pub stage: &'static str,
    /// The plot that shows it and the name of its curve.
    pub curve: Option<(&'static str, &'static str)>,
    /// Its value, `NaN` if unknown.
    pub of: fn(&Columns) -> f64,
}

/// A quantity in a column.
pub(super) trait Cell: Copy {
    /// Of a tick that did not run, or a log without the column.
    const UNKNOWN: Self;
    fn of(quantity: Q16) -> Self;
    fn quantity(self) -> Option<Q16>;
}

impl Cell for f64 {
    const UNKNOWN: Self = Self::NAN;

    fn of(quantity: Q16) -> Self {
        quantity.to_num()
    }

    fn quantity(self) -> Option<Q16> {
        (!self.is_nan()).then(|| Q16::from_num(self))
    }
}

/// None where the controller has the largest number.
impl Cell for Option<f64> {
    const UNKNOWN: Self = None;

    fn of(quantity: Q16) -> Self {
        (quantity != Q16::MAX).then(|| quantity.to_num())
    }

    fn quantity(self) -> Option<Q16> {
        Some(self.map_or(Q16::MAX, Q16::from_num))
    }
}

/// A column of names, from this number on.
macro_rules! named {
    ($module:ident, $names:expr, $first:expr) => {
        pub(super) mod $module {
            use serde::de::Error as _;
            use serde::{Deserialize, Deserializer, Serializer};

            pub(in crate::record) fn serialize<S: Serializer>(
                number: &u8,
                to: S,
            ) -> Result<S::Ok, S::Error> {
                let name = $names.get(usize::from(*number).wrapping_sub($first));
                to.serialize_str(name.copied().unwrap_or("unknown"))
            }

            pub(in crate::record) fn deserialize<'de, D: Deserializer<'de>>(
                from: D,
            ) -> Result<u8, D::Error> {
                let name = String::deserialize(from)?;
                let place = $names.iter().position(|known| *known == name);
                let place = place.ok_or_else(|| D::Error::custom(format!("no name: {name}")))?;
                Ok((place + $first) as u8)
            }
        }
    };
}
named!(mode_column, super::super::MODE_NAMES, 0);
named!(stage_column, super::super::STAGE_NAMES, 1);

/// Yes and no as 1 and 0, which viewers can plot.
pub(super) mod bit {
    use serde::{Deserialize, Deserializer, Serializer};

    pub(in crate::record) fn serialize<S: Serializer>(
        bit: &bool,
        to: S,
    ) -> Result<S::Ok, S::Error> {
        to.serialize_u8((*bit).into())
    }

    pub(in crate::record) fn deserialize<'de, D: Deserializer<'de>>(
        from: D,
    ) -> Result<bool, D::Error> {
        u8::deserialize(from).map(|bit| bit != 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use interstage::log::Record;
    use interstage::sense::raw::{Sample, SensorFrame, SensorId};

    #[test]
    fn every_frame_of_the_arm_comes_back_and_its_code_has_no_parity() {
        for bits in 0..=u16::MAX {
            let mut sensors = SensorFrame::default();
            sensors[SensorId::ArmAngle] = Some(Sample { code: bits, at: 9 });
            let tick = Columns::of(&Record::default(), &sensors);
            assert_eq!(tick.sensors(), sensors, "{bits:#06x}");
            assert_eq!(tick.arm_angle_code, Some(bits & 0x3FFF));
            let is_good = interstage::sense::angle::decode(AngleFrame::new(bits)).is_ok();
            assert_eq!(tick.arm_angle_error == 0, is_good, "{bits:#06x}");
        }
    }
}
