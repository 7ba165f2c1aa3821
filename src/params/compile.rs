//! From a rig to the board's parameter set; runs on the host.

use serde::Serialize;

use super::MAX_SET;
use super::set::{Header, MAX_NAME, SCHEMA};
use crate::log::crc32;
use crate::log::identity::fingerprint;
use crate::model::Planner;
use crate::rig::{Rig, RigError};
use crate::tick::Controller;

/// Why no set can be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CompileError {
    /// The rig is not sound.
    #[error(transparent)]
    Rig(#[from] RigError),
    /// The name is longer than [`MAX_NAME`] bytes.
    #[error("the name of the rig: expected at most {MAX_NAME} bytes")]
    Name,
    /// The set is longer than [`MAX_SET`].
    #[error("the set does not fit its slot")]
    Room,
}

/// The set of this rig, at most [`MAX_SET`] bytes.
///
/// # Errors
/// [`CompileError`] if the rig is not sound, or name or set too long.
pub fn compile(name: &str, rig: &Rig) -> Result<heapless::Vec<u8, MAX_SET>, CompileError> {
    let controller = Controller::try_build(rig)?;
    let planner = Planner::try_build(rig)?;
    let name = heapless::String::try_from(name).map_err(|_| CompileError::Name)?;
    let mut room = [0; MAX_SET];
    let rig_length = part(rig, &mut room)?.len() as u16;
    let (parameters, calibration) = (fingerprint(rig), fingerprint(&rig.sense));
    let header = Header { schema: SCHEMA, name, rig_length, parameters, calibration };
    let content = part(&(header, rig, controller, planner), &mut room)?;
    let mut set = heapless::Vec::from_slice(content).map_err(|_| CompileError::Room)?;
    set.extend_from_slice(&crc32(content).to_le_bytes()).map_err(|_| CompileError::Room)?;
    Ok(set)
}

/// A value as postcard, at the start of `room`.
fn part<'r>(value: &impl Serialize, room: &'r mut [u8]) -> Result<&'r [u8], CompileError> {
    postcard::to_slice(value, room).map(|written| &*written).map_err(|_| CompileError::Room)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_set_in_the_image_is_the_prototypes() {
        let carried = &include_bytes!("prototype.set")[..];
        let set = compile("prototype", &Rig::prototype()).unwrap();
        assert!(set == carried, "stale: `rig-study constants --set` writes it");
    }

    #[test]
    fn a_name_too_long_and_a_broken_rig_are_named() {
        let rig = Rig::prototype();
        let long = "a name that is longer than any";
        assert_eq!(compile(long, &rig), Err(CompileError::Name));
        let mut broken = rig;
        broken.tread.tau_s = -1.0;
        let error = compile("a", &broken).unwrap_err();
        assert!(error.to_string().contains("tread.tau_s"), "{error}");
    }
}
