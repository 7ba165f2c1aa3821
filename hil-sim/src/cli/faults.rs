//! `rig faults`: every fault at random instants, and its outcome.

use std::fmt::Display;

use serde_json::json;

use super::campaign::CampaignArgs;
use super::failure::{Failure, Outcome};
use super::montecarlo;
use super::scenario::ScenarioArgs;
use crate::campaign::{Column, Frame, column};
use crate::faults::campaign::{
    Case, FaultCampaign, Instant, MatrixRow, Outcome as Matrix, Twin, twin, watched,
};
use crate::scenario::{Scenario, nearest_word};
use crate::table::{counted, width, wrapped};

/// Breaks everything that can break, each fault at random instants of random rigs, out and
/// back, and judges the outcome by the true state of the plant.
///
/// The exit code is 1 if a fault goes undetected or the mechanism is not held.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// What runs the controller: the host, or the firmware on the emulated board, which
    /// breaks in its registers and lines as well.
    #[arg(long, default_value = "sil", value_parser = ["sil", "board"])]
    target: String,

    /// Instants a fault.
    #[arg(short = 'n', value_name = "N", default_value_t = 20,
          allow_negative_numbers = true,
          value_parser = clap::value_parser!(u64).range(1..=100_000))]
    count: u64,

    /// Only faults whose name contains this; may be repeated.
    #[arg(long, value_name = "TEXT")]
    only: Vec<String>,

    /// No faults: this many random deployments, in which none may be reported.
    #[arg(long, value_name = "N", conflicts_with_all = ["only", "count", "target"],
          value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    clean: Option<u64>,

    #[command(flatten)]
    scenario: ScenarioArgs,

    #[command(flatten)]
    pub(super) campaign: CampaignArgs,
}

impl Args {
    /// The campaign that is asked for.
    pub fn campaign(&self) -> Result<FaultCampaign, Failure> {
        let board = self.target == "board";
        let all = if board { Case::all_on_board() } else { Case::all() };
        let cases: Vec<Case> = all.iter().filter(|c| c.is_one_of(&self.only)).copied().collect();
        if cases.is_empty() {
            let names: Vec<String> = all.iter().map(Case::name).collect();
            let first = |name: &String| name.split(' ').next().unwrap_or_default().to_owned();
            let words: Vec<String> = names.iter().map(first).chain(names.clone()).collect();
            let near = self.only.iter().find_map(|text| Some((text, nearest_word(text, &words)?)));
            if let Some((text, near)) = near {
                let what = format!("--only {text}: no such fault, did you mean \"{near}\"?");
                return Err(Failure::input(what));
            }
            let (text, names) = (self.only.join(", "), names.join(", "));
            return Err(Failure::input(format!("--only {text}: no such fault; faults: {names}")));
        }
        let scenario = self.scenario.resolve()?;
        // Every rig can have its seed.
        scenario.seeds(self.count)?;
        Ok(FaultCampaign { scenario, instants: self.count as usize, cases })
    }
}

/// Runs the verb.
pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    if let Some(count) = args.clean {
        return clean(args, count);
    }
    let campaign = args.campaign()?;
    if args.target == "board" && !args.campaign.is_given() {
        return Err(Failure::of_target(&args.target));
    }
    carry_out(args, &campaign, twin, watched)
}

/// Runs the campaign on the target that is asked for, and prints the outcome.
pub fn carry_out<E: Display + Send>(
    args: &Args,
    campaign: &FaultCampaign,
    twin: impl Fn(&Scenario) -> Result<Twin, E> + Sync,
    watched: impl Fn(&Scenario, &Twin) -> Result<Instant, E> + Sync,
) -> Result<Outcome, Failure>
where
    Failure: From<E>,
{
    let target = if args.target == "board" { "board" } else { "sil" };
    let parameters = campaign.scenario.to_toml();
    let found = args.campaign.carry_out(parameters, campaign.on(target, twin, watched))?;
    let outcome = &found.outcome;
    let row = |line: &MatrixRow| {
        let mut row = json!(line);
        row["reported"] = line.code.map_or_else(|| json!(line.restarted()), |code| json!(code));
        row["detections"] = (line.found + line.limited).into();
        row
    };
    let rows = Frame::of(&COLUMNS, outcome.matrix.iter().map(row));
    found.print(&args.campaign, outcome, &rows, || human(outcome, &rows), outcome.is_good())
}

/// Columns of the matrix.
const COLUMNS: [Column; 11] = [
    column("fault", "fault", "", 0),
    column("reported", "code", "", 0),
    column("detections", "found", "", 0),
    column("otherwise", "something\nelse", "", 0),
    column("tolerated", "tolerated", "", 0),
    column("undetected", "undetected", "", 0),
    column("unsafe", "unsafe", "", 0),
    column("latency_median_ms", "median", "ms", 0),
    column("latency_ms", "worst", "ms", 0),
    column("worst_preload_n", "preload", "N", 1),
    column("worst_motion_mm", "motion", "mm", 2),
];

/// Of these, what a narrow terminal is spared; what was missed and unsafe is listed below.
const SPARE: [&str; 5] =
    ["latency_median_ms", "undetected", "unsafe", "worst_preload_n", "worst_motion_mm"];

/// Random deployments without a fault.
fn clean(args: &Args, count: u64) -> Result<Outcome, Failure> {
    let found = montecarlo::deployments(&args.campaign, &args.scenario.resolve()?, count)?;
    let (_, outcome) = &found;
    let (alarms, incomplete) = (outcome.faults.len(), outcome.runs - outcome.completed);
    let head = format!(
        "{} without a fault: {}, {incomplete} incomplete\n",
        counted(outcome.runs, "deployment"),
        counted(alarms, "false alarm")
    );
    montecarlo::print(&found, &args.campaign, &head, alarms == 0 && incomplete == 0)
}

/// The matrix as a table, with what failed below it.
fn human(outcome: &Matrix, rows: &Frame) -> String {
    let mut text = format!(
        "{} at {} each: {} found as something else, {} undetected, {} unsafe\n{}",
        counted(outcome.matrix.len(), "fault"),
        counted(outcome.instants, "instant"),
        outcome.otherwise,
        outcome.undetected,
        outcome.unheld,
        rows.text(&SPARE)
    );
    for line in &outcome.matrix {
        for failure in &line.failures {
            let line = format!(
                "{} at {:.3} s of seed {} ({}): {:?}, {}{}",
                line.fault,
                failure.at_s.unwrap_or(0.0),
                failure.seed,
                failure.during,
                failure.finding,
                failure.end,
                failure.harms.iter().map(|harm| format!(", {harm}")).collect::<String>()
            );
            text += &wrapped(&line, "  ", width());
        }
    }
    text
}
