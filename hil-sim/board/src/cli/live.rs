//! `rig live --target board`.

use hil_sim::cli::failure::{Failure, Outcome};
use hil_sim::cli::live::{Args, watch};

use crate::capture::Emulated;

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let scenario = args.source.scenario()?;
    let (elf, strings) = super::image(&scenario)?;
    let source = Emulated::new(&elf, &strings, &scenario, !args.headless);
    watch(args, &mut source.map_err(Failure::run)?)
}
