//! What the drive was doing when the supply went, one place behind the other.
//!
//! ```text
//! 0   record of the drive, five words and a blank one   (written as the supply goes)
//! 24  blank, or 0 once a start has reported it
//! ```
//!
//! The supply gives its warning about a millisecond before the memory is lost; a record is
//! three double words, which take a quarter of that, and the search for its place a tenth.

use super::page::{PAGE_WORDS, Page, Word, used, word};
use crate::restart::{DriveSnapshot, SNAPSHOT_WORDS};

/// Double words of a place.
const PLACE_WORDS: usize = 4;

/// Places of a page.
const PLACES: usize = PAGE_WORDS / PLACE_WORDS;

/// What is programmed over the last double word of a place that has been reported.
pub const TAKEN: Word = [0; 2];

/// The first double word of the place for the next record; none if the page is full.
pub fn free(page: &Page) -> Option<usize> {
    let next = used(page, PLACE_WORDS);
    (next < PLACES).then_some(next * PLACE_WORDS)
}

/// The double words of a record.
pub fn words(snapshot: &DriveSnapshot) -> [Word; 3] {
    let [a, b, c, d, e] = snapshot.seal();
    [[a, b], [c, d], [e, u32::MAX]]
}

/// A record that no start has reported yet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Latest {
    /// Number of the double word that has to be [`TAKEN`].
    pub mark: usize,
    /// The record, if it is whole.
    pub snapshot: Option<DriveSnapshot>,
}

/// The last record, unless it has been reported; of one that was broken off the one before
/// it, of which the start before may not have come to report it either.
pub fn latest(page: &Page) -> Option<Latest> {
    let last = used(page, PLACE_WORDS).checked_sub(1)?;
    let mark = |place: usize| (place + 1) * PLACE_WORDS - 1;
    // A mark that was broken off is none: better twice than not at all.
    let untaken = |place: &usize| word(page, mark(*place)) != TAKEN;
    let places = last.saturating_sub(1)..=last;
    let snapshot = |place: usize| {
        let mut words = [0; SNAPSHOT_WORDS];
        let found = (place * PLACE_WORDS..mark(place)).flat_map(|index| word(page, index));
        words.iter_mut().zip(found).for_each(|(to, from)| *to = from);
        DriveSnapshot::open(&words)
    };
    untaken(&last).then(|| Latest {
        mark: mark(last),
        snapshot: places.rev().take_while(untaken).find_map(snapshot),
    })
}
