//! `rig report`: the page of a log, or of two side by side.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use serde_json::json;

use super::failure::{Failure, Outcome};
use super::output::{self, WithFiles};
use super::terminal;
use crate::files::{is_other, make_directory, place, write_text};
use crate::record::{Recording, Summary, log_at, recordings};
use crate::report::{
    Difference, animated_svg, beside_svg, compare_html, compared, differences, log_html,
};
use crate::table::plain;

/// The page of a log as `deploy` writes it, or of two logs crossing by crossing.
///
/// A log of the virtual rig contains the truth; a captured one shows what the controller
/// measured, in a section for each start of the controller. The exit code is 1 if a part of a log
/// is missing.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The log: MCAP, bytes of the binary channel, or the folder of a run.
    #[arg(value_name = "LOG")]
    log: PathBuf,

    /// Another log to compare it with; a third one for the picture.
    #[arg(value_name = "OTHER", num_args = 0..=2)]
    others: Vec<PathBuf>,

    /// Where the page goes; by default beside the first log.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,

    /// With two or three logs: writes all in the same plots over time into this file, SVG.
    #[arg(long, value_name = "FILE", requires = "others")]
    picture: Option<PathBuf>,

    /// Writes a crossing of the run as an animated SVG into this file.
    #[arg(long, value_name = "FILE", conflicts_with = "others")]
    animation: Option<PathBuf>,

    /// Every column of the table of crossings.
    #[arg(short, long)]
    verbose: bool,

    /// Prints the ledger or the differences as one JSON object.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let log = log_at(&args.log);
    let others: Vec<PathBuf> = args.others.iter().map(|other| log_at(other)).collect();
    let inputs: Vec<&Path> = others.iter().chain([&log]).map(PathBuf::as_path).collect();
    let outputs = [
        ("--out", &args.out, "html"),
        ("--picture", &args.picture, "svg"),
        ("--animation", &args.animation, "svg"),
    ];
    for (name, to, ending) in outputs {
        let Some(to) = to else { continue };
        output::spare(name, to, &inputs)?;
        output::ends_in(name, to, ending)?;
    }
    let boots = recordings(&log).map_err(Failure::input)?;
    match (&others[..], &args.picture) {
        ([], _) => one(args, &log, &boots),
        ([_, third], None) => {
            let third = third.display();
            Err(Failure::input(format!("{third}: a third log needs --picture, which draws it")))
        }
        ([other, more @ ..], _) => two(args, (&log, &boots), other, more.first()),
    }
}

/// Where a page with this text goes: beside the first log a page of another content is kept.
fn page(args: &Args, log: &Path, ending: &str, text: &str) -> Result<PathBuf, Failure> {
    let usual = log.with_extension(ending);
    let page = place(args.out.as_deref(), &usual, |page| is_other(page, text));
    page.parent().map_or(Ok(()), make_directory)?;
    write_text(&page, text)?;
    Ok(page)
}

fn one(args: &Args, log: &Path, boots: &[Recording]) -> Result<Outcome, Failure> {
    let mut files = vec![page(args, log, "html", &log_html(boots))?];
    if let Some(to) = &args.animation {
        let picture = animated_svg(only(log, boots)?);
        let none =
            || Failure::input(format!("--animation: {}: no crossing is in it", log.display()));
        write_text(to, &picture.ok_or_else(none)?)?;
        files.push(to.clone());
    }
    let text = |boot: &Recording| terminal::run(&boot.summary, &[], args.verbose);
    if let [boot] = boots {
        let printed = WithFiles { result: &boot.summary, files: &files };
        output::result(args.json, &printed, || text(boot) + &output::wrote(&files))?;
    } else {
        let summaries: Vec<&Summary> = boots.iter().map(|boot| &boot.summary).collect();
        let starts = (1..).zip(boots);
        let one = |(n, boot)| format!("start {n} of {}\n{}", boots.len(), text(boot));
        output::result(args.json, &json!({ "starts": summaries, "files": files }), || {
            starts.map(one).collect::<String>() + &output::wrote(&files)
        })?;
    }
    Ok(Outcome::of(boots.iter().all(|boot| boot.summary.missing.is_empty())))
}

/// The one recording of a log that is compared.
fn only<'a>(log: &Path, boots: &'a [Recording]) -> Result<&'a Recording, Failure> {
    if let [boot] = boots {
        return Ok(boot);
    }
    let (log, starts) = (log.display(), boots.len());
    Err(Failure::input(format!(
        "{log}: {starts} starts of the controller, where one is compared; `rig report {log}` shows each"
    )))
}

fn two(
    args: &Args,
    (log, boots): (&Path, &[Recording]),
    path: &Path,
    third: Option<&PathBuf>,
) -> Result<Outcome, Failure> {
    let others = recordings(path).map_err(Failure::input)?;
    let (first, second) = (only(log, boots)?, only(path, &others)?);
    let names = (log.display().to_string(), path.display().to_string());
    let text = compare_html((&names.0, first), (&names.1, second));
    let mut files = vec![page(args, log, "compare.html", &text)?];
    if let Some(picture) = &args.picture {
        let thirds = third.map(|third| recordings(third)).transpose().map_err(Failure::input)?;
        let more = third.zip(thirds.as_deref());
        let mut runs = vec![(names.0.clone(), first), (names.1.clone(), second)];
        if let Some((path, boots)) = more {
            runs.push((path.display().to_string(), only(path, boots)?));
        }
        write_text(picture, &beside_svg(&titled(runs)))?;
        files.push(picture.clone());
    }
    let differences = differences(first, second);
    let printed = json!({ "differences": differences, "files": files });
    let missing = [(&names.0, first), (&names.1, second)].map(|(name, log)| {
        let lines = log.summary.missing.iter();
        lines.map(|what| format!("  {name}: incomplete log: {what}\n")).collect::<String>()
    });
    let is_complete = missing.concat().is_empty();
    output::result(args.json, &printed, || {
        let runs = [('A', &names.0, first), ('B', &names.1, second)];
        let runs = runs.map(|(letter, log, run)| terminal::one_of_two(letter, log, &run.summary));
        runs.concat() + &human(&differences) + &missing.concat() + &output::wrote(&files)
    })?;
    Ok(Outcome::of(is_complete))
}

/// Runs named by their strategies, or by their logs where two have the same.
fn titled(mut runs: Vec<(String, &Recording)>) -> Vec<(String, &Recording)> {
    let kinds: BTreeSet<&String> = runs.iter().map(|(_, run)| &run.summary.controller).collect();
    if kinds.len() == runs.len() {
        for (name, run) in &mut runs {
            *name = format!("{} strategy", run.summary.controller);
        }
    }
    runs
}

fn human(differences: &[Difference]) -> String {
    let (head, rows) = compared(differences);
    format!("{}\n", plain(&head, rows))
}
