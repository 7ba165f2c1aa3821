//! `rig replay`: runs recorded logs through the controller again, bit by bit.

use std::path::{Path, PathBuf};

use serde::Serialize;
use serde_json::json;

use super::failure::{Failure, Outcome};
use super::output;
use crate::record::{Cut, Mark, Run, Unknown};
use crate::replay::{Replayed, replay};
use crate::table::counted;

/// Runs recorded logs through the controller again; it must give the same bits.
///
/// The parameters are those in the log, or the preset that it names. The exit code is 1 at
/// the first difference, which is shown, if a part of a log cannot be run again because
/// something before it is missing, or if the file is cut off.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// Logs: MCAP, CSV of rows, or bytes of the channel.
    #[arg(required = true, value_name = "LOG")]
    logs: Vec<PathBuf>,

    /// Overrides a parameter, any number of times; for logs without their parameters.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,

    /// Prints the results as one JSON object.
    #[arg(long)]
    json: bool,
}

/// What `--json` prints of a log.
#[derive(Serialize)]
struct Log {
    file: PathBuf,
    equal: bool,
    cut: Option<Cut>,
    #[serde(flatten)]
    result: Replayed,
}

/// Runs the verb.
pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    let mut logs = Vec::new();
    for file in &args.logs {
        let run = Run::read(file).map_err(Failure::input)?;
        let scenario = run.scenario(&args.set).map_err(|error| unknown(file, &error))?;
        let result = replay(&run, &scenario.rig)?;
        let (equal, cut) = (result.is_equal() && run.cut.is_none(), run.cut);
        logs.push(Log { file: file.clone(), equal, cut, result });
    }
    let equal = logs.iter().all(|log| log.equal);
    let printed = json!({ "equal": equal, "logs": logs });
    output::result(args.json, &printed, || logs.iter().map(human).collect())?;
    Ok(Outcome::of(equal))
}

/// The parameters of the controller that made a log are not known.
fn unknown(file: &Path, error: &Unknown) -> Failure {
    let advice = match error {
        Unknown::Unnamed => ": give it with --set preset=NAME and what differs from it",
        Unknown::Other(..) => ": give the others with --set",
        Unknown::Wrong(_) => "",
    };
    Failure::input(format!("{}: {error}{advice}", file.display()))
}

fn human(log: &Log) -> String {
    let (file, result) = (log.file.display(), &log.result);
    let (ticks, blind) = (counted(result.ticks, "tick"), counted(result.blind, "tick"));
    let mut text = match &result.difference {
        Some(difference) => format!("{file}: differs at {difference}\n"),
        None if log.equal => {
            let events = counted(result.events, "event");
            format!("{file}: {ticks} and {events}, equal\n")
        }
        None => format!("{file}: {ticks} equal\n"),
    };
    text += &log.cut.map_or_else(String::new, |cut| format!("  incomplete log: {cut}\n"));
    if let Some((tick, mark)) = result.missing {
        let why = match mark {
            Mark::Joined { .. } => "it does not begin with the target's start",
            _ => "the controller's state is not known after a gap",
        };
        text += &format!("  {blind} from {tick} on not run again: {why} ({mark})\n");
    } else if result.blind > 0 {
        text += &format!("  {blind} not run again: the log does not begin at boot\n");
    }
    text
}
