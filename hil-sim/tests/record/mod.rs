//! Logs: written, read, damaged, run again.

mod fixtures;
mod fuzz;
pub(crate) mod logs;
