//! `rig sweep`: a key over a range, or several over a grid.

use std::path::{Path, PathBuf};

use serde_json::{Map, Value, json};

use super::campaign::CampaignArgs;
use super::failure::{Failure, Outcome};
use super::output;
use super::scenario::RunArgs;
use crate::campaign::{AS_GIVEN, Campaign, Column, Frame, column};
use crate::files::{is_other, make_directory, place, write_text};
use crate::scenario::Scenario;
use crate::session::{self, Options};
use crate::sweep::{self, Axis, MOST, Plot};

/// Runs a deployment for each value of a key, or at each place of a grid of several: worst gap,
/// duration and slip as table, CSV and picture.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// A key and its values, may be repeated: KEY=LOW..HIGH:COUNT, evenly; LOW..HIGH:COUNTlog,
    /// evenly in the logarithm; or KEY=A,B,C.
    #[arg(long, value_name = "KEY=VALUES", required = true)]
    key: Vec<Axis>,

    #[command(flatten)]
    run: RunArgs,

    /// Directory of table and picture; by default one in out, named after the keys.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,

    /// Writes no files.
    #[arg(long, conflicts_with = "out")]
    no_files: bool,

    #[command(flatten)]
    pub(super) campaign: CampaignArgs,
}

type Row = Map<String, Value>;

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let base = args.run.resolve()?;
    check(&args.key, &base)?;
    let axes = &args.key;
    let places = sweep::places(axes);
    // Everything is checked before anything is run.
    let scenario = |place: &Vec<&str>| {
        let sets = axes.iter().zip(place).map(|(axis, value)| format!("{}={value}", axis.key));
        base.clone().with(&sets.collect::<Vec<_>>())
    };
    let scenarios = places.iter().map(scenario).collect::<Result<Vec<_>, _>>()?;
    let campaign = Campaign {
        steps: ("runs", 1),
        cases: scenarios.iter().zip(&places).collect(),
        run: Box::new(|(scenario, place): &(&Scenario, &Vec<&str>), watch| {
            let row = sweep::row(axes, place, found(scenario)?);
            (watch.done)();
            Ok::<_, Failure>(Some(row))
        }),
        fold: Box::new(|lines| lines.into_iter().map(|(_, row)| row).collect::<Vec<Row>>()),
    };
    let found = args.campaign.carry_out(base.to_toml(), campaign)?;
    let keys = axes.iter().map(|Axis { key, .. }| Column {
        key: key.clone().into(),
        name: key.replace('.', ".\n").into(),
        ..column("", "", "", AS_GIVEN)
    });
    let columns: Vec<Column> = keys.chain(COLUMNS).collect();
    let (rows, table) = (&found.outcome, Frame::of(&columns, &found.outcome));
    let write = || write(args, rows, &table.csv());
    let files = if args.no_files { Vec::new() } else { write()? };
    let printed = json!({ "rows": rows, "files": files });
    let text = || table.text(&["gap_over_ref", "faults"]) + &output::wrote(&files);
    let good = rows.iter().all(|row| row.get("completed") != Some(&json!(false)));
    found.print(&args.campaign, &printed, &table, text, good)
}

/// Refuses keys that cannot be swept together.
fn check(axes: &[Axis], base: &Scenario) -> Result<(), Failure> {
    for (index, axis) in axes.iter().enumerate() {
        if axes[..index].iter().any(|other| other.key == axis.key) {
            return Err(Failure::input(format!("--key {}: given twice", axis.key)));
        }
        if base.keys().iter().any(|info| info.key == axis.key && info.value.is_array()) {
            let why = "takes a list, which no sweep varies";
            return Err(Failure::input(format!("--key {}: {why}", axis.key)));
        }
    }
    let count = axes.iter().try_fold(1_usize, |count, axis| count.checked_mul(axis.values.len()));
    match count {
        Some(1..=MOST) => Ok(()),
        _ => Err(Failure::input(format!("--key: a grid of more than {MOST} places"))),
    }
}

/// What a run of it shows.
fn found(scenario: &Scenario) -> Result<Row, Failure> {
    let summary = session::run(scenario, Options::default())?.summary;
    let over_ref = summary.max_gap_mm / summary.gap_ref_mm;
    let found = json!({
        "completed": summary.completed,
        "max_gap_mm": summary.max_gap_mm,
        "gap_over_ref": (summary.gap_ref_mm > 0.0).then_some(over_ref),
        "duration_s": summary.duration_s.filter(|_| summary.completed),
        "slip_mm": summary.slip_mm,
        "faults": summary.faults.iter().map(|fault| fault.code).collect::<Vec<_>>(),
    });
    Ok(found.as_object().cloned().unwrap_or_default())
}

const fn plot(column: &'static str, title: &'static str, y_name: &'static str) -> Plot {
    Plot { column, title, y_name }
}

const COLUMNS: [Column; 6] = [
    column("completed", "completed", "", 0),
    column("max_gap_mm", "worst gap", "mm", 3),
    column("gap_over_ref", "over\nreference", "", 4),
    column("duration_s", "duration", "s", 2),
    column("slip_mm", "slip", "mm", 3),
    column("faults", "faults", "", 0),
];
const PLOTS: [Plot; 3] = [
    plot("max_gap_mm", "Worst gap", "gap, mm"),
    plot("duration_s", "Duration from the command", "duration, s"),
    plot("slip_mm", "Gross slip", "slip, mm"),
];

fn write(args: &Args, rows: &[Row], table: &str) -> Result<Vec<PathBuf>, Failure> {
    let keys: Vec<&str> = args.key.iter().map(|axis| &*axis.key).collect();
    let file = |folder: &Path| folder.join("sweep.csv");
    let usual = Path::new("out").join(format!("sweep-deploy-{}", keys.join("-")));
    let directory = place(args.out.as_deref(), &usual, |folder| is_other(&file(folder), table));
    make_directory(&directory)?;
    let mut files = vec![file(&directory)];
    write_text(&files[0], table)?;
    if let Some(picture) = sweep::picture(&args.key, rows, &PLOTS) {
        files.push(directory.join("sweep.svg"));
        write_text(&files[1], &picture)?;
    }
    Ok(files)
}
