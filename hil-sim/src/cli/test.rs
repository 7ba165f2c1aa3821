//! `rig test`: everything that must pass.

use super::failure::{Failure, Outcome};
use crate::testing;

/// Sets up what is missing and runs every check and test.
///
/// In this order, up to the first that fails: format, lints, documentation, firmware
/// and its size, the whole test suite. Its result lines come last.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Arguments for `cargo test`, after `--`.
    #[arg(last = true, value_name = "ARGS")]
    rest: Vec<String>,
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    Ok(match testing::run(&args.rest).map_err(Failure::run)? {
        0 => Outcome::Good,
        code => Outcome::Code(code),
    })
}
