//! `rig deploy`: a deployment, or the retraction.

pub mod looped;

use std::path::{Path, PathBuf};

use serde_json::Value;
use sha2::{Digest, Sha256};

use super::failure::{Failure, Outcome};
use super::output::{self, WithFiles};
use super::scenario::RunArgs;
use super::source::TARGETS;
use super::terminal;
use crate::files::{self, write_text};
use crate::firmware::FirmwareError;
use crate::record::{Recording, Summary};
use crate::scenario::{Scenario, brief};
use crate::{progress, record, report, session};

/// A deployment in closed loop, or the retraction.
///
/// Writes report, logs and summary. The exit code is 1 if the run ends in a fault or
/// does not complete.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// What is run.
    #[command(flatten)]
    pub run: RunArgs,

    /// What runs the controller: sil, the shipping control tick on this host; board, the
    /// firmware itself on an emulated board; or probe, the firmware on a real board, the
    /// plant on this host in the loop over its debug probe.
    #[arg(long, value_name = "TARGET", default_value = "sil", value_parser = TARGETS)]
    pub target: String,

    /// With --target board: the plant is in the loop as with --target probe, not at the
    /// board's pins.
    #[arg(long)]
    pub hil: bool,

    /// Shows the controller's log on standard error.
    #[arg(long)]
    pub log: bool,

    /// Directory of the files; by default one in `out`, named after the run.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,

    /// Writes no files.
    #[arg(long, conflicts_with = "out")]
    no_files: bool,

    /// Every column of the table of crossings; with --target board the flash's wait states, too
    #[arg(short, long)]
    pub verbose: bool,

    /// Prints the summary as one JSON object.
    #[arg(long)]
    pub json: bool,
}

impl Args {
    /// The scenario, and where the files go if there are to be any.
    pub fn resolve(&self) -> Result<(Scenario, Option<PathBuf>), Failure> {
        let scenario = self.run.resolve()?;
        let directory = if self.no_files { None } else { Some(directory(self, &scenario)?) };
        Ok((scenario, directory))
    }
}

/// Runs the verb.
pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    let (scenario, directory) = args.resolve()?;
    match args.target.as_str() {
        "sil" if args.hil => return Err(Failure::input("--hil: takes --target board")),
        "sil" => {}
        _ => return looped::on_board(args, &scenario, directory.as_deref()),
    }
    let recording = {
        let _progress = progress::spinner(scenario.run.direction.name());
        session::run(&scenario, session::Options { rows: directory.is_some(), speed: None })?
    };
    conclude(args, &recording, directory.as_deref())
}

/// Writes and prints a run.
pub(crate) fn conclude(
    args: &Args,
    recording: &Recording,
    directory: Option<&Path>,
) -> Result<Outcome, Failure> {
    if args.log {
        for line in &recording.log {
            eprintln!("[{:8.3}] {}", line.t_s, line.text);
        }
    }
    let files = match directory {
        Some(directory) => write(recording, &[], &place(args, &recording.summary, directory))?,
        None => Vec::new(),
    };
    let summary = &recording.summary;
    let printed = WithFiles { result: summary, files: &files };
    output::result(args.json, &printed, || terminal::run(summary, &files, args.verbose))?;
    Ok(Outcome::of(summary.completed && summary.faults.is_empty()))
}

/// The folder of this run: that which was asked for, or `directory` unless it has another run.
pub fn place(args: &Args, summary: &Summary, directory: &Path) -> PathBuf {
    let ours = identity(serde_json::to_value(summary).ok());
    files::place(args.out.as_deref(), directory, |folder| {
        let text = std::fs::read(folder.join("summary.json")).unwrap_or_default();
        let there = identity(serde_json::from_slice(&text).ok());
        there.is_some() && there != ours
    })
}

/// What makes a run the one that it is: its summary without how long it took to compute.
fn identity(summary: Option<Value>) -> Option<Value> {
    let mut summary = summary?;
    summary.as_object_mut()?.remove("real_time_factor");
    Some(summary)
}

/// An image that has been built.
pub fn read(path: &Path) -> Result<Vec<u8>, Failure> {
    let read = std::fs::read(path);
    Ok(read.map_err(|source| FirmwareError::Read { path: path.to_owned(), source })?)
}

