//! A log as it comes: decoded, written to files that stay readable whatever happens, and
//! shown while it grows.

mod message;
mod probed;
pub(crate) mod schemas;
mod source;
mod view;
mod writer;

pub(crate) use message::messages;
pub use probed::Probed;
pub use source::{Bytes, Source, SourceError, Virtual, letter, starter};
pub use view::View;
pub(crate) use view::mode_name;
pub use writer::{WriteError, Writer};
