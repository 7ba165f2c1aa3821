//! From a rig to the set that the board carries; runs on the host.

use core::fmt;

use serde::Serialize;

use super::set::{Header, MAX_NAME, SCHEMA};
use crate::log::crc32;
use crate::model::Planner;
use crate::rig::{Rig, RigError};
use crate::tick::Controller;

/// Why no set could be made.
#[derive(Clone, Debug, PartialEq)]
pub enum CompileError {
    /// The rig is not sound.
    Rig(RigError),
    /// The name is longer than [`MAX_NAME`] bytes.
    Name,
    /// The set is longer than the room for it.
    Room,
}

impl fmt::Display for CompileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Rig(error) => error.fmt(f),
            Self::Name => write!(f, "the name of the rig: expected at most {MAX_NAME} bytes"),
            Self::Room => f.write_str("the set does not fit its slot"),
        }
    }
}

impl core::error::Error for CompileError {}

impl From<RigError> for CompileError {
    fn from(error: RigError) -> Self {
        Self::Rig(error)
    }
}

/// Writes the set of this rig to the start of `room`; gives its length, bytes.
///
/// # Errors
/// [`CompileError`] if the rig is not sound, its name too long or `room` too small.
pub fn compile(name: &str, rig: &Rig, room: &mut [u8]) -> Result<usize, CompileError> {
    let controller = Controller::try_build(rig)?;
    let planner = Planner::try_build(rig)?;
    let name = heapless::String::try_from(name).map_err(|_| CompileError::Name)?;
    let calibration = crc32(part(&rig.sense, room)?);
    let parameters = part(rig, room)?;
    let rig_length = parameters.len() as u16;
    let parameters = crc32(parameters);
    let header = Header { schema: SCHEMA, name, rig_length, parameters, calibration };
    let length = part(&(header, rig, controller, planner), room)?.len();
    let sum = crc32(&room[..length]).to_le_bytes();
    let check = room.get_mut(length..length + sum.len()).ok_or(CompileError::Room)?;
    check.copy_from_slice(&sum);
    Ok(length + sum.len())
}

/// A value as postcard, at the start of `room`.
fn part<'r>(value: &impl Serialize, room: &'r mut [u8]) -> Result<&'r [u8], CompileError> {
    postcard::to_slice(value, room).map(|written| &*written).map_err(|_| CompileError::Room)
}

#[cfg(test)]
mod tests {
    use super::super::MAX_SET;
    use super::*;

    #[test]
    fn the_set_in_the_image_is_the_prototypes() {
        let mut room = [0; MAX_SET];
        let length = compile("prototype", &Rig::prototype(), &mut room).unwrap();
        let carried = &include_bytes!("prototype.set")[..];
        assert!(room[..length] == *carried, "stale: `cargo rig constants --set` writes it anew");
    }

    #[test]
    fn what_cannot_be_is_named() {
        let mut room = [0; MAX_SET];
        let rig = Rig::prototype();
        let long = "a name that is longer than any";
        assert_eq!(compile(long, &rig, &mut room), Err(CompileError::Name));
        assert_eq!(compile("a", &rig, &mut room[..1000]), Err(CompileError::Room));
        let length = compile("a", &rig, &mut room).unwrap();
        assert!(length <= MAX_SET);
        assert_eq!(compile("a", &rig, &mut room[..length - 1]), Err(CompileError::Room));
        let mut broken = rig;
        broken.tread.tau_s = -1.0;
        let error = compile("a", &broken, &mut room).unwrap_err();
        assert!(error.to_string().contains("tread.tau_s"), "{error}");
    }
}
