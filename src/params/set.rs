//! A parameter set as bytes: header, rig, constants made of it, check.
//!
//! ```text
//! header | rig | controller | planner | CRC-32 of all before it, little end first
//! ```
//! All but the last four bytes is postcard. The rig comes first, so that the host can read it
//! from a set with constants of another schema, and make the set again.

use core::fmt;

use serde::{Deserialize, Serialize};

use crate::fault::worded;
use crate::log::{complete, crc32};
use crate::model::Planner;
use crate::rig::Rig;
use crate::tick::Controller;

/// Layout of the constants. Raised with every change of a type that a set holds; a set of
/// another number is refused, and the host makes it again from its rig.
pub const SCHEMA: u16 = 15;

/// Longest name of a set, bytes.
pub const MAX_NAME: usize = 24;

/// Bytes of the check.
const CHECK: usize = 4;

/// Head of a set.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Header {
    /// Layout of what follows, [`SCHEMA`].
    pub schema: u16,
    /// Name of the rig.
    pub name: heapless::String<MAX_NAME>,
    /// Bytes of the rig.
    pub rig_length: u16,
    /// CRC-32 of the rig's parameters, postcard.
    pub parameters: u32,
    /// CRC-32 of its sensors' parameters alone: ranges, offsets, scales.
    pub calibration: u32,
}

/// Why bytes are not a set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SetError {
    /// Shorter than any set.
    Short,
    /// The check does not fit the bytes.
    Damaged,
    /// Sound, but of another layout.
    Schema {
        /// That of the set.
        found: u16,
    },
    /// The check fits and the content does not: written by another program.
    Content,
}

impl SetError {
    /// The error in words.
    pub const fn sentence(self) -> &'static str {
        match self {
            Self::Short => "the set is cut off",
            Self::Damaged => "the set is damaged: its check does not fit",
            Self::Schema { .. } => "the set is of another schema",
            Self::Content => "the set is sound but not readable",
        }
    }
}

impl fmt::Display for SetError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.sentence())?;
        match self {
            Self::Schema { found } => write!(f, " ({found}, expected {SCHEMA})"),
            _ => Ok(()),
        }
    }
}

impl core::error::Error for SetError {}

worded! {
    /// Reason of a refusal.
    Refusal, sentence:
    Moving "the drive is not at rest";
    NoDraft "no new set has been begun";
    Length "the new set is too long or not all there";
    Piece "a piece of the new set is no multiple of eight bytes";
    Flash "the flash failed";
    Damaged "the new set arrived damaged";
    Schema "the new set is of another schema than the firmware";
    Lost "the set in force is damaged: restore the image's, or one from a file";
    NotService "the drive is not in the service mode, which it enters from idle alone";
    Duty "the service mode drives one motor at a time, with a small duty";
    Busy "too many commands wait for the control tick";
}

impl From<SetError> for Refusal {
    fn from(error: SetError) -> Self {
        match error {
            SetError::Schema { .. } => Self::Schema,
            _ => Self::Damaged,
        }
    }
}

/// A set whose check fits.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ParameterSet<'a> {
    header: Header,
    rig: &'a [u8],
    /// Behind the rig, without the check.
    constants: &'a [u8],
}

impl<'a> ParameterSet<'a> {
    /// Checks the bytes of a set; trailing bytes are an error.
    ///
    /// # Errors
    /// [`SetError`] for anything but a complete set of this layout.
    pub fn open(bytes: &'a [u8]) -> Result<Self, SetError> {
        let set = Self::open_any(bytes)?;
        match set.header.schema {
            SCHEMA => Ok(set),
            found => Err(SetError::Schema { found }),
        }
    }

    /// The same for any layout; of another one only [`header`](Self::header) and
    /// [`rig`](Self::rig) can be read.
    ///
    /// # Errors
    /// [`SetError`] if the bytes are not a complete set.
    pub fn open_any(bytes: &'a [u8]) -> Result<Self, SetError> {
        let (content, sum) = bytes.split_last_chunk::<CHECK>().ok_or(SetError::Short)?;
        if crc32(content) != u32::from_le_bytes(*sum) {
            return Err(SetError::Damaged);
        }
        let (header, body) =
            postcard::take_from_bytes::<Header>(content).map_err(|_| SetError::Content)?;
        let parts = body.split_at_checked(header.rig_length.into());
        let (rig, constants) = parts.ok_or(SetError::Content)?;
        Ok(Self { header, rig, constants })
    }

    /// Head of the set.
    pub const fn header(&self) -> &Header {
        &self.header
    }

