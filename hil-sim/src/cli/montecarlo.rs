//! `rig montecarlo`: many random rigs.

use std::collections::BTreeMap;

use serde_json::json;

use super::campaign::{CampaignArgs, Found};
use super::failure::{Failure, Outcome};
use super::scenario::RunArgs;
use crate::campaign::{Column, Frame, column};
use crate::montecarlo::{self, Drawn, Least, RunLine};
use crate::scenario::{MismatchDraw, Scenario};
use crate::table::{counted, number, plain, width, wrapped};

/// Runs many random rigs, each drawn from its own seed, and shows what limits them.
///
/// Each draws what `spread.*` states; with --wide also what the controller is not told, all of
/// `mismatch.*` within the wide ranges that `rig keys` lists. With --adversarial friction, load
/// and heights of the steps are far beyond the rig's design: runs may end in a fault, but not in
/// silence.
///
/// The outcome depends on the seeds alone, not on the number of processors. The exit
/// code is 1 if a run does not complete; of adversarial ones, if a run is unreported.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// How many: the seeds that follow --seed.
    #[arg(short = 'n', value_name = "N", default_value_t = 100,
          allow_negative_numbers = true,
          value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    count: u64,

    #[command(flatten)]
    run: RunArgs,

    #[command(flatten)]
    pub(super) campaign: CampaignArgs,
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let scenario = args.run.resolve()?;
    let found = deployments(&args.campaign, &scenario, args.count)?;
    let (_, outcome) = &found;
    let sound = match scenario.run.mismatch {
        MismatchDraw::Adversarial => outcome.unreported.is_empty(),
        _ => outcome.completed == outcome.runs,
    };
    let head = format!(
        "{} of {}, {} controller, rig {}: {} completed, {}\n",
        counted(outcome.runs, "run"),
        scenario.run.direction.name(),
        scenario.run.controller.name(),
        scenario.preset,
        outcome.completed,
        counted(outcome.slip_events, "slip event")
    );
    print(&found, &args.campaign, &wrapped(&head, "", width()), sound)
}

/// Runs `count` rigs, or the part of them that is asked for: the runs, and their outcome.
pub(super) fn deployments(
    args: &CampaignArgs,
    scenario: &Scenario,
    count: u64,
) -> Result<(Found<Vec<RunLine>>, montecarlo::Outcome), Failure> {
    let campaign = montecarlo::campaign(scenario, scenario.seeds(count)?);
    let found = args.carry_out(scenario.to_toml(), campaign)?;
    let seeds: Vec<u64> = found.outcome.iter().map(|line| line.seed).collect();
    let outcome = montecarlo::Outcome::of(&found.outcome).drawn_from(scenario, &seeds);
    Ok((found, outcome))
}

/// Prints the outcome of these runs behind this head.
pub(super) fn print(
    (found, outcome): &(Found<Vec<RunLine>>, montecarlo::Outcome),
    args: &CampaignArgs,
    head: &str,
    good: bool,
) -> Result<Outcome, Failure> {
    let rows = Frame::of(&COLUMNS, &found.outcome);
    found.print(args, outcome, &rows, || head.to_owned() + &human(outcome), good)
}

/// Columns of the runs.
const COLUMNS: [Column; 12] = [
    column("seed", "seed", "", 0),
    column("completed", "completed", "", 0),
    column("duration_s", "from the command", "s", 3),
    column("moving_s", "in motion", "s", 3),
    column("max_gap_mm", "worst gap", "mm", 3),
    column("gap_over_ref", "gap over reference", "", 4),
    column("end_off_mm", "off the commanded end", "mm", 3),
    column("end_off_sigmas", "in stated sigmas", "", 2),
    column("slip_events", "slip events", "", 0),
    column("least_lead_s", "lead", "s", 3),
    column("least_slip_margin", "slip margin", "", 3),
    column("mean_preload_n", "mean preload", "N", 2),
];

