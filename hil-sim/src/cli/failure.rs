//! Result of a verb.

use std::convert::Infallible;
use std::fmt;
use std::process::ExitCode;

use interstage::rig::RigError;

use crate::files::FileError;
use crate::firmware::FirmwareError;
use crate::plant::balance::BalanceError;
use crate::provision::{Extra, ProvisionError};
use crate::scenario::ScenarioError;
use crate::session::RunError;

/// Result of a verb that did its work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// Success.
    Good,
    /// The run, log or check failed: a fault, missing data, a difference.
    Bad,
    /// Exit code of a program that was started.
    Code(u8),
}

impl Outcome {
    /// Good or bad.
    pub fn of(good: bool) -> Self {
        if good { Self::Good } else { Self::Bad }
    }

    pub(crate) fn code(self) -> ExitCode {
        match self {
            Self::Good => ExitCode::SUCCESS,
            Self::Bad => ExitCode::from(1),
            Self::Code(code) => ExitCode::from(code),
        }
    }
}

/// Why a verb could not do its work. Displays as one line.
#[derive(Debug)]
pub enum Failure {
    /// Bad input: exit code 2.
    Input(String),
    /// It failed while running: exit code 1.
    Run(String),
    /// This part of `rig` does it, with the same arguments: [`super::run`] goes on there.
    Elsewhere(Extra),
}

impl Failure {
    /// A failure of the input.
    pub fn input(error: impl fmt::Display) -> Self {
        Self::Input(error.to_string())
    }

    /// A failure while running.
    pub fn run(error: impl fmt::Display) -> Self {
        Self::Run(error.to_string())
    }

    /// Another part of `rig` runs on this target.
    pub(super) fn of_target(target: &str) -> Self {
        Self::Elsewhere(if target == "board" { Extra::Board } else { Extra::Probe })
    }

    pub(crate) fn code(&self) -> ExitCode {
        match self {
            Self::Input(_) => ExitCode::from(2),
            Self::Run(_) | Self::Elsewhere(_) => ExitCode::from(1),
        }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Input(text) | Self::Run(text) => f.write_str(&one_line(text)),
            Self::Elsewhere(part) => write!(f, "{part:?} does it"),
        }
    }
}

/// `text` as one line: its lines trimmed and joined by blanks.
pub(crate) fn one_line(text: &str) -> String {
    let lines = text.lines().map(str::trim).filter(|line| !line.is_empty());
    lines.collect::<Vec<_>>().join(" ")
}

/// Errors that are a failure of this kind.
macro_rules! failures {
    ($kind:ident: $($error:ty),*) => {$(
        impl From<$error> for Failure {
            fn from(error: $error) -> Self {
                Self::$kind(error.to_string())
            }
        }
    )*};
}
failures!(Input: ScenarioError, RigError, FileError);
failures!(Run: BalanceError, FirmwareError, ProvisionError, Infallible);

impl From<RunError> for Failure {
    fn from(error: RunError) -> Self {
        match error {
            RunError::Rig(_) | RunError::Refused(_) | RunError::Hardware(_) => Self::input(error),
            RunError::Plant(_) => Self::run(error),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rig_that_cannot_be_built_is_bad_input_and_a_plant_that_fails_is_not() {
        let rig = RigError::OutOfReach { radius_mm: 1.0, min_mm: 2.0, max_mm: 2.1 };
        assert!(matches!(Failure::from(RunError::Rig(rig)), Failure::Input(_)));
        let balance = BalanceError { preload_n: 1.0, residual_n: 1.0, height_mm: 1.0 };
        assert!(matches!(Failure::from(balance), Failure::Run(_)));
    }
}
