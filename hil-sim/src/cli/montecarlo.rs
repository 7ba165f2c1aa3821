//! `rig montecarlo`: many random rigs.

use super::failure::{Failure, Outcome};
use super::output;
use super::scenario::{RunArgs, seeds_fit};
use crate::montecarlo::{self, Least, Quantiles, Shard};
use crate::progress;
use crate::scenario::{MismatchDraw, Scenario};
use crate::table::{number, plain};

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

    /// Runs only every n-th seed, beginning with the i-th.
    #[arg(long, value_name = "I/N", default_value_t = Shard::ALL)]
    shard: Shard,

    #[command(flatten)]
    run: RunArgs,

    /// Prints the outcome as one JSON object.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let scenario = args.run.resolve()?;
    let outcome = campaign(&scenario, args.shard, args.count)?;
    let head = format!(
        "{} runs of {}, {} controller, rig {}: {} completed, {} slip events\n",
        outcome.runs,
        scenario.run.direction.name(),
        scenario.run.controller.name(),
        scenario.preset,
        outcome.completed,
        outcome.slip_events
    );
    output::result(args.json, &outcome, || head + &human(&outcome))?;
    let sound = match scenario.run.mismatch {
        MismatchDraw::Adversarial => outcome.unreported.is_empty(),
        _ => outcome.completed == outcome.runs,
    };
    Ok(Outcome::of(sound))
}

/// Refuses a part of a campaign in which nothing is left to run.
pub(super) fn shard_has(shard: Shard, items: usize) -> Result<(), Failure> {
    if items == 0 {
        let why = "the campaign has fewer runs than parts, and none for this one";
        return Err(Failure::input(format!("--shard {shard}: {why}")));
    }
    Ok(())
}

/// Runs this part of `count` rigs, with a progress bar.
pub(super) fn campaign(
    scenario: &Scenario,
    shard: Shard,
    count: u64,
) -> Result<montecarlo::Outcome, Failure> {
    seeds_fit(scenario, count)?;
    let seeds = shard.seeds(scenario.run.seed, count);
    shard_has(shard, seeds.len())?;
    let bar = progress::bar("runs", seeds.len() as u64);
    let lines = montecarlo::run(scenario, &seeds, &|| bar.advance(1))?;
    Ok(montecarlo::Outcome::of(&lines).drawn_from(scenario, &seeds))
}

pub(super) fn human(outcome: &montecarlo::Outcome) -> String {
    let mut text = format!("{}\n", figures(outcome));
    for fault in &outcome.faults {
        let code = fault.code.map_or("failure".to_owned(), |code| format!("fault {code}"));
        text += &format!("  {code} in seed {}: {}\n", fault.seed, fault.text);
    }
    for (what, seeds) in [
        ("incomplete", &outcome.incomplete),
        ("of these without a word", &outcome.silent),
        ("slip, end or gap wrong and unreported", &outcome.unreported),
        ("stopped by a fault without slip or wide gap", &outcome.stopped_sound),
    ] {
        if !seeds.is_empty() {
            let seeds: Vec<String> = seeds.iter().map(u64::to_string).collect();
            text += &format!("  {what}: seeds {}\n", seeds.join(", "));
        }
    }
    if !outcome.drawn.is_empty() {
        let rows = outcome
            .drawn
            .iter()
            .map(|drawn| vec![drawn.key.clone(), number(drawn.least, 3), number(drawn.most, 3)]);
        text += "What the controller is not told, beside the spread of the rigs\n";
        text += &format!("{}\n", plain(&["", "least", "most"], rows));
    }
    text += "What limits it\n";
    for limit in &outcome.limits {
        let (runs, all) = (limit.runs, outcome.runs);
        text += &format!("  limit {} in {runs} of {all} runs: {}\n", limit.code, limit.text);
    }
    if outcome.limits.is_empty() {
        text += "  no limit was met\n";
    }
    let seed = outcome.incomplete.first().copied().or(outcome.worst_gap_seed);
    if let Some(seed) = seed {
        text += &format!(
            "`cargo rig deploy --seed {seed}` with the same options shows that run in full\n"
        );
    }
    text
}

fn figures(outcome: &montecarlo::Outcome) -> comfy_table::Table {
    let dash = || "-".to_owned();
    let seed = |seed: Option<u64>| seed.map_or_else(dash, |seed| seed.to_string());
    let spread = |name: &str, figure: Option<Quantiles>, decimals| {
        let number = |pick: fn(Quantiles) -> f64| number(figure.map(pick), decimals);
        let quantiles =
            [number(|f| f.p50), number(|f| f.p95), number(|f| f.p99), number(|f| f.max)];
        let seed = seed(figure.map(|f| f.seed));
        [vec![name.to_owned()], quantiles.to_vec(), vec![seed]].concat()
    };
    let least = |name: &str, figure: Option<Least>| {
        let worst = number(figure.map(|f| f.min), 3);
        vec![name.to_owned(), dash(), dash(), dash(), worst, seed(figure.map(|f| f.seed))]
    };
    let gap = number(outcome.worst_gap_mm, 3);
    let found = outcome
        .steps_found
        .iter()
        .map(|step| spread(&format!("step {} found off by, mm", step.index), Some(step.off_mm), 3));
    let head = ["", "median", "95 %", "99 %", "worst", "its seed"];
    plain(
        &head,
        [
            spread("from the command, s", outcome.duration_s, 2),
            spread("in motion, s", outcome.moving_s, 2),
            spread("gap over reference", outcome.gap_over_ref, 3),
            spread("  at the first step", outcome.first_gap_over_ref, 3),
            spread("  at the later ones", outcome.later_gap_over_ref, 3),
            vec!["gap, mm".to_owned(), dash(), dash(), dash(), gap, seed(outcome.worst_gap_seed)],
            least("lead time, s", outcome.lead_time_s),
            least("slip margin", outcome.slip_margin),
            spread("off the commanded end, mm", outcome.end_off_mm, 3),
        ]
        .into_iter()
        .chain(found),
    )
}
