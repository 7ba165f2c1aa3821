//! `rig merge`: the parts of a campaign as one.

use std::path::PathBuf;

use clap::Parser;

use super::campaign::{CampaignArgs, Part, Show};
use super::failure::{Failure, Outcome};
use super::{Cli, parse};

/// Prints what one machine would have printed, from the parts that several have run with
/// --shard I/N --json.
///
/// A scenario file that the parts have read must be there as well. If a part is missing, the
/// outcome is that of the others, says so, and the exit code is 1.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The parts, JSON, in any order.
    #[arg(value_name = "PART", required = true)]
    parts: Vec<PathBuf>,

    #[command(flatten)]
    show: Show,
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let part = Part::merged(&args.parts)?;
    let words = std::iter::once("rig").chain(part.command.iter().map(String::as_str));
    let mut cli = Cli::try_parse_from(words)
        .map_err(|error| Failure::input(parse::line(&error.to_string())))?;
    let command = part.command.join(" ");
    let campaign = cli.verb.campaign();
    let campaign = campaign.ok_or_else(|| Failure::input(format!("`{command}`: no campaign")))?;
    *campaign = CampaignArgs::of_parts(args.show.clone(), part);
    cli.verb.run()
}
