//! `rig report`: the page of a log, or of two side by side.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::failure::{Failure, Outcome};
use super::output;
use crate::files::{make_directory, write_text};
use crate::record::{Recording, Summary, recording};
use crate::report::{Difference, compare_html, differences, html};
use crate::table;

/// The page of a log as `deploy` writes it, or of two logs crossing by crossing.
///
/// A log of the virtual rig has the truth in it; one that was captured shows what the
/// controller believes.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The log: MCAP, CSV of rows, or bytes of the binary channel.
    #[arg(value_name = "LOG")]
    log: PathBuf,

    /// Another log to compare it with.
    #[arg(value_name = "OTHER")]
    other: Option<PathBuf>,

    /// Where the page goes; by default beside the first log.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,

    /// Prints the ledger or the differences as one JSON object.
    #[arg(long)]
    json: bool,
}

/// What `--json` prints of one log.
#[derive(Serialize)]
struct One<'a> {
    #[serde(flatten)]
    summary: &'a Summary,
    files: [&'a Path; 1],
}

/// What `--json` prints of two.
#[derive(Serialize)]
struct Two<'a> {
    differences: Vec<Difference>,
    files: [&'a Path; 1],
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let first = read(&args.log)?;
    match &args.other {
        None => one(args, &first),
        Some(other) => two(args, &first, other),
    }
}

fn read(path: &Path) -> Result<Recording, Failure> {
    recording(path).map_err(Failure::input)
}

/// Where the page goes.
fn page(args: &Args, ending: &str) -> Result<PathBuf, Failure> {
    let page = args.out.clone().unwrap_or_else(|| args.log.with_extension(ending));
    if let Some(directory) = page.parent().filter(|directory| !directory.as_os_str().is_empty()) {
        make_directory(directory)?;
    }
    Ok(page)
}

fn one(args: &Args, recording: &Recording) -> Result<Outcome, Failure> {
    let page = page(args, "html")?;
    write_text(&page, &html(recording, &[]))?;
    let printed = One { summary: &recording.summary, files: [&page] };
    output::result(args.json, &printed, || {
        table::run(&recording.summary, std::slice::from_ref(&page))
    })?;
    Ok(Outcome::Good)
}

fn two(args: &Args, first: &Recording, path: &Path) -> Result<Outcome, Failure> {
    let second = read(path)?;
    let page = page(args, "compare.html")?;
    let names = (args.log.display().to_string(), path.display().to_string());
    write_text(&page, &compare_html((&names.0, first), (&names.1, &second)))?;
    let printed = Two { differences: differences(first, &second), files: [&page] };
    output::result(args.json, &printed, || human(&printed))?;
    Ok(Outcome::Good)
}

fn human(printed: &Two<'_>) -> String {
    let rows = printed.differences.iter().map(|difference| {
        let Difference { index, quantity, unit, decimals, a, b, change } = difference;
        let value = |value: &Option<f64>| table::number(*value, *decimals);
        vec![format!("{index}"), format!("{quantity}, {unit}"), value(a), value(b), value(change)]
    });
    let table = table::plain(&["step", "quantity", "A", "B", "B - A"], rows);
    format!("{table}\n  wrote {}\n", printed.files[0].display())
}
