//! `rig-board cycles`: calls of the measuring image's functions, for the benchmark.

use std::path::PathBuf;

use hil_sim::cli::failure::{Failure, Outcome};
use hil_sim::cli::output;
use hil_sim::firmware::{FirmwareError, Profile, build_binary};

use crate::cycles::{self, Step};
use crate::image::Image;

/// Textbook cycles of the measuring image's functions.
///
/// With a script, the results of its steps; without one, the control tick over a deployment
/// and a retraction of the prototype.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Steps to carry out, a JSON array: see `rig_board::cycles::Step`.
    #[arg(long, value_name = "FILE")]
    script: Option<PathBuf>,

    /// Prints one JSON object, as is the default.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let (package, binary) = cycles::IMAGE;
    let path = build_binary(package, binary, Profile::Release, &[])?;
    let mut image = Image::open(&path).map_err(Failure::run)?;
    let none = String::new;
    match &args.script {
        Some(path) => {
            let read = std::fs::read(path);
            let read = read.map_err(|source| FirmwareError::Read { path: path.clone(), source })?;
            let steps: Vec<Step> = serde_json::from_slice(&read).map_err(Failure::input)?;
            let done = cycles::run(&mut image, &steps).map_err(Failure::run)?;
            output::result(true, &done, none)?;
        }
        None => {
            let tick = cycles::tick(&mut image, &hil_sim::scenario::Scenario::default());
            output::result(true, &tick.map_err(Failure::run)?, none)?;
        }
    }
    Ok(Outcome::Good)
}
