//! What the controller reports: entries for the log, one telemetry row a tick, and the
//! binary stream that carries both to a host.
//!
//! | part | does |
//! |---|---|
//! | [`Entry`], [`Telemetry`] | what happened; the state after a tick |
//! | [`Record`] | a tick's whole input and output, for the stream |
//! | [`Tape`] | hands records from the tick to the journal |
//! | [`LogEncoder`] | makes frames of them, below the control rate |
//! | [`frame`] | how a frame lies on the channel |
//! | [`capture`] | moments that matter, kept until they have been read |
//! | [`ledger`] | a line a crossing |

pub mod capture;
mod delta;
mod encoder;
mod entry;
pub mod frame;
pub mod identity;
pub mod ledger;
mod record;
mod recorder;
mod tape;
mod telemetry;

pub use crate::supervise::codes;
pub use encoder::LogEncoder;
pub use entry::{CrossingRecord, Entry, Event};
pub use identity::Identity;
pub use record::{Flags, Record};
pub use recorder::SnapshotRecorder;
pub use tape::{BATCH, TAPE, Tape};
pub use telemetry::Telemetry;