/// Where the files go: as given, or named after the run.
fn directory(args: &Args, scenario: &Scenario) -> Result<PathBuf, Failure> {
    let directory = args.out.clone().unwrap_or_else(|| {
        let file = args.run.scenario.file().and_then(Path::file_stem);
        let rig = file.map_or(scenario.preset.as_str().into(), |stem| stem.to_string_lossy());
        let (direction, controller) =
            (scenario.run.direction.name(), scenario.run.controller.name());
        let board = match args.target.as_str() {
            "sil" => String::new(),
            "board" if args.hil => "-board-hil".to_owned(),
            other => format!("-{other}"),
        };
        let (seed, tag) = (scenario.run.seed, tag(args, scenario));
        Path::new("out").join(format!("{direction}-{rig}-{controller}-{seed}{board}{tag}"))
    });
    // Reported before the run, not after it.
    output::no_file(&directory)?;
    Ok(directory)
}

/// Longest list of overrides in the name of a folder, letters.
const LONGEST_TAG: usize = 60;

/// The overrides as part of a name: those that a scenario file, which names the run itself, does
/// not have; too long a list by its hash.
fn tag(args: &Args, scenario: &Scenario) -> String {
    let mut overrides = scenario.overrides();
    if let Some(file) = args.run.scenario.file()
        && let Ok(of_file) = Scenario::resolve(Some(&scenario.preset), Some(file), &[])
    {
        let of_file = of_file.overrides();
        overrides.retain(|key, value| of_file.get(key) != Some(value));
    }
    let list: String =
        overrides.iter().map(|(key, value)| format!("-{key}={}", brief(value))).collect();
    let is_plain = |letter: char| letter.is_ascii_alphanumeric() || "-._=,+".contains(letter);
    if list.len() <= LONGEST_TAG && list.chars().all(is_plain) {
        return list;
    }
    let hash: String = Sha256::digest(&list).iter().take(4).map(|b| format!("{b:02x}")).collect();
    format!("-set-{hash}")
}

/// Writes logs, summary, the page with `more` sections, and the overview picture.
pub fn write(
    recording: &Recording,
    more: &[report::Section],
    directory: &Path,
) -> Result<Vec<PathBuf>, Failure> {
    let mut files = record::write_all(recording, directory)?;
    let page = directory.join("report.html");
    write_text(&page, &report::html(recording, more))?;
    let picture = directory.join("overview.svg");
    write_text(&picture, &report::overview_svg(recording))?;
    files.insert(0, page);
    files.push(picture);
    Ok(files)
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    #[derive(Parser)]
    struct Only {
        #[command(flatten)]
        args: Args,
    }

    fn parsed(arguments: &str) -> Args {
        let all = std::iter::once("rig").chain(arguments.split_whitespace());
        Only::try_parse_from(all).unwrap().args
    }

    #[test]
    fn the_directory_is_named_after_the_run() {
        for (arguments, expected) in [
            ("", "out/deploy-prototype-scheduled-0"),
            ("--retract --rig fe --controller limit --seed 7", "out/retract-fe-limit-7"),
            ("--target board", "out/deploy-prototype-scheduled-0-board"),
            ("--target board --hil", "out/deploy-prototype-scheduled-0-board-hil"),
            ("--set tread.tau_s=0.20", "out/deploy-prototype-scheduled-0-tread.tau_s=0.2"),
            ("--set tread.tau_s=0.1059 --set run.seed=4", "out/deploy-prototype-scheduled-4"),
            (
                "--wide --set rig.step_positions_mm=18,40.5",
                "out/deploy-prototype-scheduled-0-rig.step_positions_mm=18,40.5-run.mismatch=wide",
            ),
            ("--out here", "here"),
        ] {
            let args = parsed(arguments);
            let directory = directory(&args, &args.run.resolve().unwrap()).unwrap();
            assert_eq!(directory, Path::new(expected), "{arguments}");
        }
    }

    #[test]
    fn many_overrides_become_a_name_of_bounded_length() {
        let name = |more: &str| {
            let faults = "run.faults=[{target=\"tread\",kind=\"torn\",at_s=2.0}]";
            let args = parsed(&format!("--set {faults} --set preload.limit_n=52 {more}"));
            directory(&args, &args.run.resolve().unwrap()).unwrap()
        };
        let (one, other) = (name("--set plant.mu=0.9"), name("--set plant.mu=0.8"));
        assert_ne!(one, other);
        let text = one.file_name().unwrap().to_str().unwrap();
        assert!(text.len() < 120 && !text.contains(['/', '"', ' ', '{']), "{text}");
    }
}
