//! `rig identify`: parameters of a rig out of its logs.

use std::path::{Path, PathBuf};

use super::failure::{Failure, Outcome};
use super::output::{self, WithFiles};
use crate::bringup::{Stage, gates};
use crate::identify::IdentifyError;
use crate::identify::plot;
use crate::identify::published::{self, CONVERGED, Tread};
use crate::identify::record::Record;
use crate::identify::result::{Identification, Parameter, Residuals, figures, identify};
use crate::scenario::{PRESETS, Scenario};
use crate::table::{number, plain, width, wrapped};
use crate::{files, progress};
use clap::builder::PossibleValuesParser;

/// Identifies a rig's parameters from its logs, each with an interval; all hold in 19 of 20 rigs.
///
/// Several logs of one rig give narrower intervals: a scheduled deployment and two at constant
/// preloads, one light, one heavy; logs of several rigs are refused. Writes a scenario file with what was identified and a
/// picture of the residuals of each log. The exit code is 1 if a part of a log is missing.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Logs of deployments: log.mcap, or log.csv with its metadata beside it.
    #[arg(value_name = "LOG", required_unless_present = "published", conflicts_with = "published")]
    logs: Vec<PathBuf>,

    /// Fits the tread to the three gaps that the study publishes.
    #[arg(long)]
    published: bool,

    /// Rig preset of the logs; by default that of the first log, or of the file.
    #[arg(long, value_name = "NAME", value_parser = PossibleValuesParser::new(PRESETS))]
    rig: Option<String>,

    /// Overrides a parameter that the fit starts from or takes as known.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,

    /// Scenario file with what is known of the rig.
    #[arg(long, value_name = "FILE")]
    scenario: Option<PathBuf>,

    /// Directory of the parameter file and the pictures; by default out/identify, with a number
    /// if that has another result. In that of a rig's first power-up the result goes into its
    /// mine.toml, and the gate is recorded.
    #[arg(long, value_name = "DIR", conflicts_with = "published")]
    out: Option<PathBuf>,

    /// Prints the result as one JSON object.
    #[arg(long)]
    json: bool,
}

impl From<IdentifyError> for Failure {
    fn from(error: IdentifyError) -> Self {
        match error {
            IdentifyError::Log { .. } | IdentifyError::Several { .. } => Self::input(error),
            IdentifyError::NoFit { .. } => Self::run(error),
        }
    }
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let given = Scenario::resolve(args.rig.as_deref(), args.scenario.as_deref(), &args.set)?;
    if args.published {
        return by_published(args, &given);
    }
    if let Some(out) = &args.out {
        let read: Vec<&Path> =
            args.logs.iter().chain(&args.scenario).map(PathBuf::as_path).collect();
        output::spare("--out", &out.join(FILE), &read)?;
    }
    let unnamed = args.rig.is_none() && args.scenario.is_none() && args.set.is_empty();
    let named = (!unnamed).then_some(&given);
    let records: Vec<Record> =
        args.logs.iter().map(|path| Record::read(path, named)).collect::<Result<_, _>>()?;
    let scenario = match records.first() {
        Some(record) if unnamed => record.scenario.clone(),
        _ => given,
    };
    let found = {
        let _progress = progress::spinner("identify");
        identify(&records, &scenario)?
    };
    let files = write(&found, &records, args.out.as_deref())?;
    if let Some(folder) = args.out.as_deref().filter(|folder| folder.join(gates::STATE).exists()) {
        let gate = gates::identified(&found.scenario, found.is_complete);
        let (of, logged) = (Stage::Identification, &records[0].scenario);
        let refused = (!gate.ok).then(|| format!("{}: {}", gate.measured, gate.advice));
        gates::record(folder, of, gate, logged, Some(&found.scenario)).map_err(Failure::input)?;
        if let Some(why) = refused {
            return Err(Failure::run(format!("identification is not passed; {why}")));
        }
    }
    print(args, &found, &files)
}

fn print(args: &Args, found: &Identification, files: &[PathBuf]) -> Result<Outcome, Failure> {
    let printed = WithFiles { result: found, files };
    output::result(args.json, &printed, || human(found) + &output::wrote(files))?;
    Ok(Outcome::of(found.is_complete))
}

