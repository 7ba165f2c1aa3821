//! `rig paper`: the study's figures and claims, regenerated.

use std::path::PathBuf;

use super::{docs, failed, write};
use crate::paper::{self, Study, experiment, page};
use hil_sim::cli::campaign::complete;
use hil_sim::cli::failure::{Failure, Outcome};
use hil_sim::cli::output::{self, WithFiles};
use hil_sim::table::plain;

/// Regenerates the figures of the study as theory, simulation and virtual rig, and judges
/// its claims by them.
///
/// Writes a page with all figures, and the data as JSON. A claim that does not hold is a
/// result, not a failure.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Directory of page, figures and data; by default docs/paper of the repository.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,

    /// Prints figures and claims as one JSON object.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let directory = args.out.clone().unwrap_or_else(|| docs().join("paper"));
    // A directory that cannot be made is reported before the runs.
    std::fs::create_dir_all(&directory)
        .map_err(|error| Failure::input(format!("{}: {error}", directory.display())))?;
    let experiments = complete(experiment::campaign(&paper::cases())).map_err(failed)?;
    let experiments = experiments.ok_or_else(|| Failure::run("interrupted: nothing is written"))?;
    let study = paper::regenerate(&experiments).map_err(failed)?;
    let mut files: Vec<(&str, String)> =
        study.figures.iter().map(|figure| (figure.file.as_str(), figure.svg())).collect();
    files.push(("README.md", page::markdown(&study).map_err(failed)?));
    files.push(("paper.json", paper::json(&study).map_err(Failure::run)? + "\n"));
    let files = write(&directory, files)?;
    let printed = WithFiles { result: &study, files: &files };
    output::result(args.json, &printed, || human(&study, &files))?;
    Ok(Outcome::Good)
}

fn human(study: &Study, files: &[PathBuf]) -> String {
    let held = study.claims.iter().filter(|claim| claim.holds).count();
    let rows = study.claims.iter().map(|claim| {
        let verdict = if claim.holds { "holds" } else { "does not hold" };
        vec![claim.claim.clone(), claim.figure.clone(), verdict.to_owned()]
    });
    format!(
        "{} figures; of {} claims {held} hold and {} do not\n{}\n{}",
        study.figures.len(),
        study.claims.len(),
        study.claims.len() - held,
        plain(&["the study says", "figure", "in ours"], rows),
        output::wrote(files)
    )
}
