//! Logs: written, read, damaged, run again.

mod fixtures;
mod fuzz;
mod logs;
