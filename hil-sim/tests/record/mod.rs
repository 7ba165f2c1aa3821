//! Logs: written, read, damaged, run again.

mod fuzz;
mod logs;
