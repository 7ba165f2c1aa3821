//! All tests of this crate that need more than one of its modules: one program.

mod cli;
mod common;
mod record;
mod session;
