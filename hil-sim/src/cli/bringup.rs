//! `rig bringup`: the first power-up of a rig.

use std::io;
use std::path::{Path, PathBuf};

use serde_json::{Map, Value, json};

use super::failure::{Failure, Outcome};
use super::output;
use super::params::scenario_of;
use crate::bringup::{self, Check, Line, Operator, Progress, Stage, Stdin, gates};
use crate::files::{make_directory, write_text};
use crate::identify::record::Record;
use crate::probe::Port;
use crate::record::{log_at, recordings};
use crate::scenario::Scenario;

/// Checks the wiring of a rig at its first power-up, stage by stage.
///
/// Reads the board, judges each sensor, then moves each motor a little in the firmware's
/// service mode, which has the bounds; asks before each motion. Writes what it found, a page,
/// and the parameters that it proposes, for `rig params restore`. A call that was broken off
/// goes on where it ended. The exit code is 1 if a check fails.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Scenario file that the board holds: its sources are kept in what is proposed.
    #[arg(value_name = "FILE")]
    file: Option<PathBuf>,

    /// The board: probe, a real one, or board, the emulated one.
    #[arg(long, value_name = "TARGET", default_value = "probe", value_parser = ["board", "probe"])]
    target: String,

    /// Directory of the files.
    #[arg(long, value_name = "DIR", default_value = gates::FOLDER)]
    pub out: PathBuf,

    /// Allows every motion unasked; what a hand has to do is still asked for.
    #[arg(long)]
    pub yes: bool,

    /// Begins again with the first stage.
    #[arg(long)]
    again: bool,

    /// Records the first crossing, by the log of a deployment at 5 mm/s: log.mcap, or its folder.
    #[arg(long, value_name = "LOG")]
    pub log: Option<PathBuf>,

    /// A mistake in the emulated board's wiring, to be found; may be given several times.
    #[arg(long, value_name = "NAME")]
    pub mistake: Vec<String>,

    /// Prints the result as one JSON object.
    #[arg(long)]
    json: bool,
}

impl Args {
    /// What the board is said to hold.
    pub fn scenario(&self) -> Result<Option<Scenario>, Failure> {
        let read = |path: &PathBuf| Scenario::resolve(None, Some(path), &[]);
        Ok(self.file.as_ref().map(read).transpose()?)
    }
}

/// Runs the verb.
pub fn run(args: &Args) -> Result<Outcome, Failure> {
    if let Some(log) = &args.log {
        return crossed(args, &log_at(log));
    }
    if args.target != "board" && !args.mistake.is_empty() {
        return Err(Failure::input("--mistake: only the emulated board has mistakes to choose"));
    }
    carry_out(args, &mut super::probe::reconnecting(&args.target)?, &mut person(args.yes))
}

/// The person at the terminal.
pub fn person(yes: bool) -> Stdin<io::StdinLock<'static>, io::Stderr> {
    Stdin::new(io::stdin().lock(), io::stderr(), yes)
}

/// Records the first crossing in this log.
fn crossed(args: &Args, log: &Path) -> Result<Outcome, Failure> {
    let scenario = Record::read(log, None)?.scenario;
    let run = recordings(log).map_err(Failure::input)?.pop().unwrap_or_default().summary;
    let gate = gates::crossed(&run, &scenario);
    let progress = gates::record(&args.out, Stage::Crossing, gate.clone(), &scenario, None);
    let progress = progress.map_err(Failure::input)?;
    write_text(&args.out.join("report.html"), &bringup::html(&progress))?;
    let lacking = gates::lacking(Some(&args.out.join(gates::MINE))).unwrap_or_default();
    let printed = json!({ "complete": gate.ok, "checks": [gate], "lacking": lacking });
    let text = || [&gate.measured, &gate.advice, &lacking].map(|line| format!("{line}\n")).concat();
    output::result(args.json, &printed, text)?;
    Ok(Outcome::of(gate.ok))
}

/// Carries it out at this port.
pub fn carry_out(
    args: &Args,
    port: &mut dyn Port,
    operator: &mut dyn Operator,
) -> Result<Outcome, Failure> {
    let given = args.scenario()?;
    make_directory(&args.out)?;
    let file = |name: &str| args.out.join(name);
    let mut line = Line::new(port);
    // A board that does not run yet has no parameters to ask for.
    let expected = match (line.held(), given) {
        (Ok(held), Some(given)) if held.rig != given.rig => {
            return Err(Failure::input(
                "the board holds other parameters than the file: `rig params restore` writes them, \
                 a reset of the board reads them",
            ));
        }
        (Ok(_), Some(given)) => given,
        (Ok(held), None) => scenario_of(&held),
        (Err(crate::params::StoreError::Silent { .. }), given) => given.unwrap_or_default(),
        (Err(error), _) => return Err(Failure::run(error)),
    };
    let state = file(gates::STATE);
    let kept = Progress::read(&state, &expected).filter(|_| !args.again);
    let mut progress = kept.unwrap_or_else(|| Progress::new(expected));
    let mut unwritten = None;
    let ended = bringup::run(
        &mut line,
        operator,
        &mut progress,
        &mut |text| eprintln!("{text}"),
        &mut |progress| unwritten = progress.write(&state).err().or(unwritten.take()),
    );
    if let Some(error) = unwritten {
        return Err(error.into());
    }
    let files = [state.clone(), file("report.html"), file(gates::MINE)];
    write_text(&files[1], &bringup::html(&progress))?;
    write_text(&files[2], &progress.proposed.to_toml())?;
    ended.map_err(Failure::run)?;
    // Key and measured value of each parameter that is to change.
    let proposed = bringup::proposals(&progress).into_iter().map(|(key, _, is)| (key, is.into()));
    let printed = json!({
        "complete": progress.is_complete(),
        "checks": progress.checks().collect::<Vec<_>>(),
        "proposed": proposed.collect::<Map<String, Value>>(),
        "files": files,
    });
    output::result(args.json, &printed, || human(&progress) + &output::wrote(&files))?;
    Ok(Outcome::of(progress.is_complete()))
}

fn human(progress: &Progress) -> String {
    let failed: Vec<&Check> = progress.checks().filter(|check| !check.ok).collect();
    let mut text = if failed.is_empty() { "every check passed\n" } else { "" }.to_owned();
    for check in failed {
        text += &format!("{}: {}\n  {}\n", check.name, check.measured, check.advice);
    }
    for (key, was, is) in bringup::proposals(progress) {
        text += &format!("  propose {key} = {is} (was {was})\n");
    }
    text
}
