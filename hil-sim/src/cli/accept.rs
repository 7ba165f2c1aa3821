//! `rig accept`: whether a rig is what its parameters say.

use std::path::PathBuf;

use super::failure::{Failure, Outcome};
use super::output;
use crate::bringup::{Stage, gates};
use crate::identify::accept::{Acceptance, accept, brief};
use crate::identify::record::Record;
use crate::progress;
use crate::record::{Summary, log_at, recordings};
use crate::table::{number, plain};

/// Accepts a rig by its logs: compares them with the virtual rig that has the parameters in them.
///
/// Each quantity, each parameter that the logs show, and each gap by a second way has a limit;
/// GETTING_STARTED states them. The exit code is 1 if the rig is not accepted.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Logs of one rig with its final parameters: log.mcap, or the folders of runs.
    #[arg(value_name = "LOG", required = true)]
    logs: Vec<PathBuf>,

    /// The gap at a step of the first log as a camera or a feeler gauge shows it, mm: 2=2.61. May be
    /// repeated; a gap without a reading is judged by the virtual rig's tread.
    #[arg(long, value_name = "STEP=MM", value_parser = reading)]
    gap: Vec<(usize, f64)>,

    /// Directory of the rig's first power-up, which records whether it is accepted.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,

    /// Prints the result as one JSON object.
    #[arg(long)]
    json: bool,
}

fn reading(text: &str) -> Result<(usize, f64), String> {
    let parts = text
        .split_once('=')
        .and_then(|(step, mm)| Some((step.trim().parse().ok()?, mm.trim().parse::<f64>().ok()?)));
    parts
        .filter(|&(step, mm)| step > 0 && mm > 0.0 && mm < 100.0)
        .ok_or_else(|| "a step from 1 and a gap in mm are expected, such as 2=2.61".to_owned())
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let logs: Vec<PathBuf> = args.logs.iter().map(|log| log_at(log)).collect();
    let records: Vec<Record> =
        logs.iter().map(|log| Record::read(log, None)).collect::<Result<_, _>>()?;
    let one = |log: &PathBuf| -> Result<Summary, Failure> {
        let mut boots = recordings(log).map_err(Failure::input)?;
        Ok(boots.pop().map(|boot| boot.summary).unwrap_or_default())
    };
    let runs: Vec<Summary> = logs.iter().map(one).collect::<Result<_, _>>()?;
    let crossed =
        |step: usize| runs[0].crossings.iter().any(|line| usize::from(line.index) == step);
    if let Some((step, _)) = args.gap.iter().find(|(step, _)| !crossed(*step)) {
        return Err(Failure::input(format!("--gap: step {step} is not crossed in the first log")));
    }
    let result = {
        let _progress = progress::spinner("accept");
        accept(&records, &runs, &args.gap)?
    };
    if let Some(folder) = &args.out {
        let gate = gates::accepted(&result.reasons);
        let recorded = gates::record(folder, Stage::Acceptance, gate, &records[0].scenario, None);
        recorded.map_err(Failure::input)?;
    }
    output::result(args.json, &result, || human(&result))?;
    Ok(Outcome::of(result.passed))
}

fn human(of: &Acceptance) -> String {
    let mark = |ok: bool| if ok { "yes" } else { "NO" }.to_owned();
    let keys = of.keys.iter().map(|key| {
        let end = |end: Option<f64>| end.map_or("-".to_owned(), brief);
        let interval = format!("{} to {}", end(key.found.low), end(key.found.high));
        let [stated, limit] = [key.stated, key.limit].map(brief);
        let (name, unit) = (key.found.name.clone(), key.found.unit.to_owned());
        vec![name, unit, stated, interval, limit, mark(key.ok)]
    });
    let mut text = format!(
        "{}\n\n",
        plain(&["parameter", "unit", "stated", "in the logs", "limit", "ok"], keys)
    );
    let rows = of.residuals.iter().map(|row| {
        let rms = number(row.rms, 3);
        vec![row.quantity.to_owned(), row.unit.to_owned(), rms, row.limit.to_string(), mark(row.ok)]
    });
    text +=
        &format!("{}\n\n", plain(&["against the virtual rig", "unit", "rms", "limit", "ok"], rows));
    let gaps = of.gap.iter().map(|gap| {
        let by = gap.by.unwrap_or("-").to_owned();
        let (measured, other) = (number(gap.measured_mm, 3), number(gap.independent_mm, 3));
        vec![gap.log.clone(), gap.step.to_string(), measured, other, by, mark(gap.ok)]
    });
    text += &format!("{}\n", plain(&["log", "step", "gap, mm", "second way", "by", "ok"], gaps));
    text += if of.passed { "accepted\n" } else { "not accepted:\n" };
    of.reasons.iter().for_each(|why| text += &format!("  {why}\n"));
    text
}
