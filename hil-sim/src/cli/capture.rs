//! `rig capture`: writes a log into files as it arrives.

use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};
use std::time::Instant;

use super::failure::{Failure, Outcome};
use super::output::{self, WithFiles};
use super::source::SourceArgs;
use crate::files::make_directory;
use crate::progress;
use crate::record::{Source, View, WriteError, Writer};
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

    /// Name of the files, without its ending.
    #[arg(long, value_name = "NAME", default_value = "log")]
    name: String,

    /// Leaves decoded ticks and the CSV file out: the frames alone, a tenth of the size.
    #[arg(long)]
    bare: bool,

    /// Ends after so many seconds of this host's time.
    #[arg(long, value_name = "S")]
    seconds: Option<f64>,

    /// Prints what came as one JSON object.
    #[arg(long)]
    json: bool,
}

/// Runs the verb.
pub fn run(args: &Args) -> Result<Outcome, Failure> {
    args.source.open(false, |source, scenario| write(args, source, scenario))
}

/// Writes what `source` gives until it ends.
pub fn write(
    args: &Args,
    source: &mut dyn Source,
    scenario: Option<&Scenario>,
) -> Result<Outcome, Failure> {
    make_directory(&args.out)?;
    let endings = if args.bare { &["mcap"][..] } else { &["mcap", "csv"] };
    let path = |ending: &&str| args.out.join(format!("{}.{ending}", args.name));
    let files: Vec<PathBuf> = endings.iter().map(path).collect();
    let mcap = created(&files[0])?;
    let csv = files.get(1).map(|path| created(path)).transpose()?;
    let parameters = scenario.map(Scenario::to_toml);
    let failed = |error: WriteError| Failure::run(format!("{}: {error}", args.out.display()));
    let mut writer =
        Writer::new(Some(mcap), csv, parameters.as_deref(), !args.bare).map_err(failed)?;
    let (progress, started) = (progress::spinner("waiting for the first frame"), Instant::now());
    let mut view = View::default();
    while let Some(bytes) = source.read().map_err(Failure::run)? {
        writer.take(&bytes, &mut |item| view.see(item)).map_err(failed)?;
        for line in source.news() {
            progress.line(&line);
        }
        if view.count(writer.counts()) {
            progress.say(&view.text(writer.counts()));
        }
        if args.seconds.is_some_and(|most| started.elapsed().as_secs_f64() >= most) {
            break;
        }
    }
    let counts = writer.finish(&mut |item| view.see(item)).map_err(failed)?;
    drop(progress);
    let printed = WithFiles { result: &counts, files: &files };
    output::result(args.json, &printed, || view.text(&counts) + "\n" + &output::wrote(&files))?;
    Ok(Outcome::of(counts.is_complete()))
}

fn created(path: &Path) -> Result<BufWriter<File>, Failure> {
    let file = File::create(path);
    let file = file.map_err(|error| Failure::input(format!("{}: {error}", path.display())))?;
    Ok(BufWriter::new(file))
}
