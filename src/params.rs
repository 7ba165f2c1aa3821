//! Parameters as the firmware runs on them.
//!
//! A rig is written in SI numbers ([`Rig`](crate::rig::Rig)); the control path runs on
//! fixed-point constants derived from them. The derivation needs the host's mathematics, so the
//! host does it once, and the board carries the result: a *set*, which contains its rig too. The
//! image holds no software floating point, starts at once, and its constants are those of the
//! virtual rig to the bit.

mod compile;
pub mod link;
pub mod service;
mod set;
pub mod slots;

pub use compile::{CompileError, compile};
pub use set::{Header, MAX_NAME, ParameterSet, Refusal, Rest, SCHEMA, SetError};

/// Longest set, bytes: two pages of flash less what its slot keeps beside it.
pub const MAX_SET: usize = 4096 - 16;
