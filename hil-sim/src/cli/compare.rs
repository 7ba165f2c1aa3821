//! `rig compare`: the four strategies on the same random rigs.

use serde_json::{Map, Value, json};

use super::failure::{Failure, Outcome};
use super::output;
use super::scenario::RunArgs;
use crate::compare::{self, Comparison, Policy};
use crate::progress;
use crate::table::{number, plain};

/// Compares four preload strategies on the same random rigs: constant at cruise,
/// constant at the limit, reactive, scheduled.
///
/// Each is tuned until its worst gap over all rigs is the reference; then the times
/// are comparable. Once with the step-aware speed for all, once with one speed
/// throughout for those without look-ahead.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// How many rigs: the seeds that follow --seed.
    #[arg(short = 'n', value_name = "N", default_value_t = 200,
          value_parser = clap::value_parser!(u64).range(1..=100_000))]
    count: u64,

    #[command(flatten)]
    run: RunArgs,

    /// Prints the outcome as one JSON object.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let scenario = args.run.resolve()?;
    let rigs = args.count as usize;
    let comparison = {
        let bar = progress::bar("runs at most", compare::most_runs(rigs) as u64);
        compare::compare(&scenario, scenario.run.seed + 1, rigs, &|| bar.advance(1))?
    };
    output::result(args.json, &machine(&comparison), || human(&comparison))?;
    Ok(Outcome::Good)
}

/// The JSON object: the entries by the names of their controllers, those with one speed apart.
fn machine(comparison: &Comparison) -> Value {
    let entries = |policy: Policy| -> Map<String, Value> {
        let of_policy = comparison.entries.iter().filter(|entry| entry.policy == policy);
        of_policy.map(|entry| (entry.controller.to_owned(), json!(entry))).collect()
    };
    json!({
        "runs": comparison.runs,
        "gap_ref_mm": comparison.gap_ref_mm,
        "controllers": entries(Policy::StepAware),
        "one_speed": entries(Policy::OneSpeed),
    })
}

fn human(comparison: &Comparison) -> String {
    let head = [
        "controller",
        "speed",
        "crossing",
        "command s",
        "moving s",
        "gap mm",
        "slips",
        "short",
        "mean N",
        "J",
        "wear mJ",
    ];
    let rows = comparison.entries.iter().map(|entry| {
        let mark = if entry.tuned { "" } else { "~" };
        let speed = match entry.policy {
            Policy::StepAware => "by steps",
            Policy::OneSpeed => "one",
        };
        let crossing = entry
            .crossing_speed_mm_s
            .map_or_else(|| format!("-{:.1} %", entry.gap_reserve * 100.0), |v| format!("{v:.2}"));
        vec![
            entry.controller.to_owned(),
            speed.to_owned(),
            crossing,
            number(entry.duration_s, 2),
            number(entry.moving_s, 2),
            format!("{mark}{}", number(entry.worst_gap_mm, 3)),
            entry.slip_events.to_string(),
            entry.incomplete.to_string(),
            number(entry.mean_preload_n, 1),
            number(entry.energy_j, 2),
            number(entry.wear_j * 1e3, 2),
        ]
    });
    let mut text = format!(
        "{} rigs, each strategy tuned to a worst gap of {:.3} mm\n{}\nspeed: by steps, slow at the \
         steps alone; one, the same throughout. crossing: speed in mm/s, or\nthe reserve below the \
         reference gap that the schedule aims at. short: incomplete runs.\n",
        comparison.runs,
        comparison.gap_ref_mm,
        plain(&head, rows)
    );
    if comparison.entries.iter().any(|entry| !entry.tuned) {
        text += "~ could not be brought to the reference gap within its range of speeds\n";
    }
    text
}
