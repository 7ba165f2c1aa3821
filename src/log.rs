//! What the controller reports: entries for the log, one telemetry row a tick, and the
//! binary stream that carries both to a host.
//!
//! | part | does |
//! |---|---|
//! | [`Entry`], [`Telemetry`] | what happened; the state after a tick |
//! | [`Record`] | a tick's whole input and output, for the stream |
//! | [`Tape`] | hands records from the tick to the journal |
//! | [`Scribe`] | makes frames of them, below the control rate |
//! | [`frame`] | how a frame lies on the channel |
//! | [`capture`] | moments that matter, kept until they have been read |
//! | [`ledger`] | a line a crossing |

pub mod capture;
pub mod frame;
pub mod identity;
pub mod ledger;
pub mod number;
mod record;
mod scribe;
mod tape;
mod wire;

pub use identity::Identity;
pub use record::{Flags, Record};
pub use scribe::Scribe;
pub use tape::{BATCH, TAPE, Tape};
