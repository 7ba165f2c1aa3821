//! The record of a run: one row a tick, events, the ledger of the crossings, a summary.
//!
//! `tick` lists the columns. [`Decoder`] and [`Run`] read the controller's binary log;
//! [`Writer`] and [`write_all`] write MCAP, CSV and JSON, [`recordings`] reads them.

mod columns;
mod csv_file;
mod decoder;
mod joined;
mod mcap_file;
mod probed;
mod read;
mod recorder;
mod recording;
pub(crate) mod row;
mod run;
mod source;
mod summary;
mod time_lost;
mod view;
mod write;

pub(crate) use columns::Column;
pub(crate) use csv_file::{Metadata, write_metadata};
pub use decoder::{Counts, Decoder, Item, Mark};
pub use joined::JoinedLog;
pub use mcap_file::{FRAMES, Topic, messages, unwrapped, write_mcap};
pub use probed::Probed;
pub(crate) use read::log_at;
pub(crate) use recorder::{RunRecorder, text};
pub use recording::recordings;
pub use row::{Columns, MODE_NAMES, Row, TrueState};
pub(crate) use row::{STAGE_NAMES, mode_number, mode_words, stage_name};
pub use run::{Boot, Cut, Header, Run, Unknown};
pub use source::{Bytes, Source, SourceError, Virtual, letter, starter};
pub(crate) use summary::or_nan;
pub use summary::{CrossingLine, LedgerLine, LogLine, Recording, Report, Summary};
pub(crate) use time_lost::TimeLost;
pub(crate) use view::{View, shown};
pub use write::{WriteError, Writer, write_all};
