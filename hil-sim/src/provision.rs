//! Parts of `rig` that are built only where they are asked for: the emulated board with
//! the tools that its core needs, the study, and probe-rs.
//!
//! The core is C behind generated bindings: it needs cmake, ninja and libclang. They come
//! as wheels from PyPI into a virtual environment in the target directory. Nothing is
//! installed elsewhere, and only the builds started here see them.

mod tools;

use std::env;
use std::path::PathBuf;
use std::process::Command;

use crate::firmware::{self, FirmwareError};

pub use tools::Tools;

/// A part of `rig` that is a binary of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extra {
    /// The emulated board.
    Board,
    /// The published study, and run time against error.
    Study,
    /// A real debug probe.
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

/// Why it cannot be had. Each is one line.
#[derive(Debug, thiserror::Error)]
pub enum ProvisionError {
    /// A program could not be started or a build failed.
    #[error(transparent)]
    Build(#[from] FirmwareError),
    /// The tools could not be fetched.
    #[error(
        "could not set up cmake, ninja and libclang for the emulated board in {place}: {why} \
         (it takes Python 3 with venv or pip, PyPI within reach, and a C compiler)"
    )]
    Tools {
        /// Where they were to go.
        place: PathBuf,
        /// The last that was said.
        why: String,
    },
}

/// Builds this part of `rig`, setting up what it needs, and returns the binary. A second
/// call finds everything there. cargo's messages go to standard error.
///
/// # Errors
/// [`ProvisionError`] if tools cannot be had or the build fails.
pub fn featured(extra: Extra) -> Result<PathBuf, ProvisionError> {
    let (_, binary, arguments) = extra.build();
    let mut cargo = firmware::build_command(arguments);
    cargo.args(["--bin", binary]);
    if extra == Extra::Board {
        Tools::ready()?.apply(&mut cargo);
    }
    Ok(firmware::executable(&mut cargo, binary)?)
}

/// Goes on with the arguments of this process in that part of `rig`, which is built first
/// if need be, and returns its exit code. Standard output is its own.
///
/// # Errors
/// As [`featured`].
pub fn go_on(extra: Extra) -> Result<u8, ProvisionError> {
    eprintln!("this needs {}; the first time it takes some minutes to build", extra.build().0);
    let mut command = Command::new(featured(extra)?);
    command.args(env::args_os().skip(1));
    let status = command.status().map_err(|e| firmware::could_not_start(&command, e))?;
    Ok(status.code().and_then(|code| u8::try_from(code).ok()).unwrap_or(1))
}
