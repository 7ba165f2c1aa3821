//! All tests of this crate that need more than one of its modules: one program.

mod browser;
mod budget;
mod campaigns;
mod cli;
mod commands;
mod common;
mod docs_pages;
mod identify;
mod modes_page;
mod plant;
#[cfg(feature = "probe")]
mod probe;
mod record;
mod session;
