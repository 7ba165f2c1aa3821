//! Pages of flash that are written double word by double word from the begin on, and erased when
//! full: for what must survive a loss of the supply.
//!
//! A double word is programmed completely, or torn by a loss of the supply and then holds
//! anything; so each entry has a check of its own.

/// Bytes that are erased at once.
pub const PAGE_BYTES: usize = 2048;

/// Bytes that are programmed at once.
pub const WORD_BYTES: usize = 8;

/// Double words of a page.
pub const PAGE_WORDS: usize = PAGE_BYTES / WORD_BYTES;

/// A page in memory.
pub type Page = [u8; PAGE_BYTES];

/// A double word, the half at the lower address first.
pub type Word = [u32; 2];

/// The double word of this index; blank beyond the end of the page.
#[inline(never)]
pub(super) fn word(page: &Page, index: usize) -> Word {
    let half = |at: usize| page.get(at..)?.first_chunk().copied().map(u32::from_le_bytes);
    let at = index.saturating_mul(WORD_BYTES);
    [half(at).unwrap_or(u32::MAX), half(at.saturating_add(4)).unwrap_or(u32::MAX)]
}

/// Double words of the entries in use, of so many each: all up to the last that is not blank.
#[inline(never)]
pub(super) fn used(page: &Page, words: usize) -> usize {
    let blank = |index: usize| word(page, index) == [u32::MAX; 2];
    (0..PAGE_WORDS)
        .rev()
        .find(|index| !blank(*index))
        .map_or(0, |index| (index / words + 1) * words)
}

#[cfg(test)]
mod tests;
