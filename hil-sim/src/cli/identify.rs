//! `rig identify`: parameters of a rig out of its logs.

use std::path::{Path, PathBuf};

use clap::builder::PossibleValuesParser;
use serde::Serialize;

use super::failure::{Failure, Outcome};
use super::output;
use crate::identify::IdentifyError;
use crate::identify::forward::Fineness;
use crate::identify::plot;
use crate::identify::published::{self, Tread};
use crate::identify::record::Record;
use crate::identify::result::{Identification, Left, Parameter, identify};
use crate::identify::study::{Study, study};
use crate::scenario::{PRESETS, Scenario};
use crate::table::{number, plain};
use crate::{files, progress};

/// Identifies a rig's parameters from its logs, with 95 % intervals.
///
/// Several logs of one rig tell more than one: a scheduled deployment and two at constant
/// preloads, one light, one heavy. Writes a scenario file with what was identified and a
/// picture of the residuals of each log.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Logs of deployments: log.mcap or log.csv.
    #[arg(value_name = "LOG", required_unless_present_any = ["published", "hidden"],
          conflicts_with_all = ["published", "hidden"])]
    logs: Vec<PathBuf>,

    /// Fits the tread to the three gaps that the study publishes.
    #[arg(long, conflicts_with = "hidden")]
    published: bool,

    /// Identifies this many rigs of hidden parameters from logs made on them, and counts
    /// how often the truth lies within the interval.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=10_000))]
    hidden: Option<u64>,

    /// Rig preset that the logs are of; by default what the first log says, or that of the
    /// file.
    #[arg(long, value_name = "NAME", value_parser = PossibleValuesParser::new(PRESETS))]
    rig: Option<String>,

    /// Overrides a parameter that the fit starts from or takes as known.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,

    /// Scenario file with what is known of the rig.
    #[arg(long, value_name = "FILE")]
    scenario: Option<PathBuf>,

    /// Directory of the parameter file and the pictures.
    #[arg(long, value_name = "DIR", default_value = "out/identify")]
    out: PathBuf,

    /// Prints the result as one JSON object.
    #[arg(long)]
    json: bool,
}

impl From<IdentifyError> for Failure {
    fn from(error: IdentifyError) -> Self {
        match error {
            IdentifyError::Log { .. } => Self::input(error),
            IdentifyError::NoFit { .. } => Self::run(error),
        }
    }
}

/// What `--json` prints.
#[derive(Serialize)]
struct Printed<'a> {
    parameters: &'a [Parameter],
    residuals: &'a [Left],
    degrees_of_freedom: usize,
    notes: &'a [String],
    files: &'a [PathBuf],
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let given = Scenario::resolve(args.rig.as_deref(), args.scenario.as_deref(), &args.set)?;
    if args.published {
        return by_published(args, &given);
    }
    if let Some(count) = args.hidden {
        return by_hidden(args, &given, count);
    }
    let records: Vec<Record> =
        args.logs.iter().map(|path| Record::read(path, &given)).collect::<Result<_, _>>()?;
    let told = args.rig.is_none() && args.scenario.is_none() && args.set.is_empty();
    let scenario = match records.first() {
        Some(record) if told => record.scenario.clone(),
        _ => given,
    };
    let found = {
        let _progress = progress::spinner("identify");
        identify(&records, &scenario, Fineness::default())?
    };
    let files = write(&found, &records, &args.out)?;
    let printed = Printed {
        parameters: &found.parameters,
        residuals: &found.residuals,
        degrees_of_freedom: found.degrees_of_freedom,
        notes: &found.notes,
        files: &files,
    };
    output::result(args.json, &printed, || human(&found, &files))?;
    Ok(Outcome::Good)
}

fn write(
    found: &Identification,
    records: &[Record],
    directory: &Path,
) -> Result<Vec<PathBuf>, Failure> {
    files::make_directory(directory)?;
    let mut files = vec![directory.join("identified.toml")];
    files::write_text(&files[0], &found.to_toml())?;
    for (index, record) in records.iter().enumerate() {
        let rows: Vec<&Left> =
            found.residuals.iter().filter(|left| left.log == record.name).collect();
        let path = directory.join(format!("residuals-{}.svg", index + 1));
        files::write_text(&path, &plot::svg(&rows))?;
        files.push(path);
    }
    Ok(files)
}

/// Seven significant digits at most, as many decimals as the interval's width asks for.
fn figures(value: f64, width: f64) -> String {
    if width > 0.0 && width.is_finite() {
        let decimals = (1.0 - width.log10().floor()).clamp(0.0, 6.0) as usize;
        if value.abs() >= 1e6 { format!("{value:.4e}") } else { format!("{value:.decimals$}") }
    } else if value.abs() >= 1e6 {
        format!("{value:.4e}")
    } else {
        format!("{value:.4}")
    }
}

