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

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;
    use crate::cli::Cli;

    fn said(arguments: &[&str]) -> String {
        let all = std::iter::once("rig").chain(arguments.iter().copied());
        line(&Cli::try_parse_from(all).unwrap_err().to_string())
    }

    #[test]
    fn an_error_is_one_line_that_names_the_option() {
        assert_eq!(
            said(&["crossing", "--speed-mm-s", "5"]),
            "error: the following required arguments were not provided: --preload-n <P>"
        );
        let text = said(&["deploy", "--seed", "x"]);
        assert!(text.starts_with("error: invalid value 'x' for '--seed <N>'"), "{text}");
        let text = said(&["deploy", "--rig", "moon"]);
        assert!(text.contains("'--rig <NAME>'") && text.contains("prototype"), "{text}");
        let text = said(&["deploy", "--sead", "1"]);
        assert!(text.contains("--sead") && text.contains("--seed"), "{text}");
        assert!(!text.contains('\n') && !text.contains("Usage"), "{text}");
    }
}
