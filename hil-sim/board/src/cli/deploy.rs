//! `rig deploy --target board`: the firmware itself, on the emulated board.

mod account;

use std::path::Path;

use super::Args;
use hil_sim::cli::failure::{Failure, Outcome};
use hil_sim::scenario::Scenario;

/// Without the emulated board: go on with a binary that has it.
#[cfg(not(feature = "board"))]
pub(super) fn run(_: &Args, _: &Scenario, _: Option<&Path>) -> Result<Outcome, Failure> {
    Ok(Outcome::Code(hil_sim::provision::go_on()?))
}

/// What `--json` prints.
#[derive(serde::Serialize)]
struct Printed<'a> {
    #[serde(flatten)]
    summary: &'a hil_sim::record::Summary,
    account: &'a crate::load::Load,
    /// Budgets that the account misses.
    missed: &'a [String],
    files: &'a [std::path::PathBuf],
}

pub(super) fn run(
    args: &Args,
    scenario: &Scenario,
    directory: Option<&Path>,
) -> Result<Outcome, Failure> {
    use crate::bench::budget::Budget;
    use crate::gdb;
    use crate::load::page;
    use crate::run::{self, Asked};
    use crate::{progress, table};
    use hil_sim::cli::output;
    use hil_sim::firmware::{self, Profile};
    use hil_sim::report::Section;

    run::check(scenario).map_err(Failure::input)?;
    let faults: Result<Vec<_>, _> = args.board_fault.iter().map(|text| text.parse()).collect();
    let faults = faults.map_err(|error| Failure::input(format!("--board-fault {error}")))?;
    let listener = args.gdb.as_deref().map(gdb::listen).transpose().map_err(Failure::input)?;
    let asked = Asked { rows: directory.is_some(), faults };
    let elf = firmware::build(Profile::Release)?;
    let image = std::fs::read(&elf)
        .map_err(|source| firmware::FirmwareError::Read { path: elf.clone(), source })?;
    if let Some(listener) = listener {
        let address = listener.local_addr().map_err(Failure::run)?;
        eprintln!("waiting for a debugger: gdb {} -ex 'target remote {address}'", elf.display());
        let show = |t_s: f64, line: &crate::log::Line| {
            eprintln!("[{t_s:8.3}] {:<5} {}", line.level, line.text);
        };
        gdb::serve(&listener, &image, scenario, show).map_err(Failure::run)?;
        return Ok(Outcome::of(true));
    }
    let ran = {
        let _progress = (!args.log).then(|| progress::spinner(scenario.run.direction.name()));
        let show = |t_s: f64, line: &crate::log::Line| {
            if args.log {
                eprintln!("[{t_s:8.3}] {:<5} {}", line.level, line.text);
            }
        };
        run::run_with(&image, scenario, &asked, show).map_err(Failure::run)?
    };
    let missed = ran.load.missed(&Budget::shipped().map_err(Failure::run)?.board);
    let mut files = Vec::new();
    if let Some(directory) = directory {
        let account = Section { title: page::TITLE, body: page::html(&ran.load, &missed) };
        files = super::write(&ran.recording, &[account], directory)?;
        let log = directory.join("log.txt");
        let lines = ran.recording.log.iter();
        let text: String =
            lines.map(|line| format!("[{:8.3}] {}\n", line.t_s, line.text)).collect();
        hil_sim::export::write_text(&log, &text)?;
        files.push(log);
    }
    let summary = &ran.recording.summary;
    for stray in &ran.load.unmodelled {
        eprintln!("warning: {stray}");
    }
    let printed = Printed { summary, account: &ran.load, missed: &missed, files: &files };
    output::result(args.json, &printed, || {
        table::run(summary, &files) + &account::text(&ran.load, &missed)
    })?;
    let clean = ran.load.unmodelled.is_empty();
    Ok(Outcome::of(summary.completed && summary.faults.is_empty() && clean))
}
