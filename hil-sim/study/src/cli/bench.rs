//! `rig bench`: run time against error.

use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::bench::history::{self, Change, Entry};
use crate::bench::{self, Options, Report, page};
use hil_sim::cli::failure::{Failure, Outcome};
use hil_sim::cli::output;
use hil_sim::files::write_text;
use hil_sim::progress;

/// Measures run time against error: the reduced model in five arithmetics, the plant's
/// resolution, other engines on the same crossing, what skipping saves.
///
/// Times are processor time of one thread. The exit code is 1 if a bound that does not
/// depend on the machine is broken (`hil-sim/budget.toml`).
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The same crossing by MuJoCo and by SciPy's ODE solvers too.
    ///
    /// Needs Python 3 and the network once: they are installed into a virtual
    /// environment under `target/`. Without them the rest still runs.
    #[arg(long)]
    peers: bool,

    /// Writes `docs/PERFORMANCE.md` and its plots.
    #[arg(long)]
    docs: bool,

    /// Appends the figures to `docs/performance/history.jsonl`.
    #[arg(long)]
    record: bool,

    /// Without the emulated board: no cycles.
    ///
    /// A `rig` that lacks the board builds one that has it, once, and goes on in that;
    /// where it cannot be had, cycles are left out with a note.
    #[arg(long)]
    host: bool,

    /// Fewer resolutions against a less converged run; for trying it out.
    #[arg(long, conflicts_with_all = ["docs", "record"])]
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
    /// What has moved since the last record.
    changes: &'a [Change],
    #[serde(skip_serializing_if = "Vec::is_empty")]
    written: Vec<PathBuf>,
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    #[cfg(not(feature = "board"))]
    if !args.host {
        match hil_sim::provision::go_on() {
            Ok(code) => return Ok(Outcome::Code(code)),
            Err(error) => eprintln!("without cycles: {error}"),
        }
    }
    let broken_off = |error: anyhow::Error| Failure::run(format!("{error:#}"));
    let report = {
        let spinner = progress::spinner("bench");
        let options = Options { peers: args.peers, quick: args.quick, cycles: !args.host };
        bench::measure(options, &|what| spinner.say(what)).map_err(broken_off)?
    };
    let entry = Entry::of(&report);
    let path = history::path();
    let records = history::read(&path).map_err(Failure::input)?;
    let changes = records.last().map(|last| entry.since(last)).unwrap_or_default();
    let mut written = Vec::new();
    if args.docs {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).with_file_name("docs");
        for (name, text) in page::files(&report) {
            let path = folder.join(name);
            write_text(&path, &text)?;
            written.push(path);
        }
    }
    if args.record {
        history::append(&path, &entry).map_err(broken_off)?;
        written.push(path);
    }
    let printed = Printed { report: &report, changes: &changes, written };
    output::result(args.json, &printed, || human(&printed))?;
    Ok(Outcome::of(!report.budgets.iter().any(|line| line.broken())))
}

fn human(printed: &Printed<'_>) -> String {
    let mut text = page::tables(printed.report);
    if !printed.changes.is_empty() {
        text += "\nMoved since the last record\n";
        for change in printed.changes {
            let Change { name, before, now } = change;
            text += &format!("  {name}: {} to {}\n", page::short(*before), page::short(*now));
        }
    }
    for path in &printed.written {
        text += &format!("wrote {}\n", path.display());
    }
    text
}
