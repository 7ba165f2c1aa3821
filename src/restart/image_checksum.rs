//! Which images have run on this board, and their sums: by these a start, and the board
//! while it runs, know that no bit of the image has turned over.
//!
//! ```text
//! 0   hash of the image, by which it is known, eight bytes
//! 8   sum over the image, its complement
//! ```
//!
//! The first start of an image writes its entry: what was flashed was read back by whoever
//! flashed it, and a sum made on the host would have to be put into every image after it is
//! linked.

use super::page::{PAGE_WORDS, Page, Word, used, word};

/// Double words of an entry.
const ENTRY_WORDS: usize = 2;

/// A sum over the words of an image so far, with some more of them.
///
/// Each word is mixed in by steps of which every one can be undone, so that a change within
/// one word always shows. So does any pair of bits of a double word, the least that the
/// chip's own correction leaves; all else with all but one in 2^32 or so. It costs half of
/// what a CRC does.
pub fn sum_on(sum: u32, words: &[u32]) -> u32 {
    words.iter().fold(sum, |sum, word| (sum ^ sum >> 15 ^ word).wrapping_mul(0x9E37_79B1))
}

/// The entry of an image with this sum.
pub fn entry(id: [u8; 8], sum: u32) -> [Word; ENTRY_WORDS] {
    let [low, high] = halves(id);
    [[low, high], [sum, !sum]]
}

/// First double word of the next entry; none if the page is full.
pub fn free(page: &Page) -> Option<usize> {
    let next = used(page, ENTRY_WORDS) * ENTRY_WORDS;
    (next < PAGE_WORDS).then_some(next)
}

/// The sum of the image of this hash, as at its first start; none if it has not run here.
///
/// A hash with one or two bits turned over is the same image: a damaged one would pass for
/// new.
pub fn sum_of(page: &Page, id: [u8; 8]) -> Option<u32> {
    let own = number(halves(id));
    (0..PAGE_WORDS).step_by(ENTRY_WORDS).find_map(|index| {
        let [sum, complement] = word(page, index + 1);
        let known = (number(word(page, index)) ^ own).count_ones() <= 2;
        (known && complement == !sum).then_some(sum)
    })
}

fn halves(id: [u8; 8]) -> Word {
    let [a, b, c, d, e, f, g, h] = id;
    [u32::from_le_bytes([a, b, c, d]), u32::from_le_bytes([e, f, g, h])]
}

const fn number([low, high]: Word) -> u64 {
    (high as u64) << 32 | low as u64
}
