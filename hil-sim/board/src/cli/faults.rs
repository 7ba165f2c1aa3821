//! `rig faults --target board`.

use hil_sim::cli::failure::{Failure, Outcome};
use hil_sim::cli::faults::Args;

pub fn run(args: &Args, campaign: &Campaign) -> Result<Outcome, Failure> {
    use crate::log::Strings;
    use hil_sim::faults::campaign::Firmware;
    use hil_sim::firmware::{self, Profile};

    crate::run::check(&campaign.scenario).map_err(Failure::input)?;
    let elf = firmware::image(Profile::Release)?;
    let strings = Strings::of(&elf).map_err(Failure::run)?;
    let firmware = Firmware { elf: &elf, strings: &strings };
    let mut kept = kept(args, campaign, &elf)?;
    let outcome = {
        let bar = progress::bar("runs", campaign.runs());
        campaign.run_on_board(firmware, &mut kept, &|| bar.advance(1)).map_err(Failure::run)?
    };
    ended(args, &outcome, docs::fill_board)
}
