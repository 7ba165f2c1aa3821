//! What survives a restart: why the program was stopped, and what the drive was doing.
//!
//! The board keeps it as words in memory that no start clears. After a loss of power they hold
//! anything, so each record carries a check; a record that is not intact counts as none. The
//! snapshot of each tick goes to two places alternately, so that a reset during a write leaves
//! the tick before.
mod crash;
pub mod flash_log;
pub mod image_checksum;
pub mod page;
mod report;
mod snapshot;

pub use crash::{Crash, Stopped};
pub use report::{Reset, Restart};
pub use snapshot::{DriveSnapshot, MissedCheckIns, PackedSpeed, PackedZeros, later};

/// Words of a [`DriveSnapshot`].
pub const SNAPSHOT_WORDS: usize = 6;

/// Words of a [`Crash`].
pub const CRASH_WORDS: usize = 7;

/// Check of a record's words.
///
/// Each word is mixed in by invertible steps: a change within one word always shows, any other
/// with all but one in 2^32.
fn check(seed: u32, words: &[u32]) -> u32 {
    words.iter().fold(seed, |sum, word| (sum.rotate_left(7) ^ word).wrapping_mul(0x9E37_79B1))
}

#[cfg(test)]
mod tests;
