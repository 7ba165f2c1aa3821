//! A log as it comes: decoded, written to files that stay readable whatever happens, and
//! shown while it grows.

mod source;
mod view;
mod writer;

#[cfg(feature = "board")]
pub use source::Emulated;
pub use source::{Bytes, Source, SourceError, Virtual, letter};
pub use view::View;
pub use writer::{WriteError, Writer};
