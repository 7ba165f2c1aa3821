//! `rig report`: the page of a log, or of two side by side.

use std::path::{Path, PathBuf};

use serde_json::json;

use super::failure::{Failure, Outcome};
use super::output::{self, WithFiles};
use super::terminal;
use crate::files::{make_directory, vacant_for, write_text};
use crate::record::{Recording, recording};
use crate::report::{Difference, beside_svg, compare_html, differences, html};
use crate::table;

/// The page of a log as `deploy` writes it, or of two logs crossing by crossing.
///
/// A log of the virtual rig contains the truth; a captured one shows what the controller
/// measured. The exit code is 1 if a part of a log is missing.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The log: MCAP, or bytes of the binary channel.
    #[arg(value_name = "LOG")]
    log: PathBuf,

    /// Another log to compare it with.
    #[arg(value_name = "OTHER")]
    other: Option<PathBuf>,

    /// Where the page goes; by default beside the first log.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,

    /// With two logs: writes both in the same plots over time into this file, SVG.
    #[arg(long, value_name = "FILE", requires = "other")]
    picture: Option<PathBuf>,

    /// Prints the ledger or the differences as one JSON object.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let first = recording(&args.log).map_err(Failure::input)?;
    match &args.other {
        None => one(args, &first),
        Some(other) => two(args, &first, other),
    }
}

/// Where a page with this text goes: beside the first log a page of another content is kept.
fn page(args: &Args, ending: &str, text: &str) -> Result<PathBuf, Failure> {
    let beside = || vacant_for(&args.log.with_extension(ending), text);
    let page = args.out.clone().unwrap_or_else(beside);
    if let Some(directory) = page.parent().filter(|directory| !directory.as_os_str().is_empty()) {
        make_directory(directory)?;
    }
    Ok(page)
}

fn one(args: &Args, recording: &Recording) -> Result<Outcome, Failure> {
    let text = html(recording, &[]);
    let files = [page(args, "html", &text)?];
    write_text(&files[0], &text)?;
    let printed = WithFiles { result: &recording.summary, files: &files };
    output::result(args.json, &printed, || terminal::run(&recording.summary, &files))?;
    Ok(Outcome::of(recording.summary.missing.is_empty()))
}

fn two(args: &Args, first: &Recording, path: &Path) -> Result<Outcome, Failure> {
    let second = recording(path).map_err(Failure::input)?;
    let names = (args.log.display().to_string(), path.display().to_string());
    let text = compare_html((&names.0, first), (&names.1, &second));
    let mut files = vec![page(args, "compare.html", &text)?];
    write_text(&files[0], &text)?;
    if let Some(picture) = &args.picture {
        let [a, b] = titles([(&names.0, first), (&names.1, &second)]);
        write_text(picture, &beside_svg([(&a, first), (&b, &second)]))?;
        files.push(picture.clone());
    }
    let differences = differences(first, &second);
    let printed = json!({ "differences": differences, "files": files });
    let missing = [(&names.0, first), (&names.1, &second)].map(|(name, log)| {
        let lines = log.summary.missing.iter();
        lines.map(|what| format!("  {name}: incomplete log: {what}\n")).collect::<String>()
    });
    let is_complete = missing.concat().is_empty();
    output::result(args.json, &printed, || {
        human(&differences) + &missing.concat() + &output::wrote(&files)
    })?;
    Ok(Outcome::of(is_complete))
}

/// Names of two runs: their strategies, or their logs where those are the same.
fn titles(runs: [(&String, &Recording); 2]) -> [String; 2] {
    let [a, b] = runs.map(|(_, run)| &run.summary.controller);
    if a == b {
        runs.map(|(name, _)| name.clone())
    } else {
        [a, b].map(|name| format!("{name} preload"))
    }
}

fn human(differences: &[Difference]) -> String {
    let rows = differences.iter().map(|difference| {
        let Difference { index, quantity, unit, decimals, a, b, change } = difference;
        let value = |value: &Option<f64>| table::number(*value, *decimals);
        vec![format!("{index}"), format!("{quantity}, {unit}"), value(a), value(b), value(change)]
    });
    format!("{}\n", table::plain(&["step", "quantity", "A", "B", "B - A"], rows))
}
