//! The verbs of `rig` that run on the emulated board.

mod capture;
mod cycles;
mod deploy;
mod faults;
mod live;
mod params;

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use hil_sim::cli::failure::{Failure, Outcome};
use hil_sim::firmware::{self, Profile};
use hil_sim::scenario::Scenario;

use crate::log::Strings;

/// The verbs of `rig` on the emulated board; `rig` starts this where one needs it.
#[derive(Debug, Parser)]
#[command(name = "rig-board", bin_name = "cargo rig", version, disable_help_subcommand = true)]
struct Cli {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Debug, Subcommand)]
enum Verb {
    Deploy(hil_sim::cli::deploy::Args),
    Capture(hil_sim::cli::capture::Args),
    Live(hil_sim::cli::live::Args),
    Faults(hil_sim::cli::faults::Args),
    Params(hil_sim::cli::params::Args),
    #[command(hide = true)]
    Cycles(cycles::Args),
}

impl Verb {
    fn run(&self) -> Result<Outcome, Failure> {
        match self {
            Self::Deploy(args) => deploy::run(args),
            Self::Capture(args) => capture::run(args),
            Self::Live(args) => live::run(args),
            Self::Faults(args) => faults::run(args),
            Self::Params(args) => params::run(args),
            Self::Cycles(args) => cycles::run(args),
        }
    }
}

/// Runs the command with the arguments of this process.
#[must_use]
pub fn main() -> ExitCode {
    hil_sim::cli::run(|cli: &Cli| cli.verb.run())
}

/// The firmware as it is flashed, with the strings of its log, for a scenario that it can
/// run.
fn image(scenario: &Scenario) -> Result<(Vec<u8>, Strings), Failure> {
    crate::run::check(scenario).map_err(Failure::input)?;
    let elf = firmware::image(Profile::Release)?;
    let strings = Strings::of(&elf).map_err(Failure::run)?;
    Ok((elf, strings))
}