/// The parameter file, and the directory where none is asked for.
const FILE: &str = "identified.toml";
const USUAL: &str = "out/identify";

fn write(
    found: &Identification,
    records: &[Record],
    asked: Option<&Path>,
) -> Result<Vec<PathBuf>, Failure> {
    let text = found.to_toml();
    let is_other = |folder: &Path| files::is_other(&folder.join(FILE), &text);
    let directory = files::place(asked, Path::new(USUAL), is_other);
    files::make_directory(&directory)?;
    // The parameters of a rig are in one file, which the gate writes.
    let is_of_rig = directory.join(gates::STATE).exists();
    let mut files = vec![directory.join(if is_of_rig { gates::MINE } else { FILE })];
    if !is_of_rig {
        files::write_text(&files[0], &text)?;
    }
    for (index, record) in records.iter().enumerate() {
        let rows: Vec<&Residuals> =
            found.residuals.iter().filter(|of| of.log == record.name).collect();
        let path = directory.join(format!("residuals-{}.svg", index + 1));
        files::write_text(&path, &plot::svg(&rows))?;
        files.push(path);
    }
    Ok(files)
}

fn human(found: &Identification) -> String {
    let rows = found.parameters.iter().map(|p| {
        let width = p.high.zip(p.low).map_or(0.0, |(high, low)| high - low);
        vec![p.name.clone(), p.unit.to_owned(), figures(p.value, width), p.interval(), p.by.clone()]
    });
    let table = plain(&["parameter", "unit", "value", "interval", "identified by"], rows);
    let mut text = format!("{} degrees of freedom\n{table}\n\n", found.degrees_of_freedom);
    let rows = found.residuals.iter().map(|left| {
        vec![
            format!("{}:\n  {}", left.log, left.channel),
            left.unit.to_owned(),
            figures(left.rms, left.rms),
            left.count.to_string(),
            number(left.independent, 0),
        ]
    });
    text += &format!("{}\n", plain(&["residuals", "unit", "rms", "values", "independent"], rows));
    for note in &found.notes {
        text += &wrapped(note, "  ", width());
    }
    text
}

fn by_published(args: &Args, scenario: &Scenario) -> Result<Outcome, Failure> {
    let (free, held, stated) = {
        let _progress = progress::spinner("fit to the published gaps");
        (
            published::fit(scenario, CONVERGED, false)?,
            published::fit(scenario, CONVERGED, true)?,
            published::stated(scenario, CONVERGED)?,
        )
    };
    let of = |name: &str, unit, value| Parameter {
        name: name.to_owned(),
        unit,
        value,
        low: None,
        high: None,
        identified: true,
        by: "three published gaps".to_owned(),
    };
    let rms = (free.residuals_mm.iter().map(|r| r * r).sum::<f64>() / 3.0).sqrt();
    let found = Identification {
        parameters: vec![
            of("tread.k_inf_pa_per_m", "Pa/m", free.k_inf_pa_per_m),
            of("tread.stiffening", "", free.stiffening),
            of("tread.tau_s", "s", free.tau_s),
        ],
        residuals: vec![Residuals {
            log: "published".to_owned(),
            channel: "gap",
            unit: "mm",
            rms,
            count: 3,
            independent: 3.0,
            series: Vec::new(),
        }],
        degrees_of_freedom: 0,
        notes: vec![
            "three points fit three parameters: no degree of freedom is left, so there is neither \
             a validation nor an interval"
                .to_owned(),
            of_tread("this fit", &free),
            "one combination of the three is all but free: it is held to the scenario's tread \
             within a factor of two"
                .to_owned(),
            of_tread("with the scenario's stiffening held", &held),
            of_tread("the scenario's tread", &stated),
        ],
        is_complete: true,
        scenario: scenario.clone(),
    };
    print(args, &found, &[])
}

fn of_tread(what: &str, tread: &Tread) -> String {
    let [first, second, third] = tread.residuals_mm;
    format!(
        "{what}: {:.4e} Pa/m, {:.3}, {:.4} s leave {first:+.3}, {second:+.3} and {third:+.3} mm to \
         the gaps",
        tread.k_inf_pa_per_m, tread.stiffening, tread.tau_s
    )
}
