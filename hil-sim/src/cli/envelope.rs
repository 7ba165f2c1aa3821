//! `rig envelope`: friction and load that each strategy copes with.

use std::path::PathBuf;

use serde_json::{Map, Value, json};

use super::campaign::CampaignArgs;
use super::failure::{Failure, Outcome};
use super::output;
use super::scenario::RunArgs;
use crate::campaign::{Column, Frame, column};
use crate::compare::STRATEGIES;
use crate::envelope::{self, Cell, Envelope, Grid};
use crate::files::{make_directory, write_text};
use crate::scenario::ControllerKind;
use crate::table::{number, plain, width, wrapped};

/// Over friction (0.6 to 1.3) and load on this wheel (0 to 30 N): which preload strategy
/// completes without slip, and in which time.
///
/// Once with friction and load known to the controller, once unknown: the plant has them, and
/// the controller believes those of the scenario. Durations count from the accepted command.
/// Writes a picture, envelope.svg.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Places of the grid: frictions by loads, 2 to 100 each.
    #[arg(short = 'n', value_name = "FxL", default_value_t = Grid::USUAL)]
    grid: Grid,

    #[command(flatten)]
    run: RunArgs,

    /// Directory of the picture.
    #[arg(long, value_name = "DIR", default_value = "out/envelope")]
    out: PathBuf,

    /// Writes no picture.
    #[arg(long, conflicts_with = "out")]
    no_files: bool,

    #[command(flatten)]
    pub(super) campaign: CampaignArgs,
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    args.run.without_controller("every strategy has its map")?;
    let scenario = args.run.resolve()?;
    output::no_file(&args.out)?;
    let campaign = envelope::campaign(&scenario, args.grid)?;
    let carried_out = args.campaign.carry_out(scenario.to_toml(), campaign)?;
    let found = &carried_out.outcome;
    let mut files = Vec::new();
    if !args.no_files {
        make_directory(&args.out)?;
        let path = args.out.join("envelope.svg");
        write_text(&path, &envelope::picture(found))?;
        files.push(path);
    }
    let printed = machine(found, &files);
    let text = || human(found) + &output::wrote(&files);
    let rows = Frame::of(&COLUMNS, &found.cells);
    carried_out.print(&args.campaign, &printed, &rows, text, true)
}

/// Columns of the cells.
const COLUMNS: [Column; 7] = [
    column("friction", "friction", "", 2),
    column("load_n", "load", "N", 1),
    column("known", "known", "", 0),
    column("controller", "controller", "", 0),
    column("completed", "completed", "", 0),
    column("slip_mm", "slip", "mm", 3),
    column("duration_s", "duration", "s", 3),
];

/// What `--json` prints.
fn machine(found: &Envelope, files: &[PathBuf]) -> Value {
    let area = |kind: ControllerKind| (kind.name().to_owned(), json!(found.area(kind)));
    let missing = found.not_contained();
    let place = |cell: &&Cell| {
        let Cell { friction, load_n, known, controller, .. } = *cell;
        json!({ "friction": friction, "load_n": load_n, "known": known, "controller": controller })
    };
    json!({
        "grid": found.cells,
        "area": STRATEGIES.into_iter().map(area).collect::<Map<_, _>>(),
        // Whether the scheduled strategy completes without slip wherever another one does.
        "scheduled_contains_all": missing.is_empty(),
        "not_contained": missing.iter().map(place).collect::<Vec<_>>(),
        "files": files,
    })
}

const HEADLINE: &str = "Part of the grid in which each strategy completes without slip, and its \
    time over the scheduled strategy's where both do";

fn human(found: &Envelope) -> String {
    let head = ["controller", "known", "unknown", "time known", "time unknown"];
    let rows = STRATEGIES.map(|kind| {
        let area = found.area(kind);
        let percent = |part: f64| format!("{:.1} %", 100.0 * part);
        let ratio = |known| number(found.time_ratio(kind, known), 3);
        vec![
            kind.name().to_owned(),
            percent(area.known),
            percent(area.unknown),
            ratio(true),
            ratio(false),
        ]
    });
    let mut text = wrapped(HEADLINE, "", width()) + &format!("{}\n", plain(&head, rows));
    for (known, title) in [(true, "known"), (false, "unknown")] {
        text += &format!(
            "Friction and load {title} to the controller:\n\
             s scheduled, c constant, l limit, r reactive\n{}\n",
            letters(found, known)
        );
    }
    text + &contained(found)
}

/// The strategies that complete without slip at each place, by their first letters.
fn letters(found: &Envelope, known: bool) -> comfy_table::Table {
    let frictions = found.frictions.iter().map(|friction| number(*friction, 2));
    let head: Vec<String> = std::iter::once("load N".to_owned()).chain(frictions).collect();
    let rows = found.loads_n.iter().rev().map(|load_n| {
        let at = |friction: &f64| {
            let good = found.cells.iter().filter(|cell| {
                (cell.friction, cell.load_n, cell.known) == (*friction, *load_n, known)
                    && cell.good()
            });
            good.map(|cell| &cell.controller.name()[..1]).collect::<String>()
        };
        std::iter::once(number(*load_n, 1)).chain(found.frictions.iter().map(at)).collect()
    });
    plain(&head, rows)
}

/// Whether the scheduled region contains the others, and where not.
fn contained(found: &Envelope) -> String {
    let missing = found.not_contained();
    if missing.is_empty() {
        return "The scheduled strategy completes without slip wherever another one does.\n"
            .to_owned();
    }
    let mut text =
        "The scheduled strategy does not complete without slip where another does:\n".to_owned();
    for Cell { friction, load_n, known, controller, .. } in missing {
        let known = if *known { "known" } else { "unknown" };
        text += &format!("  friction {friction:.2}, load {load_n:.1} N, {known}: ");
        text += &format!("{}\n", controller.name());
    }
    text
}
