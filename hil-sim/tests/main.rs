//! All tests of this crate that need more than one of its modules: one program.

//! All tests of this crate that need more than one of its modules: one program.

mod campaigns;
mod cli;
mod commands;
mod commands;
mod common;
mod common;
mod identify;
mod identify;
mod modes_page;
mod modes_page;
mod plant;
mod plant;
#[cfg(feature = "probe")]
mod probe;
#[cfg(feature = "probe")]
mod probe;
mod record;
mod record;
mod session;
mod session;
