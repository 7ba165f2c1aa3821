//! The integration tests, one program.

mod campaigns;
mod common;
