//! `rig test`: everything that must pass.

use super::failure::{Failure, Outcome};
use crate::testing;

/// Sets up what is missing and runs every check and test.
///
/// In this order, up to the first that fails: format, lints, documentation, the firmware's
/// images, the test suite. Its result lines come last.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Runs the long samples too.
    #[arg(long)]
    long: bool,

    /// Arguments for `cargo test`, after `--`.
    #[arg(last = true, value_name = "ARGS")]
    rest: Vec<String>,
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let code =
        testing::run(&args.rest, args.long).map_err(|error| Failure::run(format!("{error:#}")))?;
    Ok(Outcome::Code(code))
}
