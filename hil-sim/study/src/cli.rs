//! The verbs of `rig` that show the study.

mod bench;
mod constants;
mod modes;
mod paper;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Parser, Subcommand};
use hil_sim::cli::failure::{Failure, Outcome};

/// The verbs of `rig` on the study; `rig` starts this where one needs it.
#[derive(Debug, Parser)]
#[command(name = "rig-study", bin_name = "cargo rig", version, disable_help_subcommand = true)]
struct Cli {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Debug, Subcommand)]
enum Verb {
    Bench(bench::Args),
    Modes(modes::Args),
    Paper(paper::Args),
    #[command(hide = true)]
    Constants(constants::Args),
}

impl Verb {
    fn run(&self) -> Result<Outcome, Failure> {
        match self {
            Self::Bench(args) => bench::run(args),
            Self::Modes(args) => modes::run(args),
            Self::Paper(args) => paper::run(args),
            Self::Constants(args) => constants::run(args),
        }
    }
}

/// Runs the command with the arguments of this process.
pub fn main() -> ExitCode {
    hil_sim::cli::run(|cli: &Cli| cli.verb.run())
}

/// An error of the study, with its causes in one line.
fn failed(error: anyhow::Error) -> Failure {
    Failure::run(format!("{error:#}"))
}

/// The repository's root.
fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// The folder of the documentation.
fn docs() -> PathBuf {
    root().join("docs")
}

/// Writes texts to files of a folder, which is made; returns their paths.
fn write(
    folder: &Path,
    files: impl IntoIterator<Item = (impl AsRef<Path>, String)>,
) -> Result<Vec<PathBuf>, Failure> {
    let put = |(name, text): (_, String)| {
        let path = folder.join(name);
        let made = path.parent().map_or(Ok(()), std::fs::create_dir_all);
        let done = made.and_then(|()| std::fs::write(&path, text));
        done.map_err(|error| Failure::input(format!("{}: {error}", path.display())))?;
        Ok(path)
    };
    files.into_iter().map(put).collect()
}
