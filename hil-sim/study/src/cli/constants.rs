//! `rig-study constants`: the reduced model's constants and the image's parameter set.

use interstage::params::compile;
use interstage::rig::Rig;

use super::{failed, root, write};
use crate::constants::{data, plan, source, stored};
use hil_sim::cli::failure::{Failure, Outcome};
use hil_sim::progress;

/// Fits the reduced model to the stored crossings and writes `src/model/constants.rs`.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Runs all crossings again first, which takes some minutes.
    #[arg(long)]
    sweep: bool,

    /// Writes `src/params/prototype.set` instead, with the constants in this program.
    #[arg(long, conflicts_with = "sweep")]
    set: bool,
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    if args.set {
        let set = compile("prototype", &Rig::prototype()).map_err(Failure::run)?;
        let path = root().join("src/params/prototype.set");
        std::fs::write(path, set).map_err(Failure::run)?;
        return Ok(Outcome::Good);
    }
    if args.sweep {
        let bar = progress::bar("crossings", plan().len() as u64);
        let rows = data::run_all(&plan(), &|| bar.advance(1)).map_err(failed)?;
        std::fs::write(data::path(), data::write(&rows)).map_err(Failure::run)?;
    }
    let text = source(&stored().map_err(failed)?).map_err(failed)?;
    write(&root(), [("src/model/constants.rs", text)])?;
    Ok(Outcome::Good)
}
