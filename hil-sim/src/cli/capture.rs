//! `rig capture`: writes a log into files as it arrives.

use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use super::failure::{Failure, Outcome};
use super::output::{self, WithFiles};
use super::source::SourceArgs;
use crate::files::make_directory;
use crate::progress;
use crate::record::{Header, Metadata, Source, View, WriteError, Writer, write_metadata};
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
    let name = free_name(args)?;
    let path = |ending: &&str| args.out.join(format!("{name}.{ending}"));
    let mut files: Vec<PathBuf> = endings.iter().map(path).collect();
    let mcap = created(&files[0])?;
    let csv = files.get(1).map(|path| created(path)).transpose()?;
    let parameters = scenario.map(Scenario::to_toml);
    let failed = |error: WriteError| Failure::run(format!("{}: {error}", args.out.display()));
    let stopped = Arc::new(AtomicBool::new(false));
    let stop = Arc::clone(&stopped);
    // Without it Ctrl-C ends the program at once, and the files say that they were cut off.
    // The second one does so where the source gives nothing.
    let _ = ctrlc::set_handler(move || {
        if stop.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
    });
    let mut described =
        Described { csv: files.get(1).cloned(), parameters: parameters.clone(), known: None };
    let mut writer =
        Writer::new(Some(mcap), csv, parameters.as_deref(), !args.bare).map_err(failed)?;
    let (progress, started) = (progress::spinner("waiting for the first frame"), Instant::now());
    let mut view = View::default();
    while let Some(bytes) = source.read().map_err(Failure::run)? {
        writer.take(&bytes, &mut |item| view.see(item)).map_err(failed)?;
        described.update(writer.header())?;
        for line in source.news() {
            progress.line(&line);
        }
        if view.count(writer.counts()) {
            progress.say(&view.text(writer.counts()));
        }
        let is_over = args.seconds.is_some_and(|most| started.elapsed().as_secs_f64() >= most);
        if is_over || stopped.load(Ordering::Relaxed) {
            break;
        }
    }
    let counts = writer.finish(&mut |item| view.see(item)).map_err(failed)?;
    drop(progress);
    files.extend(described.finish(counts.ticks)?);
    let printed = WithFiles { result: &counts, files: &files };
    output::result(args.json, &printed, || view.text(&counts) + "\n" + &output::wrote(&files))?;
    Ok(Outcome::of(counts.is_complete()))
}

/// The metadata of the table, which are there as soon as the target's identity is known.
struct Described {
    csv: Option<PathBuf>,
    parameters: Option<String>,
    known: Option<Header>,
}

impl Described {
    fn update(&mut self, header: Option<&Header>) -> Result<(), Failure> {
        if header.is_some() && self.known.as_ref() != header {
            self.known = header.cloned();
            self.write(None)?;
        }
        Ok(())
    }

    fn finish(&self, ticks: u64) -> Result<Option<PathBuf>, Failure> {
        self.write(Some(ticks))
    }

    fn write(&self, ticks: Option<u64>) -> Result<Option<PathBuf>, Failure> {
        let Some(csv) = &self.csv else { return Ok(None) };
        let (header, parameters) = (self.known.clone(), self.parameters.clone());
        Ok(Some(write_metadata(csv, &Metadata { header, parameters, ticks }, false)?))
    }
}

/// The name of the files: what is there is kept.
fn free_name(args: &Args) -> Result<String, Failure> {
    let is_taken = |name: &str| {
        let taken = ["mcap", "csv"].map(|ending| args.out.join(format!("{name}.{ending}")));
        taken.into_iter().find(|path| path.exists())
    };
    match &args.name {
        Some(name) => match is_taken(name) {
            Some(path) => {
                let path = path.display();
                Err(Failure::input(format!("{path}: is there already; give another --name")))
            }
            None => Ok(name.clone()),
        },
        None => {
            let numbered = (2..).map(|n: u32| format!("log-{n}"));
            let mut names = std::iter::once("log".to_owned()).chain(numbered);
            Ok(names.find(|name| is_taken(name).is_none()).unwrap_or_default())
        }
    }
}

fn created(path: &Path) -> Result<BufWriter<File>, Failure> {
    let file = File::create(path);
    let file = file.map_err(|error| Failure::input(format!("{}: {error}", path.display())))?;
    Ok(BufWriter::new(file))
}
