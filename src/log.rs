//! What the controller reports: entries for the log, one telemetry row a tick.

mod entry;
mod telemetry;

pub use entry::{CrossingRecord, Entry, Event};
pub use telemetry::Telemetry;
