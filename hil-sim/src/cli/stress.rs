//! `rig stress`: the plant at the ends of its ranges.

use serde_json::json;

use super::campaign::CampaignArgs;
use super::failure::{Failure, Outcome};
use super::scenario::seed;
use crate::campaign::{Column, Frame, column};
use crate::stress::{self, StressReport, Worst};
use crate::table::{counted, width, wrapped};

/// The plant at the ends of every range.
///
/// Every case stays finite, in radial balance, with bounded penetration and without
/// creating energy. Impossible combinations are refused by name before the run.
/// The ten thousand cases of the default take less than a minute.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Cases, without those that must be refused.
    #[arg(short = 'n', long = "cases", value_name = "CASES", default_value_t = 10_000,
          allow_negative_numbers = true,
          value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    cases: u64,

    /// Seed of the cases between the corners.
    #[arg(long, value_name = "N", default_value_t = 1, allow_negative_numbers = true,
          value_parser = seed)]
    seed: u64,

    #[command(flatten)]
    pub(super) campaign: CampaignArgs,
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let campaign = stress::campaign(args.cases as usize, args.seed);
    let found = args.campaign.carry_out(format!("seed {}", args.seed), campaign)?;
    let report = &found.outcome;
    let row = |worst: &Worst| {
        let mut row = json!(worst.case);
        row["figure"] = json!(worst.figure);
        row["value"] = worst.value.into();
        row
    };
    let rows = Frame::of(&COLUMNS, report.worst.iter().map(row));
    let mut printed = json!(report);
    printed["failures"] = report.failed.len().into();
    found.print(&args.campaign, &printed, &rows, || human(report, &rows), report.failed.is_empty())
}

/// Columns of the worst cases.
const COLUMNS: [Column; 9] = [
    column("figure", "figure", "", 0),
    column("value", "of limit", "", 3),
    column("index", "case", "", 0),
    column("k_inf_pa_per_m", "stiffness", "Pa/m", 0),
    column("stiffening", "stiffening", "", 1),
    column("tau_s", "tau", "s", 6),
    column("speed_mm_s", "speed", "mm/s", 0),
    column("step_mm", "step", "mm", 1),
    column("mu", "mu", "", 1),
];

fn human(report: &StressReport, rows: &Frame) -> String {
    let rows = rows.text(&["tau_s", "stiffening"]);
    let mut text = format!("{} of the plant\n{rows}", counted(report.cases, "case"));
    for (name, refused) in &report.refused {
        let refused = format!("refused {}: {name}, as: {}", refused.count, refused.example);
        text += &wrapped(&refused, "  ", width());
    }
    for failure in &report.failed {
        text += &format!("  failed: {}: {:?}\n", failure.why, failure.case);
    }
    text + &format!("{}\n", counted(report.failed.len(), "failure"))
}
