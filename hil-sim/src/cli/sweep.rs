//! `rig sweep`: a key over a range, or several over a grid.

use std::path::{Path, PathBuf};

use serde_json::{Map, Value, json};

use super::campaign::CampaignArgs;
use super::crossing::{Method, check, compute};
use super::failure::{Failure, Outcome};
use super::output;
use super::scenario::{CONTROLLER, RunArgs, SEED};
use crate::campaign::{AS_GIVEN, Campaign, Column, Frame, column};
use crate::files::{make_directory, vacant, vacant_for, write_text};
use crate::rollout::CrossingSetup;
use crate::scenario::Scenario;
use crate::session::{self, Options};
use crate::sweep::{self, Axis, MOST, Plot};

/// Names of the pseudo-keys of an isolated crossing.
const SPEED: &str = "speed_mm_s";
const PRELOAD: &str = "preload_n";

/// Runs a deployment, or one isolated crossing, for each value of a key, or at each place of a
/// grid of several: table, CSV and picture.
///
/// A deployment gives its worst gap, duration and slip. With --crossing the rows are crossings
/// at constant speed and preload, which are keys there: speed_mm_s and preload_n. A row takes
/// some hundredths of a second of one core.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// A key and its values, may be repeated: KEY=LOW..HIGH:COUNT, evenly; LOW..HIGH:COUNTlog,
    /// evenly in the logarithm; or KEY=A,B,C.
    #[arg(long, value_name = "KEY=VALUES", required_unless_present = "crossing")]
    key: Vec<Axis>,

    /// One isolated crossing a row; without --key its gap against speed at cruise preload and
    /// at the limit.
    #[arg(long)]
    crossing: bool,

    /// With --crossing: what computes it.
    #[arg(long, value_enum, requires = "crossing", default_value_t = Method::Ring)]
    method: Method,

    /// With --crossing: driven by torque against this wheel's share of the top load.
    #[arg(long, requires = "crossing")]
    driven: bool,

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

