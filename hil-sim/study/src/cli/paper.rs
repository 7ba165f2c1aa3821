//! `rig paper`: the study's figures and claims, regenerated.

use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::paper::{self, Study, StudyError, draw, page};
use hil_sim::cli::failure::{Failure, Outcome};
use hil_sim::cli::output;
use hil_sim::files::{make_directory, write_text};
use hil_sim::progress;
use hil_sim::table::plain;

/// Regenerates the figures of the study as theory, simulation and experiment, and judges
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

/// What `--json` prints.
#[derive(Serialize)]
struct Printed<'a> {
    #[serde(flatten)]
    study: &'a Study,
    files: &'a [PathBuf],
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let default = || Path::new(env!("CARGO_MANIFEST_DIR")).with_file_name("docs").join("paper");
    let directory = args.out.clone().unwrap_or_else(default);
    // Told before the runs rather than after them.
    make_directory(&directory)?;
    let study = {
        let bar = progress::bar("deployments", paper::runs() as u64);
        paper::regenerate(&|| bar.advance(1))?
    };
    let files = write(&study, &directory)?;
    let printed = Printed { study: &study, files: &files };
    output::result(args.json, &printed, || human(&study, &files))?;
    Ok(Outcome::Good)
}

fn write(study: &Study, directory: &Path) -> Result<Vec<PathBuf>, Failure> {
    let mut files = Vec::new();
    let mut put = |name: &str, text: &str| -> Result<(), Failure> {
        let path = directory.join(name);
        write_text(&path, text)?;
        files.push(path);
        Ok(())
    };
    for figure in &study.figures {
        put(&figure.file, &draw::svg(figure))?;
    }
    put("README.md", &page::markdown(study))?;
    put("paper.json", &(paper::json(study).map_err(Failure::run)? + "\n"))?;
    Ok(files)
}

fn human(study: &Study, files: &[PathBuf]) -> String {
    let held = study.claims.iter().filter(|claim| claim.holds).count();
    let rows = study.claims.iter().map(|claim| {
        let verdict = if claim.holds { "holds" } else { "does not hold" };
        vec![claim.claim.to_owned(), claim.figure.to_owned(), verdict.to_owned()]
    });
    let mut text = format!(
        "{} figures; of {} claims {held} hold and {} do not\n{}\n",
        study.figures.len(),
        study.claims.len(),
        study.claims.len() - held,
        plain(&["the study says", "figure", "in ours"], rows)
    );
    for file in files {
        text += &format!("  wrote {}\n", file.display());
    }
    text
}

impl From<StudyError> for Failure {
    fn from(error: StudyError) -> Self {
        match error {
            StudyError::Run(error) => error.into(),
            other => Self::run(other),
        }
    }
}
