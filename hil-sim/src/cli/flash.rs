//! `rig flash`: the firmware onto a board.

use std::process::Command;

use super::failure::{Failure, Outcome};
use crate::firmware::{self, Profile};

/// The chip, by the name that probe-rs has for it.
const CHIP: &str = "STM32G474RETx";

/// Least version of probe-rs: the first with [`PLAIN`].
const LEAST: (u32, u32) = (0, 32);

/// Shows the text log alone, channel 0, and never makes the board wait for it. Left to itself,
/// probe-rs sets every channel to block and halts the core at a reset or hard fault, which the
/// firmware handles and records.
const PLAIN: [&str; 6] = [
    "--no-catch-reset",
    "--no-catch-hardfault",
    "--rtt-up-channels",
    "0",
    "--rtt-channel-mode",
    "no-block-skip",
];

/// Builds the firmware, or takes the one beside it in a release, flashes it by the probe, reads
/// it back, and shows its log.
///
/// Needs probe-rs 0.32 or later (`cargo install probe-rs-tools`). Parameters stored on the board
/// stay.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Further arguments of `probe-rs run`, such as `--probe VID:PID:SERIAL`.
    #[arg(last = true, value_name = "ARGUMENT")]
    more: Vec<String>,
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let program = std::env::var_os("PROBE_RS").unwrap_or_else(|| "probe-rs".into());
    let shown = program.display();
    let missing =
        |error| Failure::input(format!("{shown}: {error}; `cargo install probe-rs-tools` gets it"));
    let output = Command::new(&program).arg("--version").output().map_err(missing)?;
    let text = String::from_utf8_lossy(&output.stdout);
    if version(&text).is_none_or(|found| found < LEAST) {
        let (major, minor) = LEAST;
        let found = text.lines().next().unwrap_or_default();
        return Err(Failure::input(format!(
            "{shown}: `{found}` is not probe-rs {major}.{minor} or later; `cargo install \
             probe-rs-tools` gets it"
        )));
    }
    // Reported before minutes of building.
    let list = Command::new(&program).arg("list").output().map_err(missing)?;
    if String::from_utf8_lossy(&list.stdout).contains("No debug probes were found") {
        return Err(Failure::input(
            "no debug probe is attached: connect the board's ST-LINK by USB",
        ));
    }
    let elf = match firmware::released("interstage") {
        Some(elf) => elf,
        None => firmware::build(Profile::Release)?,
    };
    let mut command = Command::new(&program);
    command.args(["run", "--chip", CHIP, "--verify"]).args(PLAIN).args(&args.more).arg(elf);
    let status = command.status().map_err(missing)?;
    Ok(Outcome::Code(status.code().and_then(|code| u8::try_from(code).ok()).unwrap_or(1)))
}

/// Major and minor version in what `probe-rs --version` prints.
fn version(text: &str) -> Option<(u32, u32)> {
    let mut numbers = text.strip_prefix("probe-rs ")?.split(['.', ' ', '\n']);
    let mut next = || numbers.next()?.parse().ok();
    Some((next()?, next()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_version_is_read_or_is_none() {
        assert_eq!(version("probe-rs 0.32.0 (git commit: crates.io)\n"), Some((0, 32)));
        assert_eq!(version("probe-rs 1.0.0\n"), Some((1, 0)));
        for text in ["", "probe-run 0.32.0", "probe-rs", "probe-rs x.y"] {
            assert_eq!(version(text), None, "{text}");
        }
        assert!(version("probe-rs 0.31.0") < Some(LEAST));
    }

    /// cargo's runner is started the same way.
    #[test]
    fn the_runner_has_the_same_arguments() {
        let settings = include_str!("../../../.cargo/config.toml");
        let runner = format!("\"probe-rs run --chip {CHIP} --verify {}\"", PLAIN.join(" "));
        assert!(settings.contains(&runner), "{runner}");
    }
}
