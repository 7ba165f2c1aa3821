//! `rig completions`: verbs and options for the shell.

use clap::CommandFactory;
use clap_complete::Shell;

use super::failure::{Failure, Outcome};
use super::{Cli, output};

/// Writes what a shell needs to complete verbs and options of `rig`.
///
/// For example `rig completions bash > ~/.local/share/bash-completion/completions/rig`.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The shell.
    #[arg(value_name = "SHELL", value_enum)]
    shell: Shell,
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let mut text = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "rig", &mut text);
    output::print(&String::from_utf8_lossy(&text))?;
    Ok(Outcome::Good)
}
