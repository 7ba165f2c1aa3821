//! What a lost supply left half written, made readable before the drive runs.
//!
//! The chip's error correction reports such double words whenever they are read, and once the
//! drive runs it then cuts the bridges.

use super::{Draft, PAGE_BYTES, Refusal, SLOT_BYTES, SetMemory, Slot, WORD_BYTES, stored};

/// Erases what cannot be read. A set in force that is intact, though a part of its slot is not,
/// is saved again first, in the other slot. A damaged set in force stays as it is: the start
/// reports it.
///
/// # Errors
/// [`Refusal`] if the set cannot be saved again, or the flash failed.
pub async fn mend(memory: &mut impl SetMemory) -> Result<(), Refusal> {
    let Ok(in_force) = stored(memory) else { return Ok(()) };
    if let Some((slot, length)) = in_force.map(|stored| (stored.slot, stored.set.len()))
        && !memory.is_readable(slot)
    {
        let end = super::PREFIX + length;
        let mut draft = Draft::begin(memory, length).await?;
        while draft.missing() > 0 {
            let rest = memory.bytes(slot).get(end - draft.missing()..end).ok_or(Refusal::Length)?;
            let word: heapless::Vec<u8, WORD_BYTES> =
                rest.iter().copied().take(WORD_BYTES).collect();
            draft.append(memory, &word).await?;
        }
        draft.seal(memory).await?;
    }
    let in_force = stored(memory)?.map(|stored| stored.slot);
    for slot in [Slot::A, Slot::B] {
        if in_force != Some(slot) && !memory.is_readable(slot) {
            for page in 0..SLOT_BYTES / PAGE_BYTES {
                memory.erase(slot, page).await?;
            }
        }
    }
    Ok(())
}
