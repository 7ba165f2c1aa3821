//! `rig faults`: every fault at random instants, and its outcome.

use super::failure::{Failure, Outcome};
use super::scenario::ScenarioArgs;
use super::{montecarlo, output};
use crate::faults::campaign::{Campaign, Case, MatrixRow, Outcome as Matrix};
use crate::montecarlo::Shard;
use crate::progress;
use crate::scenario::nearest_word;
use crate::table::{number, plain};

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

    /// Only part i of n of the faults, or of the deployments without one.
    #[arg(long, value_name = "i/n", default_value_t = Shard::ALL)]
    shard: Shard,

    #[command(flatten)]
    scenario: ScenarioArgs,

    /// Prints the outcome as one JSON object.
    #[arg(long)]
    json: bool,
}

impl Args {
    /// The campaign that is asked for.
    pub fn campaign(&self) -> Result<Campaign, Failure> {
        let board = self.target == "board";
        let all = if board { Case::all_on_board() } else { Case::all() };
        let wanted: Vec<Case> = all.iter().filter(|c| c.is_one_of(&self.only)).copied().collect();
        if wanted.is_empty() {
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
        let cases = (0..).zip(wanted).filter(|(index, _)| self.shard.has(*index));
        let cases: Vec<Case> = cases.map(|(_, case)| case).collect();
        montecarlo::shard_has(self.shard, cases.len())?;
        Ok(Campaign { scenario: self.scenario.resolve()?, instants: self.count as usize, cases })
    }
}

/// Runs the verb.
pub fn run(args: &Args) -> Result<Outcome, Failure> {
    if let Some(count) = args.clean {
        return clean(args, count);
    }
    let campaign = args.campaign()?;
    if args.target == "board" {
        return Ok(Outcome::Code(crate::provision::go_on(crate::provision::Extra::Board)?));
    }
    let outcome = {
        let bar = progress::bar("runs", campaign.runs());
        campaign.run(&|| bar.advance(1))?
    };
    ended(args, &outcome)
}

/// Prints the outcome.
pub fn ended(args: &Args, outcome: &Matrix) -> Result<Outcome, Failure> {
    output::result(args.json, outcome, || human(outcome))?;
    Ok(Outcome::of(outcome.is_good()))
}

/// Random deployments without a fault.
fn clean(args: &Args, count: u64) -> Result<Outcome, Failure> {
    let outcome = montecarlo::campaign(&args.scenario.resolve()?, args.shard, count)?;
    let alarms = outcome.faults.len();
    output::result(args.json, &outcome, || {
        format!(
            "{} deployments without a fault: {alarms} false alarms, {} incomplete\n{}",
            outcome.runs,
            outcome.runs - outcome.completed,
            montecarlo::human(&outcome)
        )
    })?;
    Ok(Outcome::of(alarms == 0 && outcome.completed == outcome.runs))
}

/// The matrix as a table, with what failed below it.
fn human(outcome: &Matrix) -> String {
    let head = [
        "fault",
        "code",
        "found",
        "found as\nelse",
        "tolerated",
        "missed",
        "unsafe",
        "median\nms",
        "worst\nms",
        "preload\nN",
        "motion\nmm",
    ];
    let mut text = format!(
        "{} faults at {} instants each: {} found as something else, {} undetected, {} unsafe\n{}\n",
        outcome.matrix.len(),
        outcome.instants,
        outcome.otherwise,
        outcome.undetected,
        outcome.unheld,
        plain(&head, outcome.matrix.iter().map(row))
    );
    for line in &outcome.matrix {
        for failure in &line.failures {
            text += &format!(
                "  {} at {:.3} s of seed {} ({}): {:?}, {}{}\n",
                line.fault,
                failure.at_s.unwrap_or(0.0),
                failure.seed,
                failure.during,
                failure.finding,
                failure.end,
                failure.harms.iter().map(|harm| format!(", {harm}")).collect::<String>()
            );
        }
    }
    text
}

fn row(line: &MatrixRow) -> Vec<String> {
    let count = |n: usize| if n == 0 { "-".to_owned() } else { n.to_string() };
    vec![
        line.fault.clone(),
        line.code.map_or_else(|| line.restarted().unwrap_or("-").to_owned(), |c| c.to_string()),
        count(line.found + line.limited),
        count(line.otherwise),
        count(line.tolerated),
        count(line.undetected),
        count(line.unheld),
        number(line.latency_median_ms, 0),
        number(line.latency_ms, 0),
        number(line.worst_preload_n, 1),
        number(line.worst_motion_mm, 2),
    ]
}
