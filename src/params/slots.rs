//! Two places in flash for a set, so that a whole one is always there.
//!
//! A set is written into the place that is not in force and takes force with the last
//! double word written, its seal. Power may fail at any moment: before the seal the old
//! set is in force, after it the new one, and of a seal half written neither the magic
//! nor the sequence counts unless the set behind it is whole.
//!
//! ```text
//! 0   seal: magic, sequence number       (written last)
//! 8   length of the set, its complement
//! 16  the set, filled up with 0xFF to a double word
//! ```

use super::{MAX_SET, ParameterSet, Rest, SetError};

/// Bytes of one place: two pages of the chip's flash.
pub const SLOT_BYTES: usize = 4096;

/// Bytes that are erased at once.
pub const PAGE_BYTES: usize = 2048;

/// Bytes that are programmed at once.
pub const WORD_BYTES: usize = 8;

/// Bytes before the set.
const PREFIX: usize = 2 * WORD_BYTES;

/// First half of a seal.
const MAGIC: u32 = 0x5053_4931;

const _: () = assert!(PREFIX + MAX_SET <= SLOT_BYTES);

/// One of the two places.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Slot {
    /// The lower.
    A,
    /// The upper.
    B,
}

impl Slot {
    /// The other one.
    #[must_use]
    pub const fn other(self) -> Self {
        match self {
            Self::A => Self::B,
            Self::B => Self::A,
        }
    }
}

/// The flash refused or failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FlashFault;

/// Flash that holds both places, mapped into memory.
pub trait SetMemory {
    /// The place as it is now, [`SLOT_BYTES`] long.
    fn bytes(&self, slot: Slot) -> &[u8];

    /// Erases one page of a place to 0xFF; takes about 25 ms.
    ///
    /// # Errors
    /// [`FlashFault`] if the page is not blank afterwards.
    async fn erase(&mut self, slot: Slot, page: usize) -> Result<(), FlashFault>;

    /// Programs a double word at `offset` bytes, a multiple of eight, which has to be
    /// blank; takes about 0.1 ms.
    ///
    /// # Errors
    /// [`FlashFault`] if it was not taken.
    async fn program(
        &mut self,
        slot: Slot,
        offset: usize,
        word: [u8; WORD_BYTES],
    ) -> Result<(), FlashFault>;
}

/// A whole set in its place.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Stored<'a> {
    /// Where.
    pub slot: Slot,
    /// One more than that of the set before; wraps.
    pub sequence: u32,
    /// The set as it was written.
    pub set: &'a [u8],
}

/// The set in force: the younger of those that are whole; none if none is.
pub fn stored(memory: &impl SetMemory) -> Option<Stored<'_>> {
    let whole = |slot| read(memory.bytes(slot), slot);
    match (whole(Slot::A), whole(Slot::B)) {
        (Some(a), Some(b)) => {
            let b_is_younger = b.sequence.wrapping_sub(a.sequence) as i32 > 0;
            Some(if b_is_younger { b } else { a })
        }
        (a, b) => a.or(b),
    }
}

fn read(bytes: &[u8], slot: Slot) -> Option<Stored<'_>> {
    let number = |at: usize| Some(u32::from_le_bytes(*bytes.get(at..)?.first_chunk()?));
    let length = number(8)?;
    if number(0)? != MAGIC || number(12)? != !length {
        return None;
    }
    let set = bytes.get(PREFIX..)?.get(..length as usize)?;
    // Of another schema it is still the user's, and told apart by whoever opens it.
    ParameterSet::open_any(set).ok()?;
    Some(Stored { slot, sequence: number(4)?, set })
}

/// A set on its way into the place that is not in force.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Draft {
    slot: Slot,
    sequence: u32,
    length: usize,
    /// Bytes programmed so far.
    written: usize,
}

/// Why a draft was not taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DraftError {
    /// Longer than [`MAX_SET`], or more pieces than announced.
    Length,
    /// A piece other than the last is no multiple of eight bytes.
    Piece,
    /// The flash failed.
    Flash,
    /// What stands in the flash is not a sound set of this schema.
    Set(SetError),
}

impl From<FlashFault> for DraftError {
    fn from(FlashFault: FlashFault) -> Self {
        Self::Flash
    }
}

