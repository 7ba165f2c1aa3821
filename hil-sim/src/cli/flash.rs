//! `rig flash`: the firmware onto a board.

use std::process::Command;

use super::failure::{Failure, Outcome};
use crate::firmware::{self, Profile};

/// The chip, by the name that probe-rs has for it.
const CHIP: &str = "STM32G474RETx";

/// Builds the firmware, flashes it by the probe, reads it back, and shows its log.
///
/// Needs probe-rs (`cargo install probe-rs-tools`). Parameters stored on the board stay.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Further arguments of `probe-rs run`, such as `--probe VID:PID:SERIAL`.
    #[arg(last = true, value_name = "ARGUMENT")]
    more: Vec<String>,
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let elf = firmware::build(Profile::Release)?;
    let program = std::env::var_os("PROBE_RS").unwrap_or_else(|| "probe-rs".into());
    let mut command = Command::new(&program);
    command.args(["run", "--chip", CHIP, "--verify"]).args(&args.more).arg(elf);
    let status = command.status().map_err(|error| {
        let program = program.display();
        Failure::input(format!("{program}: {error}; `cargo install probe-rs-tools` gets it"))
    })?;
    Ok(Outcome::Code(status.code().and_then(|code| u8::try_from(code).ok()).unwrap_or(1)))
}
