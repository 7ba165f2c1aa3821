//! `rig faults`: every fault at random instants, and what became of it.

use std::path::PathBuf;

use super::failure::{Failure, Outcome};
use super::output;
use super::scenario::ScenarioArgs;
use crate::faults::campaign::{Campaign, Case, Kept, Line, Outcome as Result_};
use crate::montecarlo;
use crate::progress;
use crate::table::{number, plain};

/// Breaks everything that can break, each fault at random instants of random rigs, out and
/// back, and judges what became of it by what is true.
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
          value_parser = clap::value_parser!(u64).range(1..=100_000))]
    count: u64,

    /// Only faults whose name contains this; may be repeated.
    #[arg(long, value_name = "TEXT")]
    only: Vec<String>,

    /// No faults: this many random deployments, in which none may be reported.
    #[arg(long, value_name = "N", conflicts_with_all = ["only", "count", "target"],
          value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    clean: Option<u64>,

    /// Keeps each fault that is done in this file, and goes on from what stands there.
    #[arg(long, value_name = "FILE", conflicts_with = "clean")]
    keep: Option<PathBuf>,

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
        let wanted = all.iter().filter(|case| case.is_one_of(&self.only));
        let cases: Vec<Case> = wanted.copied().collect();
        if cases.is_empty() {
            let names: Vec<String> = all.iter().map(Case::name).collect();
            let (text, names) = (self.only.join(", "), names.join(", "));
            return Err(Failure::input(format!("--only {text}: no such fault; faults: {names}")));
        }
        let scenario = self.scenario.resolve()?;
        Ok(Campaign { scenario, instants: self.count as usize, cases })
    }
}

/// Runs the verb.
pub fn run(args: &Args) -> Result<Outcome, Failure> {
    if let Some(count) = args.clean {
        return clean(args, &args.scenario.resolve()?, count);
    }
    let campaign = args.campaign()?;
    if args.target == "board" {
        return Ok(Outcome::Code(crate::provision::go_on(crate::provision::Extra::Board)?));
    }
    let mut kept = kept(args, &campaign, &[])?;
    let outcome = {
        let bar = progress::bar("runs", campaign.runs());
        campaign.run_keeping(&mut kept, &|| bar.advance(1))?
    };
    ended(args, &outcome)
}

/// Prints the outcome.
pub fn ended(args: &Args, outcome: &Result_) -> Result<Outcome, Failure> {
    output::result(args.json, outcome, || human(outcome))?;
    Ok(Outcome::of(outcome.is_good()))
}

/// What is done of the campaign on this image, if it is kept.
fn kept(args: &Args, campaign: &Campaign, elf: &[u8]) -> Result<Kept, Failure> {
    let Some(path) = &args.keep else { return Ok(Kept::default()) };
    let judge = std::env::current_exe().and_then(std::fs::read).map_err(Failure::run)?;
    Kept::at(path, &args.target, campaign, &[&judge, elf]).map_err(Failure::input)
}

/// Random deployments without a fault.
fn clean(
    args: &Args,
    scenario: &crate::scenario::Scenario,
    count: u64,
) -> Result<Outcome, Failure> {
    let first = scenario.run.seed + 1;
    let seeds: Vec<u64> = (first..first + count).collect();
    let lines = {
        let bar = progress::bar("runs", count);
        montecarlo::run(scenario, &seeds, &|| bar.advance(1))?
    };
    let outcome = montecarlo::Outcome::of(&lines);
    let alarms = outcome.faults.len();
    output::result(args.json, &outcome, || {
        format!(
            "{} deployments without a fault: {alarms} false alarms, {} incomplete\n{}",
            outcome.runs,
            outcome.runs - outcome.completed,
            super::montecarlo::human(&outcome)
        )
    })?;
    Ok(Outcome::of(alarms == 0 && outcome.completed == outcome.runs))
}

/// The matrix as a table, with what failed below it.
pub fn human(outcome: &Result_) -> String {
    let head = [
        "fault",
        "code",
        "found",
        "borne",
        "missed",
        "unsafe",
        "median\nms",
        "worst\nms",
        "preload\nN",
        "motion\nmm",
    ];
    let mut text = format!(
        "{} faults at {} instants each: {} undetected, {} unsafe\n{}\n",
        outcome.matrix.len(),
        outcome.instants,
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

fn row(line: &Line) -> Vec<String> {
    let count = |n: usize| if n == 0 { "-".to_owned() } else { n.to_string() };
    vec![
        line.fault.clone(),
        line.code.map_or_else(|| line.restarted().unwrap_or("-").to_owned(), |c| c.to_string()),
        count(line.found + line.limited),
        count(line.tolerated),
        count(line.undetected),
        count(line.unheld),
        number(line.latency_median_ms, 0),
        number(line.latency_ms, 0),
        number(line.worst_preload_n, 1),
        number(line.worst_motion_mm, 2),
    ]
}
