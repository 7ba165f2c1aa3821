//! Two slots in flash for a parameter set, so that one of them always holds an intact one.
//!
//! A set is written into the slot that is not in force. It comes into force with its header, the
//! last double word written. Power may fail at any moment: before the header the old set is in
//! force, after it the new one; a half-written header counts only if the set behind it is intact.
//!
//! ```text
//! 0   header: magic, sequence number     (written last)
//! 8   length of the set, fold of the sequence number, their complement
//! 16  the set, filled up with 0xFF to a double word
//! ```
//!
//! A later bit flip in the set in force loses that set. Neither the one before it nor that of
//! the image replaces it silently, because nobody chose them. An uncommitted slot is skipped. A
//! committed slot that is no longer intact is reported, unless the other slot shows that it was
//! out of force. The fold guards the sequence number: alone, a flipped bit in it would make the
//! spare set the younger one.
//!
//! Not `sequential-storage`: it skips an item that is damaged, so that an older set would come
//! into force unasked, and it copies an item into RAM as a whole, to read it and to store it. A
//! set is read where it lies, and arrives in pieces.

mod mend;

pub use mend::mend;

use super::{MAX_SET, ParameterSet, Refusal, Rest, SetError};
use crate::model::Planner;
pub use crate::restart::page::{PAGE_BYTES, WORD_BYTES};
use crate::tick::Controller;

/// Bytes of one slot: two pages of the chip's flash.
pub const SLOT_BYTES: usize = 4096;

/// Bytes before the set.
const PREFIX: usize = 2 * WORD_BYTES;

/// First word of the header.
const MAGIC: u32 = 0x5053_4931;

const _: () = assert!(PREFIX + MAX_SET <= SLOT_BYTES);

/// One of the two slots.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Slot {
    /// The lower.
    A,
    /// The upper.
    B,
}

impl Slot {
    /// The other one.
    pub const fn other(self) -> Self {
        if matches!(self, Self::A) { Self::B } else { Self::A }
    }
}

/// Flash that holds both slots, mapped into memory.
pub trait SetMemory {
    /// The content of a slot, [`SLOT_BYTES`] long.
    fn bytes(&self, slot: Slot) -> &[u8];

    /// Whether every double word of a slot can be read without an error that the chip cannot
    /// correct, as after a write that lost its power.
    fn is_readable(&self, _slot: Slot) -> bool {
        true
    }

    /// Erases one page of a slot to 0xFF; takes about 25 ms.
    ///
    /// # Errors
    /// [`Refusal::Flash`] if the page is not blank afterwards.
    async fn erase(&mut self, slot: Slot, page: usize) -> Result<(), Refusal>;

    /// Programs a double word at `offset` bytes, a multiple of eight, which has to be
    /// blank; takes about 0.1 ms.
    ///
    /// # Errors
    /// [`Refusal::Flash`] if it was not taken.
    async fn program(
        &mut self,
        slot: Slot,
        offset: usize,
        word: [u8; WORD_BYTES],
    ) -> Result<(), Refusal>;
}

/// An intact set in its slot.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Stored<'a> {
    /// The slot.
    pub slot: Slot,
    /// One more than the sequence number of the set before; wraps.
    pub sequence: u32,
    /// The set.
    pub set: &'a [u8],
}

/// The set in force, in this slot, is damaged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Damaged(pub Slot);

impl From<Damaged> for Refusal {
    fn from(_: Damaged) -> Self {
        Self::Lost
    }
}

/// The set in force: the younger intact one; none if none was ever stored.
///
/// # Errors
/// [`Damaged`] if a committed slot is not intact and not known to have been out of force.
pub fn stored(memory: &impl SetMemory) -> Result<Option<Stored<'_>>, Damaged> {
    use Found::{Broken, Intact, Uncommitted};
    let found = |slot| inspect(memory.bytes(slot), slot).unwrap_or(Uncommitted);
    match (found(Slot::A), found(Slot::B)) {
        (Intact(a), Intact(b)) => {
            let b_is_younger = b.sequence.wrapping_sub(a.sequence) as i32 > 0;
            Ok(Some(if b_is_younger { b } else { a }))
        }
        (Intact(set), other) | (other, Intact(set)) => {
            let lost = other.may_follow(set.sequence);
            if lost { Err(Damaged(set.slot.other())) } else { Ok(Some(set)) }
        }
        (Broken { .. }, _) => Err(Damaged(Slot::A)),
        (_, Broken { .. }) => Err(Damaged(Slot::B)),
        (Uncommitted, Uncommitted) => Ok(None),
    }
}

/// Content of a slot.
enum Found<'a> {
    /// No committed set.
    Uncommitted,
    /// An intact set.
    Intact(Stored<'a>),
    /// A set that was committed and is damaged.
    Broken {
        sequence: u32,
        /// Fold of the sequence number, if it can be read.
        fold: Option<u16>,
    },
}

impl Found<'_> {
    /// Whether this slot is broken, and its set may be younger than this sequence number. Only
    /// one thing is broken: either the fold or the sequence number itself is right.
    const fn may_follow(&self, before: u32) -> bool {
        match *self {
            Self::Broken { fold: Some(found), .. } => found != fold(before.wrapping_sub(1)),
            Self::Broken { sequence, fold: None } => before.wrapping_sub(sequence) as i32 <= 0,
            Self::Uncommitted | Self::Intact(_) => false,
        }
    }
}

/// Fold of a sequence number, which detects any flipped bit of it.
const fn fold(sequence: u32) -> u16 {
    (sequence ^ sequence >> 16) as u16
}

