//! Builds the optional parts of `rig` on demand: the emulated board with the tools that its
//! core needs, the study, and probe-rs.
//!
//! The core is C with generated bindings: it needs cmake, ninja and libclang. They are
//! wheels from PyPI in a virtual environment in the target directory. Nothing is installed
//! elsewhere, and only builds started here use them.

mod tools;

use std::env;
use std::path::PathBuf;
use std::process::{Command, ExitCode};

use crate::firmware::{self, FirmwareError};

pub use tools::{Tools, fetched};

/// A part of `rig` that is a binary of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extra {
    /// The emulated board.
    Board,
    /// The published study, and run time against error.
    Study,
    Probe,
}

impl Extra {
    /// In words, its binary, and what cargo builds.
    const fn build(self) -> (&'static str, &'static str, &'static [&'static str]) {
        match self {
            Self::Board => ("the emulated board", "rig-board", &["--package", "rig-board"]),
            Self::Study => ("the study", "rig-study", &["--package", "rig-study"]),
            Self::Probe => {
                let arguments = &["--package", "hil-sim", "--features", "hil-sim/probe"];
                ("probe-rs", "rig-probe", arguments)
            }
        }
    }
}

/// Why a part is not available. Displays as one line.
#[derive(Debug, thiserror::Error)]
pub enum ProvisionError {
    #[error(transparent)]
    Build(#[from] FirmwareError),
    #[error(
        "could not set up cmake, ninja and libclang for the emulated board in {0}: {1} \
         (it takes Python 3 with venv or pip, PyPI within reach, and a C compiler)"
    )]
    Tools(PathBuf, String),
}

/// Builds this part of `rig` with the tools it needs and returns the binary. A second call
/// builds nothing and says nothing, nor does a release that has it. Progress and cargo's messages go to standard error.
pub fn featured(extra: Extra) -> Result<PathBuf, ProvisionError> {
    let (what, binary, arguments) = extra.build();
    if let Some(program) = firmware::released(binary) {
        return Ok(program);
    }
    let mut cargo = firmware::build_command(arguments);
    cargo.args(["--bin", binary]);
    if extra == Extra::Board {
        Tools::ready()?.apply(&mut cargo);
    }
    Ok(firmware::executable(&mut cargo, what, binary)?)
}

/// Runs that part of `rig`, built first if need be, with the arguments of this process, and
/// returns its exit code. Standard output is its own.
pub(crate) fn go_on(extra: Extra) -> Result<u8, ProvisionError> {
    let mut command = Command::new(featured(extra)?);
    command.args(env::args_os().skip(1));
    let status = command.status().map_err(|e| firmware::could_not_start(&command, e))?;
    Ok(firmware::exit_code(status))
}

/// Shows the options of a verb of that part, which is not built for it.
pub(crate) fn help(extra: Extra, verb: &str) -> ExitCode {
    let (what, binary, _) = extra.build();
    let program = env::current_exe().unwrap_or_default().with_file_name(binary);
    match Command::new(program.with_extension(env::consts::EXE_EXTENSION))
        .args([verb, "--help"])
        .status()
    {
        Ok(status) => ExitCode::from(firmware::exit_code(status)),
        Err(_) => {
            println!(
                "Usage: cargo rig {verb} [ARGS]\n\nThe first `cargo rig {verb}` builds {what}; \
                 then --help lists its options."
            );
            ExitCode::SUCCESS
        }
    }
}
