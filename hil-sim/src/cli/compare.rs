//! `rig compare`: the four strategies and the oracle on the same random rigs.

use serde_json::{Value, json};

use super::failure::{Failure, Outcome};
use super::output;
use super::scenario::{RunArgs, seeds_fit};
use crate::compare::{self, Comparison, Entry};
use crate::oracle::Effort;
use crate::progress;
use crate::table::{number, plain};

/// Compares four preload strategies on the same random rigs: scheduled, constant at cruise,
/// constant at the limit, reactive; and the oracle, the best run that the plants allow.
///
/// Every strategy rolls while the preload builds, brakes late and has the same friction check.
/// The reserve below the reference gap of each is tuned until its worst gap over all rigs is
/// the reference; then the times are comparable. The oracle knows each plant in advance and
/// has the same actuators; it keeps the worst gap and the least slip margin of the scheduled
/// run on that plant. A rig takes about 5 s of one core with the oracle, 0.2 s without.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// How many rigs: the seeds that follow --seed.
    #[arg(short = 'n', value_name = "N", default_value_t = 20,
          allow_negative_numbers = true,
          value_parser = clap::value_parser!(u64).range(1..=100_000))]
    count: u64,

    /// Leaves the oracle out, which takes most of the time.
    #[arg(long)]
    no_oracle: bool,

    #[command(flatten)]
    run: RunArgs,

    /// Prints the outcome as one JSON object.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    args.run.no_controller("every strategy is compared")?;
    let scenario = args.run.resolve()?;
    seeds_fit(&scenario, args.count)?;
    let rigs = args.count as usize;
    let mut comparison = {
        let bar = progress::bar("runs at most", compare::most_runs(rigs) as u64);
        compare::compare(&scenario, scenario.run.seed + 1, rigs, &|| bar.advance(1))?
    };
    if !args.no_oracle {
        let bar = progress::bar("plants of the oracle", rigs as u64);
        comparison.add_oracle(&scenario, Effort::Full, &|| bar.advance(1))?;
    }
    output::result(args.json, &machine(&comparison), || human(&comparison))?;
    Ok(Outcome::Good)
}

/// The JSON object.
fn machine(comparison: &Comparison) -> Value {
    json!({
        "runs": comparison.runs,
        "gap_ref_mm": comparison.gap_ref_mm,
        "entries": comparison.entries,
    })
}

fn human(comparison: &Comparison) -> String {
    let head = [
        "controller",
        "command s (ratio)",
        "in motion s (ratio)",
        "gap mm",
        "margin",
        "slips",
        "short",
        "mean N",
        "reserve",
    ];
    let scheduled = &comparison.entries[0];
    let rows = comparison.entries.iter().map(|entry| {
        let mark = if entry.tuned { "" } else { "~" };
        let time = |of: fn(&Entry) -> Option<f64>| {
            let ratio = of(entry).zip(of(scheduled)).map(|(this, reference)| this / reference);
            format!("{} ({})", number(of(entry), 3), number(ratio, 3))
        };
        let reserve = entry.gap_reserve.map(|reserve| format!("{:.1} %", reserve * 100.0));
        vec![
            entry.controller.to_owned(),
            time(|entry| entry.duration_s),
            time(|entry| entry.moving_s),
            format!("{mark}{}", number(entry.worst_gap_mm, 3)),
            number(entry.least_slip_margin, 3),
            entry.slip_events.to_string(),
            entry.incomplete.to_string(),
            number(entry.mean_preload_n, 1),
            reserve.unwrap_or_else(|| "-".to_owned()),
        ]
    });
    let mut text = format!(
        "{} rigs, each strategy tuned to a worst gap of {:.3} mm\n{}\ncommand: from the accepted \
         command to arrival; moving: the wheel moves; means over completed runs,\nwith their \
         ratios to the scheduled strategy. gap, margin (of friction): the worst of all runs.\n\
         short: incomplete runs. reserve: how far below the reference gap the planner aims.\n",
        comparison.runs,
        comparison.gap_ref_mm,
        plain(&head, rows)
    );
    if comparison.entries.iter().any(|entry| !entry.tuned) {
        text += "~ could not be brought to the reference gap by its reserve\n";
    }
    if comparison.entries.iter().any(|entry| entry.controller == compare::ORACLE) {
        text += "oracle: the fastest run found for each plant, all of it known in advance, with \
                 the same actuators,\nat the worst gap and slip margin of the scheduled run there\n";
    }
    for (seed, why) in &comparison.oracle_fails {
        text += &format!("oracle, seed {seed}: no run found, {why}\n");
    }
    text
}
