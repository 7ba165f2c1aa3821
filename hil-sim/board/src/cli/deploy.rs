//! `rig deploy --target board`: the firmware itself, on the emulated board.

use std::path::{Path, PathBuf};

use hil_sim::cli::deploy::{Args, looped, place, write};
use hil_sim::cli::failure::{Failure, Outcome};
use hil_sim::cli::output;
use hil_sim::cli::terminal;
use hil_sim::firmware::{self, Profile};
use hil_sim::record::Summary;
use hil_sim::report::Section;
use hil_sim::scenario::Scenario;
use hil_sim::{files, progress};

use crate::load::{Load, TITLE};
use crate::log::Line;
use crate::port::EmulatedPort;
use crate::run::{self, RunOptions};

/// What `--json` prints.
#[derive(serde::Serialize)]
struct Printed<'a> {
    #[serde(flatten)]
    summary: &'a Summary,
    account: &'a Load,
    /// Budgets that the load misses.
    missed: &'a [String],
    files: &'a [PathBuf],
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let (scenario, directory) = args.resolve()?;
    run::check(&scenario).map_err(Failure::input)?;
    if args.hil {
        return in_the_loop(args, &scenario, directory.as_deref());
    }
    let elf = firmware::image(Profile::Release)?;
    let show = |t_s: f64, line: &Line| {
        if args.log {
            eprintln!("[{t_s:8.3}] {:<5} {}", line.level, line.text);
        }
    };
    let wait_states = args.verbose || args.json;
    let options = RunOptions { rows: directory.is_some(), wait_states };
    let ran = {
        let _progress = (!args.log).then(|| progress::spinner(scenario.run.direction.name()));
        run::run(&elf, &scenario, &options, show).map_err(Failure::run)?
    };
    let missed = ran.load.missed();
    let mut files = Vec::new();
    if let Some(directory) = directory {
        let section = Section { title: TITLE, body: ran.load.html(&missed) };
        let directory = place(args, &ran.recording.summary, &directory);
        files = write(&ran.recording, &[section], &directory)?;
        let log = directory.join("log.txt");
        let lines = ran.recording.log.iter();
        let text: String =
            lines.map(|line| format!("[{:8.3}] {}\n", line.t_s, line.text)).collect();
        files::write_text(&log, &text)?;
        files.push(log);
    }
    let summary = &ran.recording.summary;
    for stray in &ran.load.unmodelled {
        eprintln!("warning: {stray}");
    }
    let printed = Printed { summary, account: &ran.load, missed: &missed, files: &files };
    output::result(args.json, &printed, || {
        terminal::run(summary, &files, args.verbose) + &ran.load.text(&missed)
    })?;
    Ok(outcome(summary, &ran.load))
}

/// A run is good that arrives without a fault, keeps to the chip's rules and to every budget.
fn outcome(summary: &Summary, load: &Load) -> Outcome {
    let clean = load.unmodelled.is_empty() && load.missed().is_empty();
    Outcome::of(summary.completed && summary.faults.is_empty() && clean)
}

/// The plant not at the board's pins, but in the loop over its debug probe.
fn in_the_loop(
    args: &Args,
    scenario: &Scenario,
    directory: Option<&Path>,
) -> Result<Outcome, Failure> {
    let elf = firmware::image(Profile::Loop)?;
    let mut port = EmulatedPort::new(&elf).map_err(Failure::run)?;
    crate::params::store(&mut port.machine, scenario).map_err(Failure::run)?;
    looped::close(args, &mut port, scenario, directory, "board")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_budget_that_is_missed_fails_the_run() {
        let summary = Summary { completed: true, ..Summary::default() };
        let load = |load| Load { load, ..Load::default() };
        assert_eq!(outcome(&summary, &load(0.05)), Outcome::Good);
        assert_eq!(outcome(&summary, &load(0.5)), Outcome::Bad);
        assert_eq!(outcome(&Summary::default(), &load(0.05)), Outcome::Bad);
    }
}
