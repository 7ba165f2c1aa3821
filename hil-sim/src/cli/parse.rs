//! Messages of the argument parser, in the form of every other error.

use std::process::ExitCode;

use clap::error::ErrorKind;

use super::failure::one_line;
use super::output::complain;
use crate::bringup::FARTHEST_MM;

/// Prints help, the version, or the error; the exit code to end with.
pub(super) fn report(error: &clap::Error) -> ExitCode {
    match error.kind() {
        ErrorKind::DisplayHelp
        | ErrorKind::DisplayVersion
        | ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => {
            // A reader that closes the pipe early is no error.
            let _ = error.print();
        }
        _ => complain(&line(&error.to_string())),
    }
    ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(2))
}

/// Reads a duration, s.
pub(super) fn seconds(text: &str) -> Result<f64, &'static str> {
    let read = text.parse().ok().filter(|s: &f64| s.is_finite() && *s > 0.0);
    read.ok_or("expected seconds, a number above 0")
}

/// Reads the distance of a jog, mm.
pub(super) fn distance(text: &str) -> Result<f64, String> {
    let read = text.parse().ok().filter(|mm: &f64| mm.abs() <= FARTHEST_MM && *mm != 0.0);
    read.ok_or_else(|| format!("expected millimetres, at most {FARTHEST_MM} either way, not 0"))
}

/// The error as one line, without usage and without the pointer to the help.
pub(super) fn line(text: &str) -> String {
    let said = text.split("\n\n").filter(|paragraph| {
        !paragraph.starts_with("Usage:") && !paragraph.starts_with("For more information")
    });
    one_line(&said.collect::<Vec<_>>().join("\n"))
}
