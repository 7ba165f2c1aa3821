//! `rig resets`: the board reset in the middle of runs.

use hil_sim::cli::failure::{Failure, Outcome};
use hil_sim::cli::scenario::ScenarioArgs;

/// Resets the emulated board at random instants of deployments and retractions: by
/// brown-out, watchdog, pin and software.
///
/// Of each it is looked at whether the next start reports it with what the drive was
/// doing, the stored parameters are whole, nothing moves before a command, and the drive
/// arrives at an end when it is told to. The exit code is 1 if one is not survived.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    scenario: ScenarioArgs,

    /// How many.
    #[arg(short = 'n', value_name = "N", default_value_t = 100,
          value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    count: u64,

    /// Number of the first.
    #[arg(long, value_name = "N", default_value_t = 0)]
    first: u64,

    /// Seed of the campaign; each reset has a plant of its own.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,

    /// Shows the log of each board on stderr.
    #[arg(long)]
    log: bool,

    /// Prints the outcome as one JSON object.
    #[arg(long)]
    json: bool,
}

/// Without the emulated board: go on with a binary that has it.
#[cfg(not(feature = "board"))]
pub(super) fn run(_: &Args) -> Result<Outcome, Failure> {
    Ok(Outcome::Code(hil_sim::provision::go_on()?))
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    use hil_sim::cli::output;
    use crate::log::Strings;
    use hil_sim::firmware::{self, Profile};
    use crate::{progress, resets};

    let scenario = args.scenario.resolve()?;
    crate::run::check(&scenario).map_err(Failure::input)?;
    let elf = firmware::image(Profile::Release)?;
    let strings = Strings::of(&elf).map_err(Failure::run)?;
    let cases: Vec<resets::Case> =
        (args.first..args.first + args.count).map(|index| resets::case(args.seed, index)).collect();
    let all = {
        let bar = progress::bar("resets", args.count);
        let done = |after: &resets::After| {
            for wrong in &after.wrong {
                bar.line(&format!("reset {}: {wrong}", after.case.index));
            }
            bar.advance(1);
        };
        let show = |index: u64, t_s: f64, line: &crate::log::Line| {
            if args.log {
                bar.line(&format!("{index} [{t_s:8.3}] {:<5} {}", line.level, line.text));
            }
        };
        let told = resets::Told { done: &done, line: &show };
        resets::run(&elf, &strings, &scenario, &cases, &told).map_err(Failure::run)?
    };
    let outcome = resets::Outcome::of(&all);
    output::result(args.json, &outcome, || human(&outcome))?;
    Ok(Outcome::of(outcome.is_good()))
}

fn human(outcome: &crate::resets::Outcome) -> String {
    use hil_sim::table::{number, plain};

    let rows = outcome.kinds.iter().map(|kind| {
        let counts = [kind.resets, kind.recorded, kind.held, kind.completed, kind.other_way];
        let mut row = vec![kind.kind.name().to_owned()];
        row.extend(counts.iter().map(usize::to_string));
        row.push(number(kind.worst_motion_mm, 2));
        row
    });
    let head = ["reset", "made", "recorded", "held", "arrived", "other way", "motion, mm"];
    let mut text = format!("{}\n", plain(&head, rows));
    let rows = outcome.modes.iter().map(|mode| {
        let counts = [mode.resets, mode.watchdog, mode.completed, mode.other_way];
        let mut row = vec![mode.mode.to_owned()];
        row.extend(counts.iter().map(usize::to_string));
        row
    });
    let head = ["in mode", "made", "by watchdog", "arrived", "other way"];
    text += &format!("{}\n", plain(&head, rows));
    text += &format!(
        "{} resets: {} without a record, {} with other parameters, {} not held, {} that did not \
         arrive; a run that hung went on for {} mm at most, preload changed by {} N at most\n",
        outcome.resets,
        outcome.unrecorded,
        outcome.parameters_changed,
        outcome.not_held,
        outcome.incomplete,
        number(outcome.worst_hung_mm, 2),
        number(outcome.worst_preload_n, 1)
    );
    for after in &outcome.wrong {
        let case = &after.case;
        text += &format!(
            "  {} ({} at {:.1} mm, {}, then {}): {}\n",
            case.index,
            case.way.name(),
            after.position_mm,
            case.kind.name(),
            case.then.name(),
            after.wrong.join("; ")
        );
    }
    text
}
