//! `rig capture`: a log into files, as it comes.

use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};
use std::time::Instant;

use serde::Serialize;

use super::failure::{Failure, Outcome};
use super::output;
use super::scenario::RunArgs;
use crate::capture::{Bytes, Source, View, Virtual, Writer};
use crate::export::make_directory;
use crate::log::Tally;
use crate::progress;
use crate::scenario::Scenario;

/// Sources beside a recorded stream.
const TARGETS: [&str; 3] = ["sil", "board", "probe"];

/// Writes the controller's log into an MCAP and a CSV file as it comes.
///
/// From a recorded stream of the binary channel, from a board at a debug probe, from the
/// emulated board, or from the controller on this host. What is missing is marked; a file that is cut off is read up
/// to its last second. The exit code is 1 if anything is missing.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Which rig, and how it is run.
    #[command(flatten)]
    pub run: RunArgs,

    /// Reads a recorded stream of the binary channel; `-` is standard input.
    #[arg(long, value_name = "FILE", conflicts_with = "target")]
    stream: Option<PathBuf>,

    /// Runs a deployment and captures it: sil, the controller on this host; or board, the
    /// firmware on an emulated board. Or probe: captures what a real board does, until
    /// Ctrl-C or --seconds; the probe may be unplugged for up to two minutes meanwhile.
    #[arg(long, value_name = "TARGET", default_value = "sil")]
    target: String,

    /// Directory of the files.
    #[arg(long, value_name = "DIR", default_value = "out/capture")]
    out: PathBuf,

    /// Name of the files, without its ending.
    #[arg(long, value_name = "NAME", default_value = "log")]
    name: String,

    /// Leaves decoded rows and the CSV file out: the frames alone, a tenth of the size.
    #[arg(long)]
    bare: bool,

    /// Ends after so many seconds of this host's time.
    #[arg(long, value_name = "S")]
    seconds: Option<f64>,

    /// Prints what came as one JSON object.
    #[arg(long)]
    json: bool,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Printed {
    #[serde(flatten)]
    tally: Tally,
    files: Vec<PathBuf>,
}

/// Runs the verb.
pub fn run(args: &Args) -> Result<Outcome, Failure> {
    if let Some(file) = &args.stream {
        return write(args, &mut opened(file)?, None);
    }
    let scenario = args.run.resolve()?;
    match args.target.as_str() {
        "sil" => write(args, &mut Virtual::new(&scenario, false)?, Some(&scenario)),
        "board" => board(args, &scenario),
        "probe" => probe(args),
        other => {
            let targets = TARGETS.join(", ");
            Err(Failure::input(format!(
                "--target {other}: not available; available targets: {targets}"
            )))
        }
    }
}

fn opened(file: &Path) -> Result<Bytes, Failure> {
    let name = file.display().to_string();
    if file == Path::new("-") {
        return Ok(Bytes::new("standard input".to_owned(), Box::new(std::io::stdin())));
    }
    let input = File::open(file).map_err(|error| Failure::input(format!("{name}: {error}")))?;
    Ok(Bytes::new(name, Box::new(input)))
}

#[cfg(not(feature = "probe"))]
fn probe(_: &Args) -> Result<Outcome, Failure> {
    Ok(Outcome::Code(crate::provision::go_on(crate::provision::Extra::Probe)?))
}

#[cfg(feature = "probe")]
fn probe(args: &Args) -> Result<Outcome, Failure> {
    write(args, &mut crate::capture::Probed::new(super::probe::patient()?), None)
}

fn board(_: &Args, _: &Scenario) -> Result<Outcome, Failure> {
    Ok(Outcome::Code(crate::provision::go_on(crate::provision::Extra::Board)?))
}

/// Writes what `source` gives until it ends.
pub fn write(
    args: &Args,
    source: &mut dyn Source,
    scenario: Option<&Scenario>,
) -> Result<Outcome, Failure> {
    make_directory(&args.out)?;
    let path = |ending: &str| args.out.join(format!("{}.{ending}", args.name));
    let mut files = vec![path("mcap")];
    let mcap = created(&files[0])?;
    let csv = if args.bare {
        None
    } else {
        files.push(path("csv"));
        Some(created(&files[1])?)
    };
    let parameters = scenario.map(Scenario::to_toml);
    let failed = |error: crate::capture::WriteError| {
        Failure::run(format!("{}: {error}", args.out.display()))
    };
    let mut writer =
        Writer::new(Some(mcap), csv, parameters.as_deref(), !args.bare).map_err(failed)?;
    let (progress, started) = (progress::spinner("waiting for the first frame"), Instant::now());
    let mut view = View::default();
    while let Some(bytes) = source.read().map_err(Failure::run)? {
        writer.take(&bytes, &mut |item| view.see(item)).map_err(failed)?;
        for line in source.news() {
            progress.line(&line);
        }
        if view.count(writer.tally()) {
            progress.say(&view.text(writer.tally()));
        }
        if args.seconds.is_some_and(|most| started.elapsed().as_secs_f64() >= most) {
            break;
        }
    }
    let tally = writer.finish(&mut |item| view.see(item)).map_err(failed)?;
    drop(progress);
    let printed = Printed { tally, files };
    output::result(args.json, &printed, || human(&view, &printed))?;
    Ok(Outcome::of(tally.ticks > 0 && tally.lost_frames == 0 && tally.lost_ticks == 0))
}

fn created(path: &Path) -> Result<BufWriter<File>, Failure> {
    let file = File::create(path);
    let file = file.map_err(|error| Failure::input(format!("{}: {error}", path.display())))?;
    Ok(BufWriter::new(file))
}

fn human(view: &View, printed: &Printed) -> String {
    let mut text = format!("{}\n", view.text(&printed.tally));
    for file in &printed.files {
        text += &format!("  wrote {}\n", file.display());
    }
    text
}
