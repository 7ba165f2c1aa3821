//! `rig capture`: writes a log into files as it arrives.

use std::path::PathBuf;
use std::time::Instant;

use super::failure::{Failure, Outcome};
use super::log_files::{LogFiles, Stop};
use super::output::{self, WithFiles};
use super::parse::seconds;
use super::source::SourceArgs;
use crate::progress;
use crate::record::{Source, View};
use crate::scenario::Scenario;

/// Writes the controller's log into an MCAP and a CSV file as it arrives.
///
/// Of a deployment that it runs; from a board at a debug probe, until Ctrl-C or --seconds; or
/// from a recorded stream. What is missing is marked; a file that is cut off is read up to its
/// last second. The exit code is 1 if anything is missing.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Where the log comes from.
    #[command(flatten)]
    pub source: SourceArgs,

    /// Directory of the files.
    #[arg(long, value_name = "DIR", default_value = "out/capture")]
    out: PathBuf,

    /// Name of the files, without its ending; by default log, with a number if there is one.
    #[arg(long, value_name = "NAME")]
    name: Option<String>,

    /// Leaves decoded ticks and the CSV file out: the frames alone, a tenth of the size.
    #[arg(long)]
    bare: bool,

    /// Ends after so many seconds of this host's time.
    #[arg(long, value_name = "S", allow_negative_numbers = true, value_parser = seconds)]
    seconds: Option<f64>,

    /// Prints what came as one JSON object.
    #[arg(long)]
    json: bool,
}

/// Runs the verb.
pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    args.source.open(false, |source, scenario| write(args, source, scenario))
}

/// Writes what `source` gives until it ends.
pub fn write(
    args: &Args,
    source: &mut dyn Source,
    scenario: &Scenario,
) -> Result<Outcome, Failure> {
    let mut files = LogFiles::new(&args.out, args.name.as_deref(), args.bare, scenario)?;
    let stop = Stop::by_ctrl_c();
    let (progress, started) = (progress::spinner("waiting for the first frame"), Instant::now());
    let mut view = View::default();
    while let Some(bytes) = source.read().map_err(Failure::run)? {
        files.take(&bytes, &mut |item| view.see(item))?;
        for line in source.news().into_iter().chain(files.news()) {
            progress.line(&line);
        }
        if view.count(files.counts()) {
            progress.say(&view.text(files.counts()));
        }
        let is_over = args.seconds.is_some_and(|most| started.elapsed().as_secs_f64() >= most);
        if is_over || stop.is_wanted() {
            break;
        }
    }
    let (counts, files) = files.finish(&mut |item| view.see(item))?;
    drop(progress);
    let printed = WithFiles { result: &counts, files: &files };
    output::result(args.json, &printed, || view.text(&counts) + "\n" + &output::wrote(&files))?;
    Ok(Outcome::of(counts.is_complete()))
}
