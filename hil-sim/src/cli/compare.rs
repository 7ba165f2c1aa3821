//! `rig compare`: the four strategies and the oracle on the same random rigs.

use serde_json::{Value, json};

use super::campaign::CampaignArgs;
use super::failure::{Failure, Outcome};
use super::scenario::RunArgs;
use crate::campaign::{Column, Frame, column};
use crate::compare::{self, Comparison, Entry, STRATEGIES};
use crate::oracle::Effort;
use crate::table::{counted, number, width, wrapped};

/// Compares four preload strategies on the same random rigs: scheduled, constant at cruise,
/// constant at the limit, reactive; and the oracle, the best run that the plants allow.
///
/// Every strategy rolls while the preload builds, brakes late and has the same friction check.
/// The reserve below the reference gap of each is tuned until its worst gap over all rigs is
/// the reference; then the times are comparable. The oracle knows each plant in advance and
/// has the same actuators; it keeps the worst gap of the scheduled run on
/// that plant, and the demanded slip margin. A rig takes about 5 s of one core with the oracle, 0.2 s without.
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

    #[command(flatten)]
    pub(super) campaign: CampaignArgs,
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    args.run.without_controller("every strategy is compared")?;
    let scenario = args.run.resolve()?;
    let effort = (!args.no_oracle).then_some(Effort::FULL);
    let campaign = compare::campaign(&scenario, scenario.seeds(args.count)?, effort)?;
    let found = args.campaign.carry_out(scenario.to_toml(), campaign)?;
    let comparison = &found.outcome;
    let rows = Frame::of(&COLUMNS, comparison.entries.iter().map(|entry| row(entry, comparison)));
    let text = || human(comparison, &rows);
    found.print(&args.campaign, comparison, &rows, text, true)
}

/// Columns of the strategies.
const COLUMNS: [Column; 11] = [
    column("controller", "controller", "", 0),
    column("duration_s", "command", "s", 3),
    column("duration_ratio", "command", "ratio", 3),
    column("moving_s", "moving", "s", 3),
    column("moving_ratio", "moving", "ratio", 3),
    column("worst_gap_mm", "gap", "mm", 3),
    column("least_slip_margin", "margin", "", 3),
    column("slip_events", "slips", "", 0),
    column("incomplete", "short", "", 0),
    column("mean_preload_n", "mean", "N", 1),
    column("gap_reserve_percent", "reserve", "%", 1),
];

/// An entry with its times over the scheduled strategy's.
fn row(entry: &Entry, of: &Comparison) -> Value {
    let scheduled = of.entries.iter().find(|e| e.controller == STRATEGIES[0].name());
    let ratio = |time: fn(&Entry) -> Option<f64>| Some(time(entry)? / time(scheduled?)?);
    let mut row = json!(entry);
    row["duration_ratio"] = ratio(|entry| entry.duration_s).into();
    row["moving_ratio"] = ratio(|entry| entry.moving_s).into();
    row["gap_reserve_percent"] = entry.gap_reserve.map(|reserve| 100.0 * reserve).into();
    row
}

/// What the columns mean.
const LEGEND: &str = "command: from the accepted command to arrival (moving: in motion), the mean \
    over completed runs; ratio: over the scheduled strategy's. gap, margin (of friction): the worst \
    of all runs. short: incomplete runs. mean: mean preload. reserve: how far below the reference \
    gap the planner aims.";
/// What the oracle is.
const ORACLE: &str = "oracle: the fastest run found for each plant, all of it known in advance, \
    with the same actuators, at the worst gap of the scheduled run there, with the demanded slip margin";

fn human(comparison: &Comparison, rows: &Frame) -> String {
    let mut text = format!(
        "{}, each strategy tuned, where it can be, to a worst gap of {:.3} mm within {} %\n{}",
        counted(comparison.runs, "rig"),
        comparison.gap_ref_mm,
        100.0 * compare::TUNED_WITHIN,
        rows.text(&["moving_ratio", "moving_s", "mean_preload_n"])
    );
    text += &wrapped(LEGEND, "", width());
    for entry in comparison.entries.iter().filter(|entry| !entry.tuned) {
        let gap = number(entry.worst_gap_mm, 3);
        let reserve = number(entry.gap_reserve.map(|reserve| 100.0 * reserve), 1);
        text += &format!("{}: no nearer than {gap} mm, at {reserve} %\n", entry.controller);
    }
    if comparison.entries.iter().any(|entry| entry.controller == compare::ORACLE) {
        text += &wrapped(ORACLE, "", width());
    }
    for (seed, why) in &comparison.oracle_fails {
        text += &format!("oracle, seed {seed}: no run found, {why}\n");
    }
    text
}
