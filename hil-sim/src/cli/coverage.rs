//! `rig coverage`: what of the controller the tests beside it never visit.

use std::process::{Command, Stdio};

use super::failure::{Failure, Outcome};
use super::output;
use crate::coverage::{self, Coverage};
use crate::firmware;

/// Runs the library's own tests with LLVM's account of what they visit, and lists the
/// functions that none does.
///
/// Needs `cargo install cargo-llvm-cov --locked` and `rustup component add llvm-tools`.
/// The exit code is 1 if a function is not visited, or a test fails.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Prints what was found as one JSON object.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let cargo = || Command::new(firmware::tool("CARGO", "cargo"));
    let there = cargo().args(["llvm-cov", "--version"]).output().map_err(Failure::run)?;
    if !there.status.success() {
        return Err(Failure::input(
            "cargo llvm-cov is not installed, expected `cargo install cargo-llvm-cov --locked`",
        ));
    }
    let export = firmware::target_directory().join("coverage.json");
    let status = cargo()
        .current_dir(firmware::workspace())
        .args(["llvm-cov", "--package", "interstage", "--lib", "--tests", "--json"])
        .arg("--output-path")
        .arg(&export)
        // Standard output is the result's.
        .stdout(Stdio::null())
        .status()
        .map_err(Failure::run)?;
    if !status.success() {
        return Err(Failure::run(format!("cargo llvm-cov failed ({status})")));
    }
    let text = std::fs::read_to_string(&export).map_err(Failure::run)?;
    let found = coverage::read(&text, firmware::workspace()).map_err(Failure::run)?;
    output::result(args.json, &found, || human(&found))?;
    Ok(Outcome::of(found.unvisited.is_empty()))
}

fn human(found: &Coverage) -> String {
    let Coverage { functions, unvisited, lines_percent, regions_percent } = found;
    let mut text = format!(
        "{functions} functions and closures in the library, {} not visited; {lines_percent:.1} % of \
         the lines, {regions_percent:.1} % of the regions\n",
        unvisited.len()
    );
    for place in unvisited {
        text += &format!("  {}:{}\n", place.file.display(), place.line);
    }
    text
}