fn human(outcome: &montecarlo::Outcome) -> String {
    let mut text = figures(outcome).text(&[]);
    let mut seeds: BTreeMap<String, Vec<u64>> = BTreeMap::new();
    for fault in &outcome.faults {
        let code = fault.code.map_or("failure".to_owned(), |code| format!("fault {code}"));
        seeds.entry(format!("{code}: {}", fault.text)).or_default().push(fault.seed);
    }
    let others = [
        ("incomplete", &outcome.incomplete),
        ("of these without a word", &outcome.silent),
        ("slip, end or gap wrong and unreported", &outcome.unreported),
        ("stopped by a fault without slip or wide gap", &outcome.stopped_sound),
    ];
    let others = others.into_iter().filter(|(_, seeds)| !seeds.is_empty());
    for (what, seeds) in seeds.iter().map(|(what, seeds)| (what.as_str(), seeds)).chain(others) {
        let seeds: Vec<String> = seeds.iter().map(u64::to_string).collect();
        text += &wrapped(&format!("{what}: seeds {}", seeds.join(", ")), "  ", width());
    }
    if !outcome.drawn.is_empty() {
        let row = |d: &Drawn| vec![d.key.clone(), number(d.least, 3), number(d.most, 3)];
        let rows = plain(&["", "least", "most"], outcome.drawn.iter().map(row));
        text +=
            &format!("What the controller is not told, beside the spread of the rigs\n{rows}\n");
    }
    text += "What limits it\n";
    for limit in &outcome.limits {
        let (runs, all) = (limit.runs, counted(outcome.runs, "run"));
        let limit = format!("limit {} in {runs} of {all}: {}", limit.code, limit.text);
        text += &wrapped(&limit, "  ", width());
    }
    if outcome.limits.is_empty() {
        text += "  no limit was met\n";
    }
    let incomplete = outcome.incomplete.first().map(|seed| (*seed, "an incomplete run"));
    let widest = outcome.worst_gap_seed.map(|seed| (seed, "the run with the worst gap"));
    if let Some((seed, run)) = incomplete.or(widest) {
        text += &format!("`cargo rig deploy --seed {seed}`, same options, shows {run} in full\n");
    }
    text
}

/// Columns of the figures.
const FIGURES: [Column; 6] = [
    column("figure", "", "", 0),
    column("p50", "median", "", 3),
    column("p95", "95 %", "", 3),
    column("p99", "99 %", "", 3),
    column("max", "worst", "", 3),
    column("seed", "its seed", "", 0),
];

fn figures(outcome: &montecarlo::Outcome) -> Frame {
    let worst = |value: Option<f64>, seed: Option<u64>| json!({ "max": value, "seed": seed });
    let least = |least: Option<Least>| worst(least.map(|l| l.min), least.map(|l| l.seed));
    let rows = [
        ("from the command, s", json!(outcome.duration_s)),
        ("in motion, s", json!(outcome.moving_s)),
        ("gap over reference", json!(outcome.gap_over_ref)),
        ("  at the first step", json!(outcome.first_gap_over_ref)),
        ("  at the later ones", json!(outcome.later_gap_over_ref)),
        ("gap, mm", worst(outcome.worst_gap_mm, outcome.worst_gap_seed)),
        ("lead time, s", least(outcome.lead_time_s)),
        ("slip margin", least(outcome.slip_margin)),
        ("off the commanded end, mm", json!(outcome.end_off_mm)),
        ("  in stated sigmas", json!(outcome.end_off_sigmas)),
    ];
    let found = outcome.steps_found.iter();
    let found = found.map(|s| (format!("step {} found off by, mm", s.index), json!(s.off_mm)));
    let rows = rows.into_iter().map(|(name, row)| (name.to_owned(), row)).chain(found);
    Frame::of(
        &FIGURES,
        rows.map(|(name, mut row)| {
            row["figure"] = name.into();
            row
        }),
    )
}
