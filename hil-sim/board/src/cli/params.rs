//! The parameters of the emulated board.

use std::fs;
use std::path::Path;

use crate::params::EmulatedBoard;
use hil_sim::cli::failure::{Failure, Outcome};
use hil_sim::firmware::{self, Profile};
use hil_sim::params::Client;
use hil_sim::progress;

/// Starts the board with this flash, does something with its parameters, and keeps the
/// flash.
pub(super) fn with(
    flash: &Path,
    act: impl FnOnce(&mut Client<EmulatedBoard>) -> Result<Outcome, Failure>,
) -> Result<Outcome, Failure> {
    let path = firmware::build(Profile::Release)?;
    let elf =
        fs::read(&path).map_err(|error| Failure::run(format!("{}: {error}", path.display())))?;
    if let Some(folder) = flash.parent() {
        fs::create_dir_all(folder)
            .map_err(|error| Failure::input(format!("{}: {error}", folder.display())))?;
    }
    let mut client = {
        let _progress = progress::spinner("starting the board");
        Client::new(EmulatedBoard::start(&elf, flash)?)
    };
    let outcome = act(&mut client);
    // Whatever became of it, the flash is as it is.
    client.into_wire().keep()?;
    outcome
}
