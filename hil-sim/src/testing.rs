//! `rig test`: checks every change in a few passes of cargo.
//!
//! Format, lints, documentation, the images that the tests run, the tests. All but what is
//! for the board use the profile that `rig` itself is built in, so nothing is compiled twice.

use std::env;
use std::process::{Command, ExitStatus, Stdio};
use std::time::Instant;

use anyhow::{Context, Result, ensure};

use crate::firmware::{self, Profile, TARGET, exit_code};
use crate::provision::Tools;

/// Set while the long samples are wanted.
const LONG: &str = "RIG_LONG";

/// Whether tests run their long samples: as `rig test --long` asks them to.
pub fn long() -> bool {
    env::var_os(LONG).is_some()
}

/// Runs every pass and then `cargo test` with `arguments`; returns the exit code of the
/// first that failed, or 0. Headings, times and cargo's messages go to standard error;
/// the last lines of standard output are those of the tests.
pub(crate) fn run(arguments: &[String], long: bool) -> Result<u8> {
    let manifest = firmware::workspace().join("Cargo.toml");
    ensure!(manifest.is_file(), "{}: the workspace is no longer there", manifest.display());
    let mut times = String::new();
    let mut timed = |name: &str, pass: &mut dyn FnMut() -> Result<u8>| -> Result<u8> {
        eprintln!("\n== {name}");
        let started = Instant::now();
        let code = pass()?;
        let seconds = started.elapsed().as_secs_f64();
        eprintln!("{name}: {seconds:.1} s, {}", if code == 0 { "passed" } else { "failed" });
        times += &format!("{name:<32}{seconds:>7.1} s\n");
        Ok(code)
    };
    let mut tools = None;
    timed("Toolchain and build tools", &mut || {
        firmware::ensure_target()?;
        tools = Some(Tools::ready()?);
        Ok(0)
    })?;
    let tools = tools.context("no tools")?;
    for (name, component, mut command) in passes(long) {
        if !has(component) {
            eprintln!("\n== {name}: left out, cargo has no `{component}`");
            continue;
        }
        tools.apply(&mut command);
        let code = timed(name, &mut || Ok(exit_code(started(&mut command)?)))?;
        if code != 0 {
            return Ok(code);
        }
    }
    timed("Images", &mut || {
        firmware::build(Profile::Release)?;
        firmware::build(Profile::Loop)?;
        Ok(0)
    })?;
    eprintln!("\n== Tests\n{times}");
    let mut tests = cargo(&["test", "--workspace"]);
    // Without the long samples the property tests draw the same numbers each time.
    tests.args(arguments).env(if long { LONG } else { "PROPTEST_RNG_SEED" }, "1");
    tools.apply(&mut tests);
    Ok(exit_code(started(&mut tests)?))
}

/// The passes before the images, each with the component of cargo that it needs.
fn passes(long: bool) -> Vec<(&'static str, &'static str, Command)> {
    let lint = |arguments: &[&str]| {
        let mut clippy = cargo(&["clippy"]);
        clippy.args(arguments).args(["--", "-D", "warnings"]);
        clippy
    };
    // As the images are built, which so find their build scripts and macros.
    let board = ["--release", "--target", TARGET, "--package", "interstage"];
    let images = [&board[..], &["--package", "interstage-images", "--lib", "--bins"]].concat();
    let hil = ["--bin", "interstage", "--no-default-features", "--features", "hil"];
    let looped = [&board[..], &hil].concat();
    // `--examples` gives the dependencies the features that they have in the tests.
    let mut documentation = cargo(&["doc", "--workspace", "--no-deps", "--lib", "--examples"]);
    documentation.env("RUSTDOCFLAGS", "-D warnings");
    let mut passes = vec![
        ("Format", "fmt", cargo(&["fmt", "--all", "--check"])),
        ("Lints", "clippy", lint(&["--workspace", "--all-targets"])),
        ("Lints of the images", "clippy", lint(&images)),
        ("Lints of the loop's image", "clippy", lint(&looped)),
        ("Documentation", "doc", documentation),
    ];
    if long {
        let probe = ["--package", "hil-sim", "--features", "probe", "--bins", "--lib"];
        passes.push(("Lints with a probe", "clippy", lint(&probe)));
    }
    passes
}

/// cargo as it runs this tool, in the workspace.
fn cargo(arguments: &[&str]) -> Command {
    let mut command = Command::new(firmware::tool("CARGO", "cargo"));
    command.current_dir(firmware::workspace()).args(arguments);
    command
}

fn started(command: &mut Command) -> Result<ExitStatus> {
    command.status().with_context(|| format!("could not start {:?}", command.get_program()))
}

/// Whether cargo has this component.
fn has(component: &str) -> bool {
    let mut command = cargo(&[component, "-h"]);
    command.stdout(Stdio::null()).stderr(Stdio::null());
    command.status().is_ok_and(|status| status.success())
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn a_failure_is_never_zero_and_a_missing_component_is_noticed() {
        let status = |text| Command::new("sh").args(["-c", text]).status().unwrap();
        assert_eq!(exit_code(status("exit 101")), 101);
        assert_eq!(exit_code(status("kill -9 $$")), 1);
        assert!(!has("no-such-component"));
    }
}
