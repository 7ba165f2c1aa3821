//! What the controller reports: log entries, one telemetry row a tick, and the binary stream
//! that carries both to a host.
//!
//! | part | does |
//! |---|---|
//! | [`Entry`](crate::tick::Entry), [`Telemetry`](crate::tick::Telemetry) | what happened; the state after a tick |
//! | [`Record`] | a tick's complete input and output, for the stream |
//! | [`LogEncoder`] | makes frames of them, below the control rate |
//! | [`frame`] | layout of a frame |
//! | [`capture`] | samples around a trigger, kept until they have been read |
//! | [`ledger`] | one line a crossing |

pub mod capture;
mod crc;
mod delta;
mod encoder;
pub mod frame;
pub mod identity;
pub mod ledger;
mod record;
mod recorder;

pub use crate::supervise::codes;
pub use crc::crc32;
pub use encoder::{FrameSink, LogEncoder, TICKS_PER_FRAME};
pub use identity::Identity;
pub use record::{Flags, Record};
pub use recorder::SnapshotRecorder;
