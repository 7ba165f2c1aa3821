//! Two places in flash for a set, so that a whole one is always there.
//!
//! A set is written into the place that is not in force and takes force with the last
//! double word written, its seal. Power may fail at any moment: before the seal the old
//! set is in force, after it the new one, and of a seal half written neither the magic
//! nor the sequence counts unless the set behind it is whole.
//!
//! ```text
//! 0   seal: magic, sequence number       (written last)
//! 8   length of the set, fold of the sequence number, their complement
//! 16  the set, filled up with 0xFF to a double word
//! ```
//!
//! A bit that turns over later is another matter: the set in force is then lost, and neither
//! the one before it nor the image's takes its place in silence, which nobody chose. What was
//! never sealed is passed over; what was sealed and is not whole any more is told, unless the
//! other place shows that it was out of force. The fold holds the sequence number to that: by
//! itself, a number with a bit turned over would make a spare set the younger.

use super::refusal::Refusal;
use super::{MAX_SET, ParameterSet, Rest, SetError};
pub use crate::restart::page::{PAGE_BYTES, WORD_BYTES};

/// Bytes of one place: two pages of the chip's flash.
pub const SLOT_BYTES: usize = 4096;

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

impl From<FlashFault> for Refusal {
    fn from(FlashFault: FlashFault) -> Self {
        Self::Flash
    }
}

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

/// The set in force is damaged: stored in this place, and not whole any more.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Damaged(pub Slot);

impl From<Damaged> for Refusal {
    fn from(_: Damaged) -> Self {
        Self::Lost
    }
}

/// The set in force: the younger of those that are whole; none if none was ever stored.
///
/// # Errors
/// [`Damaged`] if a place is sealed, not whole, and not known to have been out of force.
pub fn stored(memory: &impl SetMemory) -> Result<Option<Stored<'_>>, Damaged> {
    use Found::{Broken, Open, Whole};
    let found = |slot| look(memory.bytes(slot), slot).unwrap_or(Open);
    match (found(Slot::A), found(Slot::B)) {
        (Whole(a), Whole(b)) => {
            let b_is_younger = b.sequence.wrapping_sub(a.sequence) as i32 > 0;
            Ok(Some(if b_is_younger { b } else { a }))
        }
        (Whole(whole), other) | (other, Whole(whole)) => {
            let lost = other.may_follow(whole.sequence);
            if lost { Err(Damaged(whole.slot.other())) } else { Ok(Some(whole)) }
        }
        (Broken { .. }, _) => Err(Damaged(Slot::A)),
        (_, Broken { .. }) => Err(Damaged(Slot::B)),
        (Open, Open) => Ok(None),
    }
}

/// What stands in a place.
enum Found<'a> {
    /// Nothing that was sealed.
    Open,
    /// A whole set.
    Whole(Stored<'a>),
    /// What was sealed once.
    Broken {
        sequence: u32,
        /// Fold of the sequence number, if it has one that can be read.
        fold: Option<u16>,
    },
}

impl Found<'_> {
    /// Whether this place is broken, and its set may have been stored after that of this
    /// number. One thing is broken: the fold, or else the sequence number itself, is right.
    const fn may_follow(&self, before: u32) -> bool {
        match *self {
            Self::Broken { fold: Some(found), .. } => found != fold(before.wrapping_sub(1)),
            Self::Broken { sequence, fold: None } => before.wrapping_sub(sequence) as i32 <= 0,
            Self::Open | Self::Whole(_) => false,
        }
    }
}

/// Of a sequence number, so that no bit of it turns over unseen.
const fn fold(sequence: u32) -> u16 {
    (sequence ^ sequence >> 16) as u16
}

/// Length and fold of a sequence number in a word.
const fn length_word(length: u32, sequence: u32) -> u32 {
    length | (fold(sequence) as u32) << 16
}

fn look(bytes: &[u8], slot: Slot) -> Option<Found<'_>> {
    let number = |at: usize| Some(u32::from_le_bytes(*bytes.get(at..)?.first_chunk()?));
    let (magic, sequence, word) = (number(0)?, number(4)?, number(8)?);
    // A seal half written or half erased is farther off than one bit.
    if (magic ^ MAGIC).count_ones() > 1 {
        return Some(Found::Open);
    }
    let sound = number(12)? == !word;
    // Sets of earlier firmware have none.
    let known = Some((word >> 16) as u16).filter(|found| sound && *found != 0);
    // Of a seal half written the sequence number may be blank.
    let named = sequence == u32::MAX || known.is_none_or(|found| found == fold(sequence));
    let set = bytes.get(PREFIX..)?.get(..(word & 0xFFFF) as usize);
    let whole = set.filter(|set| {
        // Of another schema it is still the user's, and told apart by whoever opens it.
        magic == MAGIC && sound && named && ParameterSet::open_any(set).is_ok()
    });
    Some(match whole {
        Some(set) => Found::Whole(Stored { slot, sequence, set }),
        None => Found::Broken { sequence, fold: known },
    })
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

impl Draft {
    /// Clears the place that is not in force, or is damaged, for a set of `length` bytes. Of
    /// the pages the one with the seal goes first, so that no old set is left half erased
    /// under its seal.
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
            Err(Damaged(slot)) => match look(memory.bytes(slot.other()), slot.other()) {
                Some(Found::Whole(old)) => (slot, old.sequence.wrapping_add(1)),
                _ => (slot, 1),
            },
        };
        for page in 0..SLOT_BYTES / PAGE_BYTES {
            memory.erase(slot, page).await?;
        }
        Ok(Self { slot, sequence, length, written: 0 })
    }

    /// Bytes that are still to come.
    pub const fn missing(&self) -> usize {
        self.length - self.written
    }

    /// Programs the next piece: whole double words, but for the last.
    ///
    /// # Errors
    /// [`Refusal`]; the set in force stays.
    pub async fn append(
        &mut self,
        memory: &mut impl SetMemory,
        piece: &[u8],
    ) -> Result<(), Refusal> {
        if piece.len() > self.missing() {
            return Err(Refusal::Length);
        }
        if !piece.len().is_multiple_of(WORD_BYTES) && piece.len() != self.missing() {
            return Err(Refusal::Piece);
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
    /// [`Refusal::Length`] if pieces are missing, another otherwise.
    pub fn check<'m>(&self, memory: &'m impl SetMemory) -> Result<ParameterSet<'m>, Refusal> {
        if self.missing() > 0 {
            return Err(Refusal::Length);
        }
        let bytes = memory.bytes(self.slot).get(PREFIX..PREFIX + self.length);
        let set = ParameterSet::open(bytes.ok_or(Refusal::Length)?)?;
        let rest = behind_controller(&set)?;
        read_planner(rest)?;
        Ok(set)
    }

    /// Checks the set and puts it in force.
    ///
    /// # Errors
    /// [`Refusal`]; the set that was in force stays.
    pub async fn seal(self, memory: &mut impl SetMemory) -> Result<(), Refusal> {
        self.check(memory)?;
        let word = length_word(self.length as u32, self.sequence);
        memory.program(self.slot, 8, pair(word, !word)).await?;
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
pub fn place(set: &[u8], sequence: u32) -> Option<[u8; SLOT_BYTES]> {
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
