//! The `rig` command. A verb is one file with its `Args` and its `run`; shared parts are in
//! `scenario`, `output` and `failure`.
//!
//! Results go to standard output, progress and errors to standard error. The exit
//! code is 0 on success, 1 if a run, log or check failed, 2 for bad input; an error is one
//! line.

mod accept;
pub mod bringup;
pub mod campaign;
pub mod capture;
mod compare;
mod completions;
mod crossing;
pub mod deploy;
mod envelope;
pub mod failure;
pub mod faults;
mod flash;
mod identify;
mod keys;
pub mod live;
mod log_files;
mod merge;
mod montecarlo;
pub mod operate;
pub mod output;
pub mod params;
mod parse;
mod probe;
pub mod replay;
mod report;
pub mod scenario;
pub mod source;
mod stress;
mod sweep;
pub mod terminal;
mod test;

use std::ffi::OsString;
use std::process::ExitCode;

use clap::{Parser, Subcommand};

use crate::provision::{self, Extra};
use campaign::CampaignArgs;
use failure::{Failure, Outcome};

/// Virtual rig for a rubber-wheeled drive that climbs the steps of a telescoping
/// sleeve.
#[derive(Debug, Parser)]
#[command(name = "rig", bin_name = "cargo rig", version)]
struct Cli {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Debug, Subcommand)]
enum Verb {
    Deploy(deploy::Args),
    Accept(accept::Args),
    Bringup(bringup::Args),
    Capture(capture::Args),
    Completions(completions::Args),
    Live(live::Args),
    Replay(replay::Args),
    Report(report::Args),
    Crossing(crossing::Args),
    Compare(compare::Args),
    Envelope(envelope::Args),
    Montecarlo(montecarlo::Args),
    #[command(flatten)]
    Operate(operate::Verb),
    Faults(faults::Args),
    Flash(flash::Args),
    Identify(identify::Args),
    Keys(keys::Args),
    Merge(merge::Args),
    Params(params::Args),
    Stress(stress::Args),
    Sweep(sweep::Args),
    Test(test::Args),
    /// Natural frequencies of the drive arm by the wave-vector method.
    Modes(Passed),
    /// Run time against error.
    Bench(Passed),
    /// The study's figures and which of its claims hold.
    Paper(Passed),
}

/// Arguments of a verb that another part of `rig` has, see [`Extra`].
#[derive(Debug, clap::Args)]
#[command(disable_help_flag = true)]
struct Passed {
    /// Arguments of that part; `--help` shows them.
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, value_name = "ARGS")]
    _all: Vec<OsString>,
}

impl Verb {
    /// How the verb runs its campaign, if it has one; one that is not here cannot be merged.
    fn campaign(&mut self) -> Option<&mut CampaignArgs> {
        match self {
            Self::Compare(args) => Some(&mut args.campaign),
            Self::Envelope(args) => Some(&mut args.campaign),
            Self::Faults(args) => Some(&mut args.campaign),
            Self::Montecarlo(args) => Some(&mut args.campaign),
            Self::Stress(args) => Some(&mut args.campaign),
            Self::Sweep(args) => Some(&mut args.campaign),
            _ => None,
        }
    }

    fn run(&self) -> Result<Outcome, Failure> {
        match self {
            Self::Deploy(args) => deploy::run(args),
            Self::Accept(args) => accept::run(args),
            Self::Bringup(args) => bringup::run(args),
            Self::Capture(args) => capture::run(args),
            Self::Completions(args) => completions::run(args),
            Self::Live(args) => live::run(args),
            Self::Replay(args) => replay::run(args),
            Self::Report(args) => report::run(args),
            Self::Crossing(args) => crossing::run(args),
            Self::Compare(args) => compare::run(args),
            Self::Envelope(args) => envelope::run(args),
            Self::Montecarlo(args) => montecarlo::run(args),
            Self::Operate(verb) => operate::run(verb),
            Self::Faults(args) => faults::run(args),
            Self::Flash(args) => flash::run(args),
            Self::Identify(args) => identify::run(args),
            Self::Keys(args) => keys::run(args),
            Self::Merge(args) => merge::run(args),
            Self::Params(args) => params::run(args),
            Self::Stress(args) => stress::run(args),
            Self::Sweep(args) => sweep::run(args),
            Self::Test(args) => test::run(args),
            Self::Modes(_) | Self::Bench(_) | Self::Paper(_) => {
                Err(Failure::Elsewhere(Extra::Study))
            }
        }
    }
}

/// Runs the command with the arguments of this process.
pub fn main() -> ExitCode {
    let arguments: Vec<OsString> = std::env::args_os().skip(1).collect();
    if let Some(verb) = helped_elsewhere(&arguments) {
        return provision::help(Extra::Study, verb);
    }
    run(|cli: &Cli| cli.verb.run())
}

/// The verb whose help is asked for, if another part of `rig` has it and knows its options.
fn helped_elsewhere(arguments: &[OsString]) -> Option<&'static str> {
    let is_help = |word: &OsString| ["help", "--help", "-h"].iter().any(|help| word == help);
    let mut verbs = ["modes", "bench", "paper"].into_iter();
    let verb = verbs.find(|verb| arguments.iter().take(2).any(|word| word == verb))?;
    arguments.iter().any(is_help).then_some(verb)
}

/// Parses the arguments of this process and runs the verb. Errors are one line.
pub fn run<C: Parser>(run: impl FnOnce(&C) -> Result<Outcome, Failure>) -> ExitCode {
    let cli = match C::try_parse() {
        Ok(cli) => cli,
        Err(error) => return parse::report(&error),
    };
    let outcome = run(&cli).or_else(|failure| match failure {
        #[cfg(not(feature = "probe"))]
        Failure::Elsewhere(Extra::Probe) => probe::go_on(),
        Failure::Elsewhere(part) => Ok(Outcome::Code(provision::go_on(part)?)),
        failure => Err(failure),
    });
    outcome.map(Outcome::code).unwrap_or_else(|failure| {
        output::complain(&format!("error: {failure}"));
        failure.code()
    })
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
