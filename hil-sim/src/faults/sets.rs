//! Sets of parameters in flash for faults of them: the stored ones, the saved one, and the
//! number of places that a fault can hit.
//!
//! All are of one rig, with slightly more preload in those that are not active, so that no two
//! have the same bytes; each is identified by its name.

use interstage::params::CompileError;
use interstage::params::slots::{PAGE_BYTES, SLOT_BYTES, WORD_BYTES, slot_image};
use interstage::rig::Rig;

use crate::params::set_of;
use crate::scenario::Scenario;

/// Name of the active set.
pub const KEPT: &str = "kept";
/// Name of the one before it.
pub(crate) const SPARE: &str = "spare";
/// Name of the set that is saved.
pub const SAVED: &str = "saved";

/// Number of the active set, which is in the first slot.
const SEQUENCE: u32 = 7;
/// Bits before a set in its slot.
pub(crate) const PREFIX_BITS: u32 = 2 * 8 * WORD_BYTES as u32;
/// Additional preload of the others, N.
const MORE_N: f64 = 1.0 / 64.0;

/// A set as it is stored.
pub fn set(name: &str, rig: &Rig) -> Result<Vec<u8>, CompileError> {
    let mut rig = rig.clone();
    if name != KEPT {
        rig.preload.cruise_n += MORE_N;
    }
    set_of(name, &rig)
}

/// Both slots in flash, with the active and the spare set.
pub fn places(scenario: &Scenario) -> Result<Vec<u8>, CompileError> {
    let mut flash = Vec::with_capacity(2 * SLOT_BYTES);
    for (name, sequence) in [(KEPT, SEQUENCE), (SPARE, SEQUENCE - 1)] {
        let set = set(name, &scenario.rig)?;
        flash.extend(slot_image(&set, sequence).ok_or(CompileError::Room)?);
    }
    Ok(flash)
}

/// Bits of a set of this many bytes, and of its seal and length where it is stored.
pub(crate) const fn bits(length: usize, stored: bool) -> u32 {
    8 * length as u32 + if stored { PREFIX_BITS } else { 0 }
}

/// Operations of the flash in a save of this many bytes: it erases, writes the set, its length
/// and its seal.
pub(crate) const fn operations(length: usize) -> u32 {
    (SLOT_BYTES / PAGE_BYTES + length.div_ceil(WORD_BYTES) + 2) as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use interstage::params::ParameterSet;

    #[test]
    fn no_two_sets_are_alike_and_all_are_sound() {
        let rig = Rig::prototype();
        let sets = [KEPT, SPARE, SAVED].map(|name| set(name, &rig).expect("a sound rig"));
        for (set, name) in sets.iter().zip([KEPT, SPARE, SAVED]) {
            let open = ParameterSet::open(set).expect("a set");
            assert_eq!(open.header().name.as_str(), name);
            assert_eq!(open.rig().expect("a rig") == rig, name == KEPT);
            assert!(bits(set.len(), true) <= 8 * SLOT_BYTES as u32);
        }
        let flash = places(&Scenario::default()).expect("sound");
        assert_eq!(flash.len(), 2 * SLOT_BYTES);
        assert_eq!(flash[16..16 + sets[0].len()], sets[0]);
        assert_eq!(flash[SLOT_BYTES + 16..][..sets[1].len()], sets[1]);
    }
}
