//! Mutated input that a reader must survive. The same seed gives the same bytes on every
//! machine.

#![allow(dead_code, reason = "each test file uses its part of this")]

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::{Duration, Instant};

/// Environment variable with the seconds that each target is given instead of the usual.
pub(crate) const SECONDS: &str = "FUZZ_SECONDS";

/// Pseudo-random numbers: SplitMix64.
pub(crate) struct Chance(u64);

impl Chance {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed)
    }

    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ z >> 31
    }

    /// Below `end`, 0 if there is nothing below it.
    pub(crate) fn below(&mut self, end: usize) -> usize {
        if end == 0 { 0 } else { (self.next() % end as u64) as usize }
    }

    pub(crate) fn bytes(&mut self, most: usize) -> Vec<u8> {
        let length = self.below(most + 1);
        (0..length).map(|_| self.next() as u8).collect()
    }
}

/// Texts that readers stumble over, separated by blanks.
const WORDS: &str = "0 -1 1e999 -1e999 nan NaN inf 18446744073709551616 -0.0 1e-320 true [] {} \
    \"\" '' = . , \n \0 \u{FEFF} ä\u{0301} # [[";

/// Bytes that lengths and counts are made of.
const NUMBERS: [&[u8]; 6] = [
    &[0xFF; 4],
    &[0xFF; 8],
    &[0x00; 8],
    &[0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x01],
    &[0xFF, 0xFF, 0xFF, 0x7F],
    &[0x00, 0x00, 0x00, 0x80],
];

/// One of `corpus`, changed in one to eight places: bits and bytes turned over, parts cut
/// out, doubled, put in from another of them, overwritten with what readers stumble over;
/// or nothing but noise.
pub(crate) fn mutant(corpus: &[Vec<u8>], chance: &mut Chance) -> Vec<u8> {
    if corpus.is_empty() || chance.below(50) == 0 {
        return chance.bytes(400);
    }
    let mut bytes = corpus[chance.below(corpus.len())].clone();
    for _ in 0..=chance.below(8) {
        let at = chance.below(bytes.len());
        let end = (at + 1 + chance.below(64)).min(bytes.len());
        match chance.below(9) {
            0 | 1 if !bytes.is_empty() => bytes[at] ^= 1 << chance.below(8),
            2 if !bytes.is_empty() => bytes[at] = chance.next() as u8,
            3 => bytes.truncate(at),
            4 => drop(bytes.drain(at..end)),
            5 => {
                let part = bytes[at..end].to_vec();
                bytes.splice(at..at, part);
            }
            6 => {
                let other = &corpus[chance.below(corpus.len())];
                let from = chance.below(other.len());
                let to = (from + 1 + chance.below(256)).min(other.len());
                bytes.splice(at..end, other[from..to].iter().copied());
            }
            7 => {
                let word = WORDS.split(' ').nth(chance.below(WORDS.split(' ').count()));
                bytes.splice(at..end.min(at + 8), word.unwrap_or_default().bytes());
            }
            _ => {
                let number = NUMBERS[chance.below(NUMBERS.len())];
                let to = (at + number.len()).min(bytes.len());
                bytes.splice(at..to, number.iter().copied());
            }
        }
    }
    bytes
}

/// Feeds `target` with mutants of `corpus` for the usual seconds, at most so many of them.
///
/// # Panics
/// If the target does, with the bytes that made it, or if hardly any was tried.
pub(crate) fn fuzz(
    name: &str,
    corpus: &[Vec<u8>],
    most: u64,
    seconds: f64,
    mut target: impl FnMut(&[u8]),
) {
    let longer = std::env::var(SECONDS).ok().and_then(|text| text.parse().ok());
    let (seconds, most) = longer.map_or((seconds, most), |seconds| (seconds, u64::MAX));
    let end = Instant::now() + Duration::from_secs_f64(seconds);
    // What is valid has to pass as well.
    for bytes in corpus {
        target(bytes);
    }
    let mut chance = Chance::new(0x1_7E25);
    let mut tried = 0;
    while tried < most && Instant::now() < end {
        let bytes = mutant(corpus, &mut chance);
        let survived = catch_unwind(AssertUnwindSafe(|| target(&bytes))).is_ok();
        assert!(
            survived,
            "{name}: mutant {tried} panics, {} bytes: {}",
            bytes.len(),
            shown(&bytes)
        );
        tried += 1;
    }
    println!("{name}: {tried} mutants");
    assert!(tried >= most.min(5), "{name}: {tried} mutants in {seconds} s prove nothing");
}

/// Bytes as text where they are some.
fn shown(bytes: &[u8]) -> String {
    bytes.iter().take(4000).flat_map(|byte| byte.escape_ascii()).map(char::from).collect()
}
