//! A set of parameters as bytes: what it is, the rig, the constants made of it, a check.
//!
//! ```text
//! header | rig | controller | planner | CRC-32 of all before it, little end first
//! ```
//! All but the last four bytes is postcard. The rig stands first, so that the host can
//! read it out of a set whose constants are of another schema, and make the set anew.

use core::fmt;

use serde::{Deserialize, Serialize};

use crate::log::crc32;
use crate::model::Planner;
use crate::rig::Rig;
use crate::tick::Controller;

/// Layout of the constants. Raised with every change of a type that a set holds; a set
/// of another number is not read but refused, and the host makes it anew from its rig.
pub const SCHEMA: u16 = 5;

/// Longest name of a set, bytes.
pub const MAX_NAME: usize = 24;

/// Bytes of the check.
const CHECK: usize = 4;

/// What a set says of itself.
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
    /// Fewer bytes than the least set.
    Short,
    /// The check does not fit the bytes.
    Damaged,
    /// Sound, but of another layout.
    Schema {
        /// That of the set.
        found: u16,
    },
    /// The check fits and the content does not: not written by this program.
    Content,
}

impl SetError {
    /// What is wrong, in words.
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

/// A set whose check has been found right.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ParameterSet<'a> {
    header: Header,
    rig: &'a [u8],
    /// Behind the rig, without the check.
    constants: &'a [u8],
}

impl<'a> ParameterSet<'a> {
    /// Checks the bytes of a set; bytes behind it are not allowed.
    ///
    /// # Errors
    /// [`SetError`] for anything but a whole set of this layout.
    pub fn open(bytes: &'a [u8]) -> Result<Self, SetError> {
        let set = Self::open_any(bytes)?;
        match set.header.schema {
            SCHEMA => Ok(set),
            found => Err(SetError::Schema { found }),
        }
    }

    /// The same for any layout: of another one, the constants mean nothing here, but
    /// [`header`](Self::header) and [`rig`](Self::rig) do.
    ///
    /// # Errors
    /// [`SetError`] if the bytes are not a whole set.
    pub fn open_any(bytes: &'a [u8]) -> Result<Self, SetError> {
        let (content, sum) = bytes.split_last_chunk::<CHECK>().ok_or(SetError::Short)?;
        if crc32(content) != u32::from_le_bytes(*sum) {
            return Err(SetError::Damaged);
        }
        let (header, body) = take::<Header>(content)?;
        let parts = body.split_at_checked(header.rig_length.into());
        let (rig, constants) = parts.ok_or(SetError::Content)?;
        Ok(Self { header, rig, constants })
    }

    /// What the set says of itself.
    pub const fn header(&self) -> &Header {
        &self.header
    }

    /// The controller, and what is left of the constants.
    ///
    /// # Errors
    /// [`SetError::Content`] if the bytes are not one.
    pub fn controller(&self) -> Result<(Controller, Rest<'a>), SetError> {
        let mut controller = Controller::default();
        let rest = self.controller_into(&mut controller)?;
        Ok((controller, rest))
    }

    /// The controller, read where it is to stay, and what is left of the constants. Returned
    /// by value it would be copied at every level of what it is made of, and the copies would
    /// be most of the stack; so it is with the planner.
    ///
    /// # Errors
    /// [`SetError::Content`] if the bytes are not one; in `place` is then anything.
    #[inline(never)]
    pub fn controller_into(&self, place: &mut Controller) -> Result<Rest<'a>, SetError> {
        into(self.constants, place).map(Rest)
    }

    /// The rig that the constants were made from, SI.
    ///
    /// # Errors
    /// [`SetError::Content`] if the bytes are not one.
    pub fn rig(&self) -> Result<Rig, SetError> {
        whole(self.rig)
    }
}

/// The constants of a set behind the controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rest<'a>(&'a [u8]);

impl Rest<'_> {
    /// The planner.
    ///
    /// # Errors
    /// [`SetError::Content`] if the bytes are not one.
    pub fn planner(self) -> Result<Planner, SetError> {
        let mut planner = Planner::default();
        self.planner_into(&mut planner)?;
        Ok(planner)
    }

    /// The planner, read where it is to stay.
    ///
    /// # Errors
    /// [`SetError::Content`] if the bytes are not one; in `place` is then anything.
    #[inline(never)]
    pub fn planner_into(self, place: &mut Planner) -> Result<(), SetError> {
        match into(self.0, place)? {
            [] => Ok(()),
            _ => Err(SetError::Content),
        }
    }
}

/// Reads a value where it is to stay; what is left of the bytes.
fn into<'a, T: Deserialize<'a>>(bytes: &'a [u8], place: &mut T) -> Result<&'a [u8], SetError> {
    let mut bytes = postcard::Deserializer::from_bytes(bytes);
    T::deserialize_in_place(&mut bytes, place).map_err(|_| SetError::Content)?;
    bytes.finalize().map_err(|_| SetError::Content)
}

fn take<'a, T: Deserialize<'a>>(bytes: &'a [u8]) -> Result<(T, &'a [u8]), SetError> {
    postcard::take_from_bytes(bytes).map_err(|_| SetError::Content)
}

fn whole<'a, T: Deserialize<'a>>(bytes: &'a [u8]) -> Result<T, SetError> {
    match take(bytes)? {
        (value, []) => Ok(value),
        _ => Err(SetError::Content),
    }
}

#[cfg(test)]
mod tests {
    use super::super::{MAX_SET, compile};
    use super::*;

    fn set(name: &str, rig: &Rig) -> Vec<u8> {
        let mut room = [0; MAX_SET];
        let length = compile(name, rig, &mut room).expect("a sound rig");
        room[..length].to_vec()
    }

    #[test]
    fn what_was_compiled_is_read_back_to_the_bit() {
        for (name, rig) in [("prototype", Rig::prototype()), ("fe", Rig::fe())] {
            let bytes = set(name, &rig);
            let set = ParameterSet::open(&bytes).expect("a set");
            assert_eq!(set.header().name.as_str(), name);
            let (controller, rest) = set.controller().expect("a controller");
            assert_eq!(controller, Controller::try_build(&rig).unwrap());
            assert_eq!(rest.planner().unwrap(), Planner::try_build(&rig).unwrap());
            assert_eq!(set.rig().unwrap(), rig);
        }
    }

    #[test]
    fn hashes_tell_parameters_from_calibration() {
        let header = |rig: &Rig| ParameterSet::open(&set("a", rig)).unwrap().header().clone();
        let (mut other, plain) = (Rig::prototype(), header(&Rig::prototype()));
        other.drive.cruise_speed_mm_s += 0.5;
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
        let end = bytes.len() - CHECK;
        let sum = crc32(&bytes[..end]).to_le_bytes();
        bytes[end..].copy_from_slice(&sum);
        assert_eq!(ParameterSet::open(&bytes), Err(SetError::Schema { found: SCHEMA + 1 }));
        let old = ParameterSet::open_any(&bytes).unwrap();
        assert_eq!(old.header().name.as_str(), "a");
        assert_eq!(old.rig().unwrap(), Rig::prototype());
    }

    #[test]
    fn constants_with_more_behind_them_are_not_a_set() {
        let mut bytes = set("a", &Rig::prototype());
        bytes.truncate(bytes.len() - CHECK);
        bytes.push(0);
        let sum = crc32(&bytes).to_le_bytes();
        bytes.extend(sum);
        let (_, rest) = ParameterSet::open(&bytes).unwrap().controller().unwrap();
        assert_eq!(rest.planner(), Err(SetError::Content));
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