/// Length and fold of a sequence number in a word.
const fn length_word(length: u32, sequence: u32) -> u32 {
    length | (fold(sequence) as u32) << 16
}

fn inspect(bytes: &[u8], slot: Slot) -> Option<Found<'_>> {
    let number = |at: usize| Some(u32::from_le_bytes(*bytes.get(at..)?.first_chunk()?));
    let (magic, sequence, word) = (number(0)?, number(4)?, number(8)?);
    // A header half written or half erased differs by more than one bit.
    if (magic ^ MAGIC).count_ones() > 1 {
        return Some(Found::Uncommitted);
    }
    let sound = number(12)? == !word;
    // Sets of earlier firmware have no fold.
    let known = Some((word >> 16) as u16).filter(|found| sound && *found != 0);
    // In a header half written the sequence number may be blank.
    let named = sequence == u32::MAX || known.is_none_or(|found| found == fold(sequence));
    let set = bytes.get(PREFIX..)?.get(..(word & 0xFFFF) as usize);
    let intact = set.filter(|set| {
        // A set of another schema is still the user's; opening it reports that.
        magic == MAGIC && sound && named && ParameterSet::open_any(set).is_ok()
    });
    Some(match intact {
        Some(set) => Found::Intact(Stored { slot, sequence, set }),
        None => Found::Broken { sequence, fold: known },
    })
}

/// A set that is being written into the slot that is not in force.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Draft {
    slot: Slot,
    sequence: u32,
    length: usize,
    /// Bytes programmed so far.
    written: usize,
}

impl Draft {
    /// Erases the slot that is not in force, or is damaged, for a set of `length` bytes. The
    /// page with the header goes first, so that no half-erased set keeps its header.
    ///
    /// # Errors
    /// [`Refusal`]; the set in force stays.
    pub async fn begin(memory: &mut impl SetMemory, length: usize) -> Result<Self, Refusal> {
        if length > MAX_SET {
            return Err(Refusal::Length);
        }
        let (slot, sequence) = match stored(memory) {
            Ok(Some(old)) => (old.slot.other(), old.sequence.wrapping_add(1)),
            Ok(None) => (Slot::A, 1),
            Err(Damaged(slot)) => match inspect(memory.bytes(slot.other()), slot.other()) {
                Some(Found::Intact(old)) => (slot, old.sequence.wrapping_add(1)),
                _ => (slot, 1),
            },
        };
        for page in 0..SLOT_BYTES / PAGE_BYTES {
            memory.erase(slot, page).await?;
        }
        Ok(Self { slot, sequence, length, written: 0 })
    }

    /// Bytes still to come.
    pub const fn missing(&self) -> usize {
        self.length - self.written
    }

    /// Programs the next piece: complete double words, except the last.
    ///
    /// # Errors
    /// [`Refusal`]; the set in force stays.
    pub async fn append(&mut self, to: &mut impl SetMemory, piece: &[u8]) -> Result<(), Refusal> {
        if piece.len() > self.missing() {
            return Err(Refusal::Length);
        }
        if !piece.len().is_multiple_of(WORD_BYTES) && piece.len() != self.missing() {
            return Err(Refusal::Piece);
        }
        for part in piece.chunks(WORD_BYTES) {
            let mut word = [0xFF; WORD_BYTES];
            word.iter_mut().zip(part).for_each(|(to, from)| *to = *from);
            to.program(self.slot, PREFIX + self.written, word).await?;
            self.written += part.len();
        }
        Ok(())
    }

    /// Checks the set and puts it in force.
    ///
    /// # Errors
    /// [`Refusal::Length`] if pieces are missing, another one otherwise; the set that was in force
    /// stays.
    pub async fn seal(self, memory: &mut impl SetMemory) -> Result<(), Refusal> {
        if self.missing() > 0 {
            return Err(Refusal::Length);
        }
        let bytes = memory.bytes(self.slot).get(PREFIX..PREFIX + self.length);
        let set = ParameterSet::open(bytes.ok_or(Refusal::Length)?)?;
        check_planner(check_controller(&set)?)?;
        let word = length_word(self.length as u32, self.sequence);
        memory.program(self.slot, 8, pair(word, !word)).await?;
        memory.program(self.slot, 0, pair(MAGIC, self.sequence)).await?;
        Ok(())
    }
}

/// Reads a controller, in a frame of its own: the stack never holds it and the planner.
#[inline(never)]
fn check_controller<'a>(set: &ParameterSet<'a>) -> Result<Rest<'a>, SetError> {
    set.read_controller(&mut Controller::default())
}

#[inline(never)]
fn check_planner(rest: Rest<'_>) -> Result<(), SetError> {
    rest.read_planner(&mut Planner::default())
}

/// A slot with this set in force under this sequence number, for flash that is written from
/// outside; none if the set is too long.
pub fn slot_image(set: &[u8], sequence: u32) -> Option<[u8; SLOT_BYTES]> {
    let word = length_word(u16::try_from(set.len()).ok()?.into(), sequence);
    let mut bytes = [0xFF; SLOT_BYTES];
    bytes.get_mut(..WORD_BYTES)?.copy_from_slice(&pair(MAGIC, sequence));
    bytes.get_mut(WORD_BYTES..PREFIX)?.copy_from_slice(&pair(word, !word));
    bytes.get_mut(PREFIX..PREFIX + set.len())?.copy_from_slice(set);
    Some(bytes)
}

fn pair(low: u32, high: u32) -> [u8; WORD_BYTES] {
    (u64::from(high) << 32 | u64::from(low)).to_le_bytes()
}

#[cfg(test)]
pub(super) mod tests;