impl Draft {
    /// Clears the place that is not in force for a set of `length` bytes. Of the pages
    /// the one with the seal goes first, so that no old set is left half erased under
    /// its seal.
    ///
    /// # Errors
    /// [`DraftError`]; the set in force stays.
    pub async fn begin(memory: &mut impl SetMemory, length: usize) -> Result<Self, DraftError> {
        if length > MAX_SET {
            return Err(DraftError::Length);
        }
        let (slot, sequence) = stored(memory)
            .map_or((Slot::A, 1), |old| (old.slot.other(), old.sequence.wrapping_add(1)));
        for page in 0..SLOT_BYTES / PAGE_BYTES {
            memory.erase(slot, page).await?;
        }
        Ok(Self { slot, sequence, length, written: 0 })
    }

    /// Bytes that are still to come.
    #[must_use]
    pub const fn missing(&self) -> usize {
        self.length - self.written
    }

    /// Programs the next piece: whole double words, but for the last.
    ///
    /// # Errors
    /// [`DraftError`]; the set in force stays.
    pub async fn append(
        &mut self,
        memory: &mut impl SetMemory,
        piece: &[u8],
    ) -> Result<(), DraftError> {
        if piece.len() > self.missing() {
            return Err(DraftError::Length);
        }
        if !piece.len().is_multiple_of(WORD_BYTES) && piece.len() != self.missing() {
            return Err(DraftError::Piece);
        }
        for part in piece.chunks(WORD_BYTES) {
            let mut word = [0xFF; WORD_BYTES];
            word.iter_mut().zip(part).for_each(|(to, from)| *to = *from);
            memory.program(self.slot, PREFIX + self.written, word).await?;
            self.written += part.len();
        }
        Ok(())
    }

    /// What has been written, if it is a whole and sound set of this schema.
    ///
    /// # Errors
    /// [`DraftError::Length`] if pieces are missing, [`DraftError::Set`] otherwise.
    pub fn check<'m>(&self, memory: &'m impl SetMemory) -> Result<ParameterSet<'m>, DraftError> {
        if self.missing() > 0 {
            return Err(DraftError::Length);
        }
        let bytes = memory.bytes(self.slot).get(PREFIX..PREFIX + self.length);
        let set = ParameterSet::open(bytes.ok_or(DraftError::Length)?).map_err(DraftError::Set)?;
        let rest = behind_controller(&set).map_err(DraftError::Set)?;
        read_planner(rest).map_err(DraftError::Set)?;
        Ok(set)
    }

    /// Checks the set and puts it in force.
    ///
    /// # Errors
    /// [`DraftError`]; the set that was in force stays.
    pub async fn seal(self, memory: &mut impl SetMemory) -> Result<(), DraftError> {
        self.check(memory)?;
        let length = self.length as u32;
        memory.program(self.slot, 8, pair(length, !length)).await?;
        memory.program(self.slot, 0, pair(MAGIC, self.sequence)).await?;
        Ok(())
    }
}

/// What stands behind a readable controller; like the planner in a frame of its own, so that
/// the stack never holds both.
#[inline(never)]
fn behind_controller<'a>(set: &ParameterSet<'a>) -> Result<Rest<'a>, SetError> {
    set.controller().map(|(_, rest)| rest)
}

#[inline(never)]
fn read_planner(rest: Rest<'_>) -> Result<(), SetError> {
    rest.planner().map(drop)
}

/// A place as it stands with this set in force under this sequence number, for flash
/// that is written from outside; none if the set is too long.
#[must_use]
pub fn place(set: &[u8], sequence: u32) -> Option<[u8; SLOT_BYTES]> {
    let length = u32::try_from(set.len()).ok()?;
    let mut bytes = [0xFF; SLOT_BYTES];
    bytes.get_mut(..WORD_BYTES)?.copy_from_slice(&pair(MAGIC, sequence));
    bytes.get_mut(WORD_BYTES..PREFIX)?.copy_from_slice(&pair(length, !length));
    bytes.get_mut(PREFIX..PREFIX + set.len())?.copy_from_slice(set);
    Some(bytes)
}

fn pair(low: u32, high: u32) -> [u8; WORD_BYTES] {
    (u64::from(high) << 32 | u64::from(low)).to_le_bytes()
}

#[cfg(test)]
pub(super) mod tests;
