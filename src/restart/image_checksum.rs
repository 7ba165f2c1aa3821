//! Images that have run on this board, and their checksums: by these the board knows, at the
//! start and while it runs, that no bit of the image has flipped.
//!
//! ```text
//! 0   hash of the image, eight bytes
//! 8   checksum of the image, its complement
//! ```
//!
//! The first start of an image writes its entry: the flashing tool has read the image back, and
//! a checksum made on the host would have to be patched into every linked image.

use super::page::{PAGE_WORDS, Page, Word, used, word};

/// Double words of an entry.
const ENTRY_WORDS: usize = 2;

/// A checksum of an image so far, continued by some of its words.
///
/// Each word is mixed in by steps of which every one can be undone, so that a change within one
/// word always shows. So does any pair of bits of a double word, the least that the chip's own
/// correction leaves; all else with all but one in 2^32 or so. It costs half of what a CRC does.
pub fn sum_on(sum: u32, words: &[u32]) -> u32 {
    words.iter().fold(sum, |sum, word| (sum ^ sum >> 15 ^ word).wrapping_mul(0x9E37_79B1))
}

/// Entry of an image with this checksum.
pub fn entry(id: [u8; 8], sum: u32) -> [Word; ENTRY_WORDS] {
    let id = u64::from_le_bytes(id);
    [[id as u32, (id >> 32) as u32], [sum, !sum]]
}

/// First double word of the next entry; none if the page is full.
pub fn free(page: &Page) -> Option<usize> {
    Some(used(page, ENTRY_WORDS)).filter(|next| *next < PAGE_WORDS)
}

/// Checksum of the image of this hash at its first start; none if it has not run here. A hash
/// with one or two flipped bits is the same image: a damaged one would pass for new.
pub fn sum_of(page: &Page, id: [u8; 8]) -> Option<u32> {
    let [[own_low, own_high], _] = entry(id, 0);
    (0..PAGE_WORDS).step_by(ENTRY_WORDS).find_map(|index| {
        let ([low, high], [sum, complement]) = (word(page, index), word(page, index + 1));
        let flipped = (low ^ own_low).count_ones() + (high ^ own_high).count_ones();
        (flipped <= 2 && complement == !sum).then_some(sum)
    })
}
