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
pub(crate) mod replay;
mod report;
pub(crate) mod scenario;
pub(crate) mod source;
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

/// Declares the verbs in the order of their help. A row is a verb with its arguments, what runs it,
/// and the name of its campaign if it has one: only those rows can be merged.
macro_rules! verbs {
    ($($(#[$about:meta])* $verb:ident($args:ty) => $run:expr $(, $campaign:ident)?;)*) => {
        #[derive(Debug, Subcommand)]
        enum Verb {
            $($(#[$about])* $verb($args),)*
        }

        impl Verb {
            #[cfg(test)]
            const CAMPAIGNS: usize = [$($(stringify!($campaign),)?)*].len();

            /// How the verb runs its campaign, if it has one.
            fn campaign(&mut self) -> Option<&mut CampaignArgs> {
                match self {
                    $($(Self::$verb(args) => Some(&mut args.$campaign),)?)*
                    _ => None,
                }
            }

            fn run(&self) -> Result<Outcome, Failure> {
                match self {
                    $(Self::$verb(args) => $run(args),)*
                }
            }
        }
    };
}

verbs! {
    Deploy(deploy::Args) => deploy::run;
    Accept(accept::Args) => accept::run;
    Bringup(bringup::Args) => bringup::run;
    Capture(capture::Args) => capture::run;
    Completions(completions::Args) => completions::run;
    Live(live::Args) => live::run;
    Replay(replay::Args) => replay::run;
    Report(report::Args) => report::run;
    Crossing(crossing::Args) => crossing::run;
    Compare(compare::Args) => compare::run, campaign;
    Envelope(envelope::Args) => envelope::run, campaign;
    Montecarlo(montecarlo::Args) => montecarlo::run, campaign;
    #[command(flatten)]
    Operate(operate::Verb) => operate::run;
    Faults(faults::Args) => faults::run, campaign;
    Flash(flash::Args) => flash::run;
    Identify(identify::Args) => identify::run;
    Keys(keys::Args) => keys::run;
    Merge(merge::Args) => merge::run;
    Params(params::Args) => params::run;
    Stress(stress::Args) => stress::run, campaign;
    Sweep(sweep::Args) => sweep::run, campaign;
    Test(test::Args) => test::run;
    /// Natural frequencies of the drive arm by the wave-vector method.
    Modes(Passed) => study;
    /// Run time against error.
    Bench(Passed) => study;
    /// The study's figures and which of its claims hold.
    Paper(Passed) => study;
}

/// Arguments of a verb that another part of `rig` has, see [`Extra`].
#[derive(Debug, clap::Args)]
#[command(disable_help_flag = true)]
struct Passed {
    /// Arguments of that part; `--help` shows them.
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, value_name = "ARGS")]
    _all: Vec<OsString>,
}

fn study(_: &Passed) -> Result<Outcome, Failure> {
    Err(Failure::Elsewhere(Extra::Study))
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
    fn every_verb_and_option_has_help_and_every_campaign_can_be_merged() {
        let mut campaigns = 0;
        for verb in Cli::command().get_subcommands() {
            assert!(verb.get_about().is_some(), "{}", verb.get_name());
            for arg in verb.get_arguments() {
                assert!(arg.get_help().is_some(), "{} {}", verb.get_name(), arg.get_id());
                campaigns += usize::from(arg.get_id() == "shard");
            }
        }
        assert_eq!(campaigns, Verb::CAMPAIGNS);
    }
}
