//! `rig replay`: runs recorded logs through the controller again, bit by bit.

use std::path::{Path, PathBuf};

use interstage::log::identity::fingerprint;
use interstage::rig::Rig;
use serde::Serialize;

use super::failure::{Failure, Outcome};
use super::output;
use crate::record::{Mark, Run};
use crate::replay::{Replayed, replay};
use crate::scenario::Scenario;

/// Runs recorded logs through the controller again; it must give the same bits.
///
/// The parameters are those in the log, or the preset that it names. The exit code is 1 at
/// the first difference, which is shown, or if a part of a log cannot be run again because
/// something before it is missing.
#[derive(Debug, clap::Args)]
pub struct Args {
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

/// What `--json` prints.
#[derive(Serialize)]
struct Printed {
    equal: bool,
    logs: Vec<Log>,
}

#[derive(Serialize)]
struct Log {
    file: PathBuf,
    equal: bool,
    #[serde(flatten)]
    result: Replayed,
}

/// Runs the verb.
pub fn run(args: &Args) -> Result<Outcome, Failure> {
    let mut logs = Vec::new();
    for file in &args.logs {
        let run = Run::read(file).map_err(Failure::input)?;
        let rig = parameters(file, &run, &args.set)?;
        let result = replay(&run, &rig)?;
        logs.push(Log { file: file.clone(), equal: result.is_equal(), result });
    }
    let printed = Printed { equal: logs.iter().all(|log| log.equal), logs };
    output::result(args.json, &printed, || printed.logs.iter().map(human).collect())?;
    Ok(Outcome::of(printed.equal))
}

/// The parameters of the controller that made a log.
fn parameters(file: &Path, run: &Run, sets: &[String]) -> Result<Rig, Failure> {
    let header = run.header.as_ref();
    let name = header.map_or("prototype", |header| header.rig.as_str());
    let rig = match &run.parameters {
        Some(toml) => Scenario::parse("parameters of the log", toml, sets)?.rig,
        None => Scenario::resolve(Some(name), None, sets)?.rig,
    };
    let here = format!("{:08x}", fingerprint(&rig));
    match header.map(|header| &header.parameters) {
        Some(made) if *made != here => Err(Failure::input(format!(
            "{}: made with parameters {made}, these are {here}: give the others with --set",
            file.display()
        ))),
        _ => Ok(rig),
    }
}

fn human(log: &Log) -> String {
    let (file, result) = (log.file.display(), &log.result);
    let mut text = match &result.difference {
        Some(difference) => format!("{file}: differs at {difference}\n"),
        None if log.equal => {
            format!("{file}: {} ticks and {} entries, equal\n", result.ticks, result.events)
        }
        None => format!("{file}: {} ticks equal\n", result.ticks),
    };
    if let Some((tick, mark)) = result.missing {
        let why = match mark {
            Mark::Joined { .. } => "it does not begin with the target's start",
            _ => "the controller's state is not known after a gap",
        };
        text += &format!("  {} ticks from {tick} on not run again: {why} ({mark})\n", result.blind);
    } else if result.blind > 0 {
        text +=
            &format!("  {} ticks not run again: the log does not begin at boot\n", result.blind);
    }
    text
}
