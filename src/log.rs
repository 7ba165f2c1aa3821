//! What the controller reports: log entries, one telemetry row a tick, and the binary stream
//! that carries both to a host.
//!
//! | part | does |
//! |---|---|
//! | [`Entry`](crate::tick::Entry), [`Telemetry`](crate::tick::Telemetry) | what happened; the state after a tick |
//! | [`Record`] | a tick's complete input and output, for the stream |
//! | [`LogEncoder`] | makes frames of them, below the control rate |
//! | [`frame`] | layout of a frame |
//! | [`ledger`] | one line a crossing |

mod delta;
mod encoder;
pub mod frame;
pub mod identity;
pub mod ledger;
mod record;
mod recorder;

use crc::{CRC_32_ISO_HDLC, Crc, Table};
use serde::Deserialize;

pub use crate::supervise::codes;
pub use encoder::{FrameSink, LogEncoder, TICKS_PER_FRAME};
pub use identity::{Identity, SCHEMA};
pub use record::{Flags, Record};
pub use recorder::SnapshotRecorder;

/// CRC-32 (ISO-HDLC, as of Ethernet) of these bytes: the check of frames, messages and parameter
/// sets. Cost: eight cycles a byte.
pub fn crc32(bytes: &[u8]) -> u32 {
    static CRC: Crc<u32, Table<1>> = Crc::<u32, Table<1>>::new(&CRC_32_ISO_HDLC);
    CRC.checksum(bytes)
}

/// The value of which these bytes are the postcard, all of them.
pub(crate) fn complete<'a, T: Deserialize<'a>>(bytes: &'a [u8]) -> Option<T> {
    postcard::take_from_bytes(bytes).ok().and_then(|(value, rest)| rest.is_empty().then_some(value))
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_check_is_the_one_of_ethernet() {
        assert_eq!(super::crc32(b"123456789"), 0xCBF4_3926);
    }
}
