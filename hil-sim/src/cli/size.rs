//! `rig size`: what the firmware takes of flash and RAM.

use std::path::PathBuf;

use serde::Serialize;

use super::failure::{Failure, Outcome};
use super::output;
use crate::firmware::{Budget, Footprint, Profile, build};
use crate::testing;

/// Builds the firmware and shows what it takes of flash and RAM.
///
/// The exit code is 1 if that is more than budgeted (of the debug image: more than
/// the chip has) or the stack does not stand below the statics.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The debug image, with overflow checks.
    #[arg(long)]
    debug: bool,

    /// Prints the sizes as one JSON object.
    #[arg(long)]
    json: bool,
}

/// What `--json` prints; sizes in bytes.
#[derive(Serialize)]
struct Printed<'a> {
    elf: PathBuf,
    flash: u64,
    ram: u64,
    stack: u64,
    budget: Budget,
    within_budget: bool,
    #[serde(flatten)]
    footprint: &'a Footprint,
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let profile = if args.debug { Profile::Debug } else { Profile::Release };
    let elf = build(profile)?;
    let footprint = Footprint::of_file(&elf)?;
    let budget = testing::budget(profile);
    let verdict = footprint.check(&budget);
    let printed = Printed {
        elf,
        flash: footprint.flash(),
        ram: footprint.ram(),
        stack: footprint.stack(),
        budget,
        within_budget: verdict.is_ok(),
        footprint: &footprint,
    };
    output::result(args.json, &printed, || {
        let name = printed.elf.display();
        format!("{footprint}{:<28}{:>10}{:>10}\n{name}\n", "budget", budget.flash, budget.ram)
    })?;
    verdict?;
    Ok(Outcome::Good)
}
