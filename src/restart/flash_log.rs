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
use crate::restart::{DriveSnapshot, SNAPSHOT_WORDS};

/// Double words of an entry.
const ENTRY_WORDS: usize = 4;

/// Entries of a page.
const ENTRIES: usize = PAGE_WORDS / ENTRY_WORDS;

/// Programmed over the last double word of an entry that has been reported.
pub const TAKEN: Word = [0; 2];

/// First double word of the next entry; none if the page is full.
pub fn free(page: &Page) -> Option<usize> {
    let next = used(page, ENTRY_WORDS);
    (next < ENTRIES).then_some(next * ENTRY_WORDS)
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
    let last = used(page, ENTRY_WORDS).checked_sub(1)?;
    let mark = |entry: usize| (entry + 1) * ENTRY_WORDS - 1;
    // A torn mark does not count: better reported twice than not at all.
    let untaken = |entry: &usize| word(page, mark(*entry)) != TAKEN;
    let entries = last.saturating_sub(1)..=last;
    let snapshot = |entry: usize| {
        let mut words = [0; SNAPSHOT_WORDS];
        let found = (entry * ENTRY_WORDS..mark(entry)).flat_map(|index| word(page, index));
        words.iter_mut().zip(found).for_each(|(to, from)| *to = from);
        DriveSnapshot::open(&words)
    };
    untaken(&last).then(|| Latest {
        mark: mark(last),
        snapshot: entries.rev().take_while(untaken).find_map(snapshot),
    })
}
