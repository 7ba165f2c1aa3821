//! `rig-study constants --set`: the image's parameter set.

use interstage::params::compile;
use interstage::rig::Rig;

use super::root;
use hil_sim::cli::failure::{Failure, Outcome};

/// Writes `src/params/prototype.set`.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Writes it with the constants in this program.
    #[arg(long)]
    set: bool,
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    if !args.set {
        return Err(Failure::input("constants: expected --set"));
    }
    let set = compile("prototype", &Rig::prototype()).map_err(Failure::run)?;
    std::fs::write(root().join("src/params/prototype.set"), set).map_err(Failure::run)?;
    Ok(Outcome::Good)
}
