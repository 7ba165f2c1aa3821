//! `rig account`: what the control tick costs on the board's core.

mod table;

use hil_sim::cli::failure::{Failure, Outcome};
use hil_sim::cli::scenario::ScenarioArgs;

/// Textbook Cortex-M4 cycles of the control tick, by phase, on the emulated core.
///
/// A deployment and a retraction are run in software; their ticks are given to an
/// image built like the firmware, whose outputs must be the same to the bit.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    scenario: ScenarioArgs,

    /// Lists the most expensive functions of the busiest phase and of the smooth wall.
    #[arg(long)]
    profile_functions: bool,

    /// Optimises the library otherwise than the image: 2, 3 or s.
    #[arg(long, value_name = "LEVEL", value_parser = ["1", "2", "3", "s", "z"])]
    opt_level: Option<String>,

    /// Prints the account as one JSON object.
    #[arg(long)]
    json: bool,
}

/// Without the emulated board: go on with a binary that has it.
#[cfg(not(feature = "board"))]
pub(super) fn run(_: &Args) -> Result<Outcome, Failure> {
    Ok(Outcome::Code(hil_sim::provision::go_on()?))
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    use crate::account::{IMAGE, both_ways, preset};
    use crate::model::measure;
    use hil_sim::firmware::{Footprint, Profile, build_binary};

    let scenario = args.scenario.resolve()?;
    let preset = preset(&scenario).map_err(Failure::input)?;
    // A package's own level goes before the profile's.
    let level = args.opt_level.as_deref().map(|level| {
        let quoted =
            if level.parse::<u8>().is_ok() { level.to_owned() } else { format!("{level:?}") };
        format!("profile.release.package.interstage.opt-level={quoted}")
    });
    let (package, binary) = IMAGE;
    let elf = build_binary(package, binary, Profile::Release, &Vec::from_iter(level.clone()))?;
    let (account, mut image) = both_ways(&elf, &scenario).map_err(Failure::run)?;
    let model = measure(&mut image, preset).map_err(Failure::run)?;
    let firmware =
        build_binary("interstage", "interstage", Profile::Release, &Vec::from_iter(level))?;
    let bytes = std::fs::read(&firmware).map_err(Failure::run)?;
    let flash = Footprint::of_elf(&bytes)?.flash;
    table::show(args, &table::Found { account: &account, model: &model, image: &image, flash })
}
