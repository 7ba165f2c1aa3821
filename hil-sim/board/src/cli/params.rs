//! `rig params --target board`.

use std::fs;

use hil_sim::cli::failure::{Failure, Outcome};
use hil_sim::cli::params::{Args, act};
use hil_sim::firmware::{self, Profile};
use hil_sim::params::Client;
use hil_sim::progress;

use crate::params::EmulatedBoard;

/// Starts the board with the flash that the file holds, does what was asked with its
/// parameters, and keeps the flash, whatever became of it.
pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let elf = firmware::image(Profile::Release)?;
    if let Some(folder) = args.flash.parent() {
        fs::create_dir_all(folder)
            .map_err(|error| Failure::input(format!("{}: {error}", folder.display())))?;
    }
    let mut client = {
        let _progress = progress::spinner("starting the board");
        Client::new(EmulatedBoard::start(&elf, &args.flash)?)
    };
    let outcome = act(args, &mut client);
    client.into_wire().keep()?;
    outcome
}
