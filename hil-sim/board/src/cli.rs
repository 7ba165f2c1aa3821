//! The verbs of `rig` that run on the emulated board.

mod capture;
mod deploy;
mod faults;
mod live;
mod params;

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use hil_sim::cli::failure::{Failure, Outcome};

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
}

impl Verb {
    fn run(&self) -> Result<Outcome, Failure> {
        match self {
            Self::Deploy(args) => deploy::run(args),
            Self::Capture(args) => capture::run(args),
            Self::Live(args) => live::run(args),
            Self::Faults(args) => faults::run(args),
            Self::Params(args) => params::run(args),
        }
    }
}

/// Runs the command with the arguments of this process.
#[must_use]
pub fn main() -> ExitCode {
    hil_sim::cli::run(|cli: &Cli| cli.verb.run())
}
