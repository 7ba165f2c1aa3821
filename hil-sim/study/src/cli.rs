//! The verbs of `rig` that show the study.

mod modes;
mod paper;

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use hil_sim::cli::failure::{Failure, Outcome};

/// The verbs of `rig` on the study; `rig` starts this where one needs it.
#[derive(Debug, Parser)]
#[command(name = "rig-study", bin_name = "cargo rig", version, disable_help_subcommand = true)]
struct Cli {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Debug, Subcommand)]
enum Verb {
    Modes(modes::Args),
    Paper(paper::Args),
}

impl Verb {
    fn run(&self) -> Result<Outcome, Failure> {
        match self {
            Self::Modes(args) => modes::run(args),
            Self::Paper(args) => paper::run(args),
        }
    }
}

/// Runs the command with the arguments of this process.
#[must_use]
pub fn main() -> ExitCode {
    hil_sim::cli::run(|cli: &Cli| cli.verb.run())
}