    /// Reads the controller into its final place; returns the rest of the constants. A return
    /// by value would copy it at every level of its parts, and the copies would be most of the
    /// stack; the same holds for the planner.
    ///
    /// # Errors
    /// [`SetError::Content`] if the bytes are not one; `place` then holds anything.
    #[inline(never)]
    pub fn read_controller(&self, place: &mut Controller) -> Result<Rest<'a>, SetError> {
        into(self.constants, place).map(Rest)
    }

    /// The rig that the constants were made from, SI.
    ///
    /// # Errors
    /// [`SetError::Content`] if the bytes are not one.
    pub fn rig(&self) -> Result<Rig, SetError> {
        complete(self.rig).ok_or(SetError::Content)
    }
}

/// The constants of a set after the controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rest<'a>(&'a [u8]);

impl Rest<'_> {
    /// Reads the planner into its final place.
    ///
    /// # Errors
    /// [`SetError::Content`] if the bytes are not one; `place` then holds anything.
    #[inline(never)]
    pub fn read_planner(self, place: &mut Planner) -> Result<(), SetError> {
        into(self.0, place)?.is_empty().then_some(()).ok_or(SetError::Content)
    }
}

/// Reads a value into its final place; returns the bytes after it.
fn into<'a, T: Deserialize<'a>>(bytes: &'a [u8], place: &mut T) -> Result<&'a [u8], SetError> {
    let mut bytes = postcard::Deserializer::from_bytes(bytes);
    T::deserialize_in_place(&mut bytes, place).map_err(|_| SetError::Content)?;
    bytes.finalize().map_err(|_| SetError::Content)
}

#[cfg(test)]
mod tests {
    use super::super::compile;
    use super::*;

    fn set(name: &str, rig: &Rig) -> Vec<u8> {
        compile(name, rig).expect("a sound rig").to_vec()
    }

    /// This content with its check.
    fn signed(content: &[u8]) -> Vec<u8> {
        [content, &crc32(content).to_le_bytes()].concat()
    }

    #[test]
    fn what_was_compiled_is_read_back_to_the_bit() {
        for (name, rig) in [("prototype", Rig::prototype()), ("fe", Rig::fe())] {
            let bytes = set(name, &rig);
            let set = ParameterSet::open(&bytes).expect("a set");
            assert_eq!(set.header().name.as_str(), name);
            let (mut controller, mut planner) = (Controller::default(), Planner::default());
            let rest = set.read_controller(&mut controller).expect("a controller");
            rest.read_planner(&mut planner).expect("a planner");
            assert_eq!(controller, Controller::try_build(&rig).unwrap());
            assert_eq!(planner, Planner::try_build(&rig).unwrap());
            assert_eq!(set.rig().unwrap(), rig);
        }
    }

    #[test]
    fn hashes_tell_parameters_from_calibration() {
        let header = |rig: &Rig| ParameterSet::open(&set("a", rig)).unwrap().header().clone();
        let (mut other, plain) = (Rig::prototype(), header(&Rig::prototype()));
        other.drive.cruise_speed_mm_s += 0.001;
        let faster = header(&other);
        assert_ne!(faster.parameters, plain.parameters);
        assert_eq!(faster.calibration, plain.calibration);
        other.sense.angle_zero_code += 1.0;
        assert_ne!(header(&other).calibration, plain.calibration);
    }

    #[test]
    fn a_set_of_another_layout_is_refused_by_number() {
        let mut bytes = set("a", &Rig::prototype());
        bytes[0] = SCHEMA as u8 + 1;
        let bytes = signed(&bytes[..bytes.len() - CHECK]);
        assert_eq!(ParameterSet::open(&bytes), Err(SetError::Schema { found: SCHEMA + 1 }));
        let old = ParameterSet::open_any(&bytes).unwrap();
        assert_eq!(old.header().name.as_str(), "a");
        assert_eq!(old.rig().unwrap(), Rig::prototype());
    }

    #[test]
    fn constants_with_more_behind_them_are_not_a_set() {
        let bytes = set("a", &Rig::prototype());
        let bytes = signed(&[&bytes[..bytes.len() - CHECK], &[0]].concat());
        let set = ParameterSet::open(&bytes).unwrap();
        let rest = set.read_controller(&mut Controller::default()).unwrap();
        assert_eq!(rest.read_planner(&mut Planner::default()), Err(SetError::Content));
    }

    #[test]
    fn every_flipped_bit_is_found() {
        let mut bytes = set("prototype", &Rig::prototype());
        for at in 0..bytes.len() {
            bytes[at] ^= 1 << (at % 8);
            assert!(ParameterSet::open(&bytes).is_err(), "byte {at}");
            bytes[at] ^= 1 << (at % 8);
        }
        assert!(ParameterSet::open(&bytes).is_ok());
    }
}
