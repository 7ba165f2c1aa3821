//! `rig bench`: run time against error.

use std::path::PathBuf;

use serde::Serialize;

use crate::bench::{self, Options, Report, page};
use crate::cli::{docs, failed, write};
use hil_sim::cli::failure::{Failure, Outcome};
use hil_sim::cli::output;
use hil_sim::progress;

/// Measures run time against error: the rolled-out tread in fixed point, the
/// plant's resolution.
///
/// Times are processor time of one thread.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Writes the tables into `docs/EMULATION.md` and `docs/PLANT.md`, and the plots.
    #[arg(long)]
    docs: bool,

    /// Without cycles of the emulated board, which is built once if need be.
    #[arg(long)]
    host: bool,

    /// Two resolutions of the plant instead of sixteen.
    #[arg(long, conflicts_with = "docs")]
    quick: bool,

    /// Prints the result as one JSON object.
    #[arg(long)]
    json: bool,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Printed<'a> {
    #[serde(flatten)]
    report: &'a Report,
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    written: &'a [PathBuf],
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let report = {
        let spinner = progress::spinner("bench");
        let options = Options { quick: args.quick, cycles: !args.host };
        let measured = bench::measure(options, &|what| spinner.say(what));
        measured.map_err(failed)?
    };
    let files = if args.docs {
        page::files(&report, &docs()).map_err(|error| failed(error.into()))?
    } else {
        Vec::new()
    };
    let written = write(&docs(), files)?;
    let printed = Printed { report: &report, written: &written };
    output::result(args.json, &printed, || page::tables(&report) + &output::wrote(&written))?;
    Ok(Outcome::Good)
}
