//! The `rig` command. A verb is one file with its `Args` and its `run`; what they
//! share is in `scenario`, `output` and `failure`.
//!
//! Results go to standard output, progress and errors to standard error. The exit
//! code is 0 if all is well, 1 if what was run did not end well, 2 if it could not
//! be run as asked; an error is one line.

mod account;
mod bench;
mod capture;
mod compare;
mod constants;
mod coverage;
mod crossing;
mod deploy;
mod docs;
mod failure;
mod faults;
mod flash;
mod identify;
mod keys;
mod live;
mod modes;
mod montecarlo;
mod output;
mod panics;
mod paper;
mod params;
mod parse;
#[cfg(feature = "probe")]
mod probe;
mod replay;
mod report;
mod resets;
mod scenario;
mod size;
mod stress;
mod test;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

use failure::{Failure, Outcome};

/// Virtual rig for a rubber-wheeled drive that climbs the steps of a telescoping
/// sleeve.
#[derive(Debug, Parser)]
#[command(name = "rig", bin_name = "cargo rig", version, disable_help_subcommand = true)]
struct Cli {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Debug, Subcommand)]
enum Verb {
    Deploy(deploy::Args),
    Capture(capture::Args),
    Live(live::Args),
    Replay(replay::Args),
    Report(report::Args),
    Crossing(crossing::Args),
    Modes(modes::Args),
    Bench(bench::Args),
    Compare(compare::Args),
    Montecarlo(montecarlo::Args),
    Faults(faults::Args),
    Flash(flash::Args),
    Paper(paper::Args),
    Identify(identify::Args),
    Keys(keys::Args),
    Params(params::Args),
    Stress(stress::Args),
    Resets(resets::Args),
    Size(size::Args),
    Panics(panics::Args),
    Coverage(coverage::Args),
    Account(account::Args),
    Constants(constants::Args),
    Docs(docs::Args),
    Test(test::Args),
}

impl Verb {
    fn run(&self) -> Result<Outcome, Failure> {
        match self {
            Self::Deploy(args) => deploy::run(args),
            Self::Capture(args) => capture::run(args),
            Self::Live(args) => live::run(args),
            Self::Replay(args) => replay::run(args),
            Self::Report(args) => report::run(args),
            Self::Crossing(args) => crossing::run(args),
            Self::Modes(args) => modes::run(args),
            Self::Bench(args) => bench::run(args),
            Self::Compare(args) => compare::run(args),
            Self::Montecarlo(args) => montecarlo::run(args),
            Self::Faults(args) => faults::run(args),
            Self::Flash(args) => flash::run(args),
            Self::Paper(args) => paper::run(args),
            Self::Identify(args) => identify::run(args),
            Self::Keys(args) => keys::run(args),
            Self::Params(args) => params::run(args),
            Self::Stress(args) => stress::run(args),
            Self::Resets(args) => resets::run(args),
            Self::Size(args) => size::run(args),
            Self::Panics(args) => panics::run(args),
            Self::Coverage(args) => coverage::run(args),
            Self::Account(args) => account::run(args),
            Self::Constants(args) => constants::run(args),
            Self::Docs(args) => docs::run(args),
            Self::Test(args) => test::run(args),
        }
    }
}

/// Runs the command with the arguments of this process.
#[must_use]
pub fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => return parse::report(&error),
    };
    match cli.verb.run() {
        Ok(outcome) => outcome.code(),
        Err(failure) => {
            eprintln!("error: {failure}");
            failure.code()
        }
    }
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn the_arguments_are_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn every_verb_and_option_has_help() {
        for verb in Cli::command().get_subcommands() {
            assert!(verb.get_about().is_some(), "{}", verb.get_name());
            for arg in verb.get_arguments() {
                assert!(arg.get_help().is_some(), "{} {}", verb.get_name(), arg.get_id());
            }
        }
    }
}