/// What is found at each place, and what of it is plotted.
type Measure = (&'static [Column], &'static [Plot]);

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    if args.crossing {
        args.run.without(CONTROLLER, "speed and preload of a crossing are given")?;
        args.run.without(SEED, "a crossing has no noise")?;
    }
    let base = args.run.resolve()?;
    let axes = axes(args, &base)?;
    let places = sweep::places(&axes);
    // Everything is checked before anything is run.
    let points = places.iter().map(|place| Point::of(args, &base, &axes, place));
    let points: Vec<Point> = points.collect::<Result<_, _>>()?;
    let measure = match (args.crossing, args.driven) {
        (false, _) => RUN,
        (true, true) => CROSSING,
        // The friction comes last.
        (true, false) => (&CROSSING.0[..4], &CROSSING.1[..2]),
    };
    let campaign = Campaign {
        steps: (if args.crossing { "crossings" } else { "runs" }, 1),
        cases: points.iter().zip(&places).collect(),
        run: Box::new(|(point, place): &(&Point, &Vec<&str>), watch| {
            let row = sweep::row(&axes, place, point.found(args.method)?);
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
    let columns: Vec<Column> = keys.chain(measure.0.iter().cloned()).collect();
    let (rows, table) = (&found.outcome, Frame::of(&columns, &found.outcome));
    let write = || write(args, &axes, rows, &table.csv(), measure.1);
    let files = if args.no_files { Vec::new() } else { write()? };
    let printed = json!({ "rows": rows, "files": files });
    let text = || table.text(&["gap_over_ref", "faults"]) + &output::wrote(&files);
    let good = rows.iter().all(|row| row.get("completed") != Some(&json!(false)));
    found.print(&args.campaign, &printed, &table, text, good)
}

/// The keys that were given, or the usual ones of a crossing.
fn axes(args: &Args, base: &Scenario) -> Result<Vec<Axis>, Failure> {
    let mut axes = args.key.clone();
    if axes.is_empty() {
        let preload = &base.rig.preload;
        let usual = [
            format!("{SPEED}=2..30:15"),
            format!("{PRELOAD}={},{}", preload.cruise_n, preload.limit_n),
        ];
        let usual: Result<_, _> = usual.iter().map(|text| text.parse()).collect();
        axes = usual.map_err(Failure::run)?;
    }
    for (index, axis) in axes.iter().enumerate() {
        if axes[..index].iter().any(|other| other.key == axis.key) {
            return Err(Failure::input(format!("--key {}: given twice", axis.key)));
        }
        if base.keys().iter().any(|info| info.key == axis.key && info.value.is_array()) {
            let why = "takes a list, which no sweep varies";
            return Err(Failure::input(format!("--key {}: {why}", axis.key)));
        }
        if !args.crossing && [SPEED, PRELOAD].contains(&&*axis.key) {
            return Err(Failure::input(format!("--key {}: takes --crossing", axis.key)));
        }
    }
    let count = axes.iter().try_fold(1_usize, |count, axis| count.checked_mul(axis.values.len()));
    match count {
        Some(1..=MOST) => Ok(axes),
        _ => Err(Failure::input(format!("--key: a grid of more than {MOST} places"))),
    }
}

/// A place of the grid.
struct Point {
    scenario: Scenario,
    crossing: Option<CrossingSetup>,
}

impl Point {
    fn of(args: &Args, base: &Scenario, axes: &[Axis], place: &[&str]) -> Result<Self, Failure> {
        let all = || axes.iter().map(|axis| &*axis.key).zip(place.iter().copied());
        let own = |key: &str| args.crossing && [SPEED, PRELOAD].contains(&key);
        let keys = all().filter(|(key, _)| !own(key));
        let sets: Vec<String> = keys.map(|(key, value)| format!("{key}={value}")).collect();
        let scenario = base.clone().with(&sets)?;
        if !args.crossing {
            return Ok(Self { scenario, crossing: None });
        }
        let given = |name: &str, usual: f64| match all().find(|(key, _)| *key == name) {
            Some((_, text)) => text
                .parse()
                .map_err(|_| Failure::input(format!("--key {name}={text}: expected a number"))),
            None => Ok(usual),
        };
        let loads = &scenario.rig.plant;
        let setup = CrossingSetup {
            speed_mm_s: given(SPEED, scenario.rig.control.safe_speed_mm_s)?,
            preload_n: given(PRELOAD, scenario.rig.preload.cruise_n)?,
            direction: scenario.run.direction.into(),
            load_n: args.driven.then_some(loads.top_load_n * loads.top_load_share),
        };
        check(&setup, ["--key speed_mm_s", "--key preload_n"])?;
        Ok(Self { scenario, crossing: Some(setup) })
    }

    /// What is found here.
    fn found(&self, method: Method) -> Result<Row, Failure> {
        let found = match &self.crossing {
            Some(setup) => json!(compute(setup, None, method, &self.scenario)?),
            None => {
                let summary = session::run(&self.scenario, Options::default())?.summary;
                let over_ref = summary.max_gap_mm / summary.gap_ref_mm;
                json!({
                    "completed": summary.completed,
                    "max_gap_mm": summary.max_gap_mm,
                    "gap_over_ref": (summary.gap_ref_mm > 0.0).then_some(over_ref),
                    "duration_s": summary.duration_s.filter(|_| summary.completed),
                    "slip_mm": summary.slip_mm,
                    "faults": summary.faults.iter().map(|fault| fault.code).collect::<Vec<_>>(),
                })
            }
        };
        Ok(found.as_object().cloned().unwrap_or_default())
    }
}

const fn plot(column: &'static str, title: &'static str, y_name: &'static str) -> Plot {
    Plot { column, title, y_name }
}

const RUN: Measure = (
    &[
        column("completed", "completed", "", 0),
        column("max_gap_mm", "worst gap", "mm", 3),
        column("gap_over_ref", "over\nreference", "", 4),
        column("duration_s", "duration", "s", 2),
        column("slip_mm", "slip", "mm", 3),
        column("faults", "faults", "", 0),
    ],
    &[
        plot("max_gap_mm", "Worst gap", "gap, mm"),
        plot("duration_s", "Duration from the command", "duration, s"),
        plot("slip_mm", "Gross slip", "slip, mm"),
    ],
);

const CROSSING: Measure = (
    &[
        column("gap_mm", "gap", "mm", 3),
        column("corner_force_n", "corner", "N", 2),
        column("embedding_mm", "embedding", "mm", 3),
        column("climb_work_mj", "work", "mJ", 1),
        column("mu_needed", "friction\nneeded", "", 3),
    ],
    &[
        plot("gap_mm", "Gap of the crossing", "gap, mm"),
        plot("corner_force_n", "Corner force", "force, N"),
        plot("mu_needed", "Friction needed", "friction"),
    ],
);

fn write(
    args: &Args,
    axes: &[Axis],
    rows: &[Row],
    table: &str,
    plots: &[Plot],
) -> Result<Vec<PathBuf>, Failure> {
    let keys: Vec<&str> = axes.iter().map(|axis| &*axis.key).collect();
    let what = if args.crossing { "crossing" } else { "deploy" };
    // Another sweep of these keys keeps its folder.
    let file = |folder: &Path| folder.join("sweep.csv");
    let directory = args.out.clone().unwrap_or_else(|| {
        let usual = Path::new("out").join(format!("sweep-{what}-{}", keys.join("-")));
        vacant(&usual, |folder| vacant_for(&file(folder), table) == file(folder))
    });
    make_directory(&directory)?;
    let mut files = vec![file(&directory)];
    write_text(&files[0], table)?;
    if let Some(picture) = sweep::picture(axes, rows, plots) {
        files.push(directory.join("sweep.svg"));
        write_text(&files[1], &picture)?;
    }
    Ok(files)
}
