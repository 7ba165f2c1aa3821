//! Logs of the controller: from the bytes of the binary channel, or a file that holds
//! them, to rows with names and units.
//!
//! One decoder serves every source: the emulated board, a probe, the controller on this
//! host, a recorded stream. [`Run`] is what is left of a whole log.

mod complete;
mod decoder;
mod file;
mod ledger;
mod recording;
mod row;
mod run;

pub use complete::complete;
pub use decoder::{Decoder, Item, Mark, Tally};
pub(crate) use file::sound;
pub use file::{FRAMES, ReadError, pieces, timed};
pub use ledger::LedgerLine;
pub use recording::recording;
pub use row::Row;
pub use run::{Boot, Header, Run, Since};