fn human(found: &Identification, files: &[PathBuf]) -> String {
    let rows = found.parameters.iter().map(|p| {
        let width = p.high.zip(p.low).map_or(0.0, |(high, low)| high - low);
        let end = |end: Option<f64>| end.map_or("-".to_owned(), |end| figures(end, width));
        let interval = format!("{} to {}", end(p.low), end(p.high));
        vec![p.name.clone(), p.unit.to_owned(), figures(p.value, width), interval, p.by.clone()]
    });
    let table = plain(&["parameter", "unit", "value", "95 % interval", "identified by"], rows);
    let mut text = format!("{} degrees of freedom\n{table}\n", found.degrees_of_freedom);
    let rows = found.residuals.iter().map(|left| {
        vec![
            format!("{}, {}", left.log, left.channel),
            left.unit.to_owned(),
            format!("{:.2e}", left.rms),
            left.count.to_string(),
            number(left.independent, 0),
        ]
    });
    text += &format!("{}\n", plain(&["left over", "unit", "rms", "values", "independent"], rows));
    for note in &found.notes {
        text += &format!("  {note}\n");
    }
    for file in files {
        text += &format!("  wrote {}\n", file.display());
    }
    text
}

fn by_published(args: &Args, scenario: &Scenario) -> Result<Outcome, Failure> {
    let (coarse, converged, held, stated) = {
        let _progress = progress::spinner("fit to the published gaps");
        (
            published::fit(scenario, published::Fineness::STATED)?,
            published::fit(scenario, published::Fineness::CONVERGED)?,
            published::fit_held(scenario, published::Fineness::CONVERGED)?,
            published::stated(scenario, published::Fineness::CONVERGED)?,
        )
    };
    let parameters = published_parameters(&converged);
    let notes = vec![
        "three points fit three parameters: no degree of freedom is left, so there is neither a \
         validation nor an interval"
            .to_owned(),
        of_tread("this fit", &converged),
        "one combination of the three is all but free: it is held to the scenario's tread \
         within a factor of two"
            .to_owned(),
        of_tread("the same fit by a coarse ring", &coarse),
        of_tread("with the scenario's stiffening held", &held),
        of_tread("the scenario's tread by the converged ring", &stated),
    ];
    let residuals = published_residuals(&converged);
    let printed = Printed {
        parameters: &parameters,
        residuals: &residuals,
        degrees_of_freedom: 0,
        notes: &notes,
        files: &[],
    };
    output::result(args.json, &printed, || {
        let rows = parameters.iter().map(|p| {
            let none = "none".to_owned();
            vec![p.name.clone(), p.unit.to_owned(), figures(p.value, 0.0), none, p.by.clone()]
        });
        let head = ["parameter", "unit", "value", "95 % interval", "identified by"];
        let mut text = format!("0 degrees of freedom\n{}\n", plain(&head, rows));
        for note in &notes {
            text += &format!("  {note}\n");
        }
        text
    })?;
    Ok(Outcome::Good)
}

fn of_tread(what: &str, tread: &Tread) -> String {
    let [first, second, third] = tread.residuals_mm;
    format!(
        "{what}: {:.4e} Pa/m, {:.3}, {:.4} s leave {first:+.3}, {second:+.3} and {third:+.3} mm to \
         the gaps",
        tread.k_inf_pa_per_m, tread.stiffening, tread.tau_s
    )
}

fn published_parameters(tread: &Tread) -> Vec<Parameter> {
    let of = |name: &str, unit, value| Parameter {
        name: name.to_owned(),
        unit,
        value,
        low: None,
        high: None,
        identified: true,
        by: "three published gaps".to_owned(),
    };
    vec![
        of("tread.k_inf_pa_per_m", "Pa/m", tread.k_inf_pa_per_m),
        of("tread.stiffening", "", tread.stiffening),
        of("tread.tau_s", "s", tread.tau_s),
    ]
}

fn published_residuals(tread: &Tread) -> Vec<Left> {
    let course: Vec<(f64, f64)> =
        tread.residuals_mm.iter().enumerate().map(|(i, r)| (i as f64, *r)).collect();
    let square: f64 = tread.residuals_mm.iter().map(|r| r * r).sum();
    vec![Left {
        log: "published".to_owned(),
        channel: "gap",
        unit: "mm",
        rms: (square / course.len() as f64).sqrt(),
        count: course.len(),
        independent: course.len() as f64,
        course,
    }]
}

fn by_hidden(args: &Args, scenario: &Scenario, count: u64) -> Result<Outcome, Failure> {
    let first = scenario.run.seed.max(1);
    let seeds: Vec<u64> = (first..first + count).collect();
    let found = {
        let bar = progress::bar("rigs", count);
        study(scenario, &seeds, Fineness::default(), &|| bar.advance(1))
    };
    output::result(args.json, &found, || study_table(&found))?;
    Ok(Outcome::of(found.failed.is_empty()))
}

fn study_table(found: &Study) -> String {
    let rows = found.parameters.iter().map(|line| {
        let worst = line.worst_rel.map(|worst| 100.0 * worst);
        vec![
            line.name.clone(),
            line.unit.to_owned(),
            format!("{} of {}", line.within, line.identified),
            format!("{:.3e}", line.rms_error),
            format!("{:.3e}", line.half_width),
            number(worst, 2),
        ]
    });
    let head = ["parameter", "unit", "within", "rms error", "half interval", "worst, %"];
    let mut text = format!("{} rigs of hidden parameters\n{}\n", found.cases, plain(&head, rows));
    for (seed, why) in &found.failed {
        text += &format!("  seed {seed}: {why}\n");
    }
    text
}
