//! What `rig` is built with only where it is asked for: the emulated board, with the
//! tools that its core needs, and probe-rs.
//!
//! The core is C behind generated bindings, so that cmake, ninja and libclang are
//! needed. They come as wheels from PyPI into a virtual environment in the target
//! directory; nothing is installed elsewhere, and nothing but the builds started here
//! sees them. Whoever never asks for the emulated board needs none of it.

mod tools;

use std::env;
use std::path::PathBuf;
use std::process::{Command, Stdio};

use crate::firmware;

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
    /// What cargo builds of which package.
    const fn package(self) -> &'static [&'static str] {
        match self {
            Self::Board => &["--package", "rig-board", "--bin", "rig-board"],
            Self::Study => &["--package", "rig-study", "--bin", "rig-study"],
            Self::Probe => {
                &["--package", "hil-sim", "--bin", "rig-probe", "--features", "hil-sim/probe"]
            }
        }
    }

    /// The binary.
    const fn binary(self) -> &'static str {
        match self {
            Self::Board => "rig-board",
            Self::Study => "rig-study",
            Self::Probe => "rig-probe",
        }
    }

    /// In words.
    const fn name(self) -> &'static str {
        match self {
            Self::Board => "the emulated board",
            Self::Study => "the study",
            Self::Probe => "probe-rs",
        }
    }
}

/// Why it cannot be had. Each is one line.
#[derive(Debug, thiserror::Error)]
pub enum ProvisionError {
    /// A program that has to be there is not.
    #[error("this needs {program}, which could not be started: {source}")]
    Program {
        /// The program.
        program: String,
        /// Why.
        source: std::io::Error,
    },
    /// The tools could not be fetched.
    #[error(
        "could not set up cmake, ninja and libclang for the emulated board in {place}: {why} \
         (it takes Python 3 with venv or pip, and PyPI within reach)"
    )]
    Tools {
        /// Where they were to go.
        place: PathBuf,
        /// The last that was said.
        why: String,
    },
    /// The compiler does not tell where its headers are.
    #[error("the C compiler `{0}` does not tell where its headers are")]
    Headers(String),
    /// A file could not be written.
    #[error("{path}: {source}")]
    File {
        /// The file or directory.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The build failed; cargo's own messages have gone to standard error.
    #[error("building `rig` with {0} failed ({1})")]
    Build(&'static str, std::process::ExitStatus),
    /// cargo built something, but not that binary.
    #[error("cargo reported no executable for {0}")]
    NoExecutable(&'static str),
}

/// Builds `rig` with this in it, setting up what it needs, and returns the binary. A
/// second call finds everything there. cargo's messages go to standard error.
///
/// # Errors
/// [`ProvisionError`] if tools cannot be had or the build fails.
pub fn featured(extra: Extra) -> Result<PathBuf, ProvisionError> {
    let mut cargo = Command::new(firmware::tool("CARGO", "cargo"));
    cargo
        .current_dir(firmware::workspace())
        .arg("build")
        .args(extra.package())
        .args(["--message-format", "json-render-diagnostics"])
        .stderr(Stdio::inherit());
    if extra == Extra::Board {
        Tools::ready()?.apply(&mut cargo);
    }
    let built = cargo.output().map_err(|source| started("cargo", source))?;
    if !built.status.success() {
        return Err(ProvisionError::Build(extra.name(), built.status));
    }
    firmware::executable(&String::from_utf8_lossy(&built.stdout), extra.binary())
        .ok_or(ProvisionError::NoExecutable(extra.binary()))
}

/// Goes on with the arguments of this process in that part of `rig`, which is built first
/// if need be, and returns its exit code. Standard output is its own.
///
/// # Errors
/// As [`featured`].
pub fn go_on(extra: Extra) -> Result<u8, ProvisionError> {
    let name = extra.name();
    eprintln!("this needs {name}; the first time it takes some minutes to build");
    let binary = featured(extra)?;
    let mut command = Command::new(&binary);
    command.args(env::args_os().skip(1));
    let program = || binary.display().to_string();
    let status = command.status().map_err(|source| started(&program(), source))?;
    Ok(status.code().and_then(|code| u8::try_from(code).ok()).unwrap_or(1))
}

fn started(program: &str, source: std::io::Error) -> ProvisionError {
    ProvisionError::Program { program: program.to_owned(), source }
}
