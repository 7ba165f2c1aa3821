//! `rig live --target board`.

use hil_sim::cli::failure::{Failure, Outcome};
use hil_sim::cli::live::Args;

pub fn run(args: &Args, scenario: &Scenario) -> Result<Outcome, Failure> {
    use crate::capture::Emulated;
    use crate::log::Strings;
    use hil_sim::firmware::{self, Profile};

    crate::run::check(scenario).map_err(Failure::input)?;
    let elf = firmware::image(Profile::Release)?;
    let strings = Strings::of(&elf).map_err(Failure::run)?;
    let mut source =
        Emulated::new(&elf, &strings, scenario, !args.headless).map_err(Failure::run)?;
    watch(args, &mut source)
}
