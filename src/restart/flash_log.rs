//! Log of the drive's snapshots at each loss of the supply.
//!
//! ```text
//! 0   snapshot, five words and a blank one   (written as the supply falls)
//! 24  blank, or 0 once a start has reported it
//! ```
//!
//! The supply monitor warns about a millisecond before the memory is lost; writing a record of
//! three double words takes a quarter of that, and finding its place a tenth.

use super::page::{PAGE_WORDS, Page, Word, used, word};
use crate::restart::DriveSnapshot;

/// Double words of an entry.
const ENTRY_WORDS: usize = 4;

/// Programmed over the last double word of an entry that has been reported.
pub const TAKEN: Word = [0; 2];

/// First double word of the next entry; none if the page is full.
pub fn free(page: &Page) -> Option<usize> {
    Some(used(page, ENTRY_WORDS)).filter(|next| *next < PAGE_WORDS)
}

/// Double words of a snapshot.
pub fn words(snapshot: &DriveSnapshot) -> [Word; 3] {
    let [a, b, c, d, e, f] = snapshot.seal();
    [[a, b], [c, d], [e, f]]
}

/// An entry that no start has reported yet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Latest {
    /// Index of the double word to overwrite with [`TAKEN`].
    pub mark: usize,
    /// The snapshot, if it is intact.
    pub snapshot: Option<DriveSnapshot>,
}

/// The last entry, unless it has been reported. If it was torn, the one before it counts, if
/// that has not been reported either.
pub fn latest(page: &Page) -> Option<Latest> {
    let mark = used(page, ENTRY_WORDS).checked_sub(1)?;
    // A torn mark does not count: better reported twice than not at all.
    let untaken = |mark: &usize| word(page, *mark) != TAKEN;
    let snapshot = |mark: usize| {
        let words = [3, 2, 1].map(|before| word(page, mark - before));
        DriveSnapshot::open(words.as_flattened().try_into().ok()?)
    };
    let marks = [Some(mark), mark.checked_sub(ENTRY_WORDS)].into_iter().flatten();
    untaken(&mark).then(|| Latest { mark, snapshot: marks.take_while(untaken).find_map(snapshot) })
}
