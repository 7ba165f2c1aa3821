//! `rig capture --target board`.

use hil_sim::cli::capture::{Args, write};
use hil_sim::cli::failure::{Failure, Outcome};

use crate::capture::Emulated;

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let scenario = args.source.scenario()?;
    let (elf, strings) = super::image(&scenario)?;
    let mut source = Emulated::new(&elf, &strings, &scenario, false).map_err(Failure::run)?;
    write(args, &mut source, Some(&scenario))
}
