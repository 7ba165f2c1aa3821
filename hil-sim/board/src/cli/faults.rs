//! `rig faults --target board`.

use hil_sim::cli::failure::{Failure, Outcome};
use hil_sim::cli::faults::{Args, ended};
use hil_sim::progress;

use crate::campaign::{self, Firmware};

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let campaign = args.campaign()?;
    let (elf, strings) = super::image(&campaign.scenario)?;
    let firmware = Firmware { elf: &elf, strings: &strings };
    let outcome = {
        let bar = progress::bar("runs", campaign.runs());
        campaign::run(&campaign, firmware, &|| bar.advance(1)).map_err(Failure::run)?
    };
    ended(args, &outcome)
}
