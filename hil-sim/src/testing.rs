//! Everything that must pass, in one go: format, lints, documentation, firmware and
//! its size, tests. What is missing of the toolchain is set up or, where a machine
//! may do without, left out with a note.

mod warnings;

use std::env;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::time::Instant;

use anyhow::{Context, Result, ensure};

use crate::firmware::{self, Budget, Footprint, Profile, TARGET};
use crate::provision::Tools;

/// How a step ended.
enum Ended {
    Passed,
    /// Left out, and why.
    Skipped(&'static str),
    /// With this exit code.
    Failed(u8),
}

/// A step before the tests.
struct Step {
    name: &'static str,
    run: fn(&Path) -> Result<Ended>,
}

/// In order of time taken, so that the cheap ones fail first.
const STEPS: [Step; 11] = [
    Step { name: "Toolchain", run: toolchain },
    Step { name: "Format", run: format },
    Step { name: "Tools of the emulator", run: tools },
    Step { name: "Lints", run: lints },
    Step { name: "Lints without emulator", run: plain_lints },
    Step { name: "Lints with a probe", run: probe_lints },
    Step { name: "Lints of the firmware", run: firmware_lints },
    Step { name: "Lints of the loop", run: loop_lints },
    Step { name: "Documentation", run: documentation },
    Step { name: "Firmware, debug", run: |root| image(root, Profile::Debug) },
    Step { name: "Firmware, release", run: |root| image(root, Profile::Release) },
];

/// The emulated board in every step that can have it, so that its core, which takes
/// minutes, is built once for all of them.
const WITH_BOARD: [&str; 2] = ["--features", "hil-sim/board"];

/// What else a step looks at, so that cargo gives the dependencies those features that they
/// have in the tests, and what is built is built once for both.
const AS_IN_TESTS: [&str; 2] = ["--lib", "--examples"];

/// Runs every step and then `cargo test` with `arguments`, and returns the exit code
/// of the first that failed, or 0. Headings, times and cargo's messages go to
/// standard error; the last lines of standard output are those of the tests.
///
/// # Errors
/// If a program cannot be started or the workspace is not where it was.
pub fn run(arguments: &[String]) -> Result<u8> {
    let root = root()?;
    let mut summary = String::new();
    for step in &STEPS {
        heading(step.name);
        let started = Instant::now();
        let ended = (step.run)(&root)?;
        let seconds = started.elapsed().as_secs_f64();
        let note = match ended {
            Ended::Passed => String::new(),
            Ended::Skipped(why) => format!(" (left out: {why})"),
            Ended::Failed(code) => {
                eprintln!("{} failed after {seconds:.1} s", step.name);
                return Ok(code);
            }
        };
        eprintln!("{seconds:.1} s{note}");
        summary += &format!("{:<24}{seconds:>7.1} s{note}\n", step.name);
    }
    heading("Tests");
    // Here, because nothing may follow cargo's own lines.
    eprint!("{summary}");
    let mut tests = cargo(&root);
    tests.args(["test", "--workspace"]).args(WITH_BOARD).args(arguments);
    provided(&mut tests)?;
    let status = run_cargo(&mut tests)?;
    Ok(if status.success() { 0 } else { code(status) })
}

fn heading(name: &str) {
    eprintln!("\n== {name}");
}

/// The workspace that this tool was built from.
fn root() -> Result<PathBuf> {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    let root = package.parent().unwrap_or(package);
    let manifest = root.join("Cargo.toml");
    ensure!(manifest.is_file(), "{}: the workspace is no longer there", manifest.display());
    Ok(root.to_owned())
}

/// cargo as it runs this tool, in the workspace.
fn cargo(root: &Path) -> Command {
    let mut command = Command::new(env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.current_dir(root);
    command
}

fn run_cargo(command: &mut Command) -> Result<ExitStatus> {
    command
        .status()
        .with_context(|| format!("could not start `{}`", command.get_program().to_string_lossy()))
}

/// The step that is this one command.
fn step(command: &mut Command) -> Result<Ended> {
    let status = run_cargo(command)?;
    Ok(if status.success() { Ended::Passed } else { Ended::Failed(code(status)) })
}

/// A program's exit code; 1 if it was killed.
fn code(status: ExitStatus) -> u8 {
    status.code().and_then(|code| u8::try_from(code).ok()).filter(|&code| code != 0).unwrap_or(1)
}

/// Whether cargo has this component.
fn has(root: &Path, component: &str) -> bool {
    let mut command = cargo(root);
    command.args([component, "--version"]).stdout(Stdio::null()).stderr(Stdio::null());
    command.status().is_ok_and(|status| status.success())
}

fn toolchain(_root: &Path) -> Result<Ended> {
    firmware::ensure_target()?;
    Ok(Ended::Passed)
}

fn format(root: &Path) -> Result<Ended> {
    if !has(root, "fmt") {
        return Ok(Ended::Skipped("rustfmt is not installed"));
    }
    step(cargo(root).args(["fmt", "--all", "--check"]))
}

/// Fetches what the emulator is built with. Where that cannot be had, this fails: a suite that left the board out would say more than it has
/// seen.
fn tools(_root: &Path) -> Result<Ended> {
    match Tools::ready() {
        Ok(_) => Ok(Ended::Passed),
        Err(error) => {
            eprintln!("{}", error.to_string().replace('\n', " "));
            Ok(Ended::Failed(1))
        }
    }
}

/// Tells `command` where the emulator's tools are.
fn provided(command: &mut Command) -> Result<()> {
    Tools::ready()?.apply(command);
    Ok(())
}

fn lints(root: &Path) -> Result<Ended> {
    if !has(root, "clippy") {
        return Ok(Ended::Skipped("clippy is not installed"));
    }
    let mut clippy = cargo(root);
    clippy.args(["clippy", "--workspace", "--all-targets"]).args(WITH_BOARD);
    provided(&mut clippy)?;
    step(clippy.args(["--", "-D", "warnings"]))
}

/// The package as those have it who never ask for the emulated board.
fn plain_lints(root: &Path) -> Result<Ended> {
    if !has(root, "clippy") {
        return Ok(Ended::Skipped("clippy is not installed"));
    }
    let mut clippy = cargo(root);
    clippy.args(["clippy", "--package", "hil-sim", "--bins"]).args(AS_IN_TESTS);
    step(clippy.args(["--", "-D", "warnings"]))
}

/// The package as those have it who have a board at a probe.
fn probe_lints(root: &Path) -> Result<Ended> {
    if !has(root, "clippy") {
        return Ok(Ended::Skipped("clippy is not installed"));
    }
    let mut clippy = cargo(root);
    clippy.args(["clippy", "--package", "hil-sim", "--features", "probe", "--bins"]);
    step(clippy.args(AS_IN_TESTS).args(["--", "-D", "warnings"]))
}

fn firmware_lints(root: &Path) -> Result<Ended> {
    if !has(root, "clippy") {
        return Ok(Ended::Skipped("clippy is not installed"));
    }
    step(
        cargo(root)
            .args(["clippy", "--package", "interstage", "--lib", "--bin", "interstage"])
            .args(["--package", "interstage-images", "--bin", "measure"])
            .args(["--target", TARGET, "--", "-D", "warnings"]),
    )
}

/// The firmware with the host in the loop.
fn loop_lints(root: &Path) -> Result<Ended> {
    if !has(root, "clippy") {
        return Ok(Ended::Skipped("clippy is not installed"));
    }
    step(
        cargo(root)
            .args(["clippy", "--package", "interstage", "--bin", "interstage"])
            .args(["--no-default-features", "--features", "hil"])
            .args(["--target", TARGET, "--", "-D", "warnings"]),
    )
}

fn documentation(root: &Path) -> Result<Ended> {
    let mut doc = cargo(root);
    doc.env("RUSTDOCFLAGS", "-D warnings").args(["doc", "--workspace", "--no-deps"]);
    provided(&mut doc)?;
    step(doc.args(AS_IN_TESTS).args(WITH_BOARD))
}

/// What the image of this profile may take: the one that is flashed its budget, the
/// debug image the chip.
#[must_use]
pub fn budget(profile: Profile) -> Budget {
    match profile {
        Profile::Release => Budget::default(),
        Profile::Debug | Profile::Loop => Budget { flash: 512 * 1024, ram: 128 * 1024 },
    }
}

/// Builds the image without warnings and holds it against its budget.
fn image(root: &Path, profile: Profile) -> Result<Ended> {
    let mut command = cargo(root);
    command
        .args(["build", "--package", "interstage", "--bin", "interstage", "--target", TARGET])
        // Flags of the compiler would displace those of the linker, so warnings are
        // counted instead of denied; cargo repeats those of an earlier build.
        .args(["--message-format", "json-diagnostic-rendered-ansi"])
        .args(firmware::nameless().iter().flat_map(|setting| ["--config", setting]))
        .env_remove("RUSTFLAGS")
        .env_remove("CARGO_ENCODED_RUSTFLAGS")
        .stderr(Stdio::inherit());
    if profile == Profile::Release {
        command.arg("--release");
    }
    let output = command.output().context("could not start cargo")?;
    let said = warnings::rendered(&String::from_utf8_lossy(&output.stdout));
    for diagnostic in &said {
        eprint!("{diagnostic}");
    }
    if !output.status.success() {
        return Ok(Ended::Failed(code(output.status)));
    }
    if !said.is_empty() {
        eprintln!("the firmware builds with {} warnings", said.len());
        return Ok(Ended::Failed(1));
    }
    let footprint = Footprint::of_file(&firmware::build(profile)?)?;
    eprint!("{footprint}");
    if let Err(error) = footprint.check(&budget(profile)) {
        eprintln!("{error}");
        return Ok(Ended::Failed(1));
    }
    Ok(Ended::Passed)
}

/// Whether the tests take their long samples: `RIG_LONG=1`.
#[must_use]
pub fn long() -> bool {
    std::env::var_os("RIG_LONG").is_some()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_workspace_is_found() {
        let manifest = std::fs::read_to_string(root().unwrap().join("Cargo.toml")).unwrap();
        assert!(manifest.contains("[workspace]"));
    }

    #[test]
    fn a_component_that_does_not_exist_is_not_there() {
        assert!(!has(&root().unwrap(), "no-such-component"));
    }

    #[test]
    fn a_failure_is_never_zero() {
        let status = |text| Command::new("sh").args(["-c", text]).status().unwrap();
        assert_eq!(code(status("exit 101")), 101);
        assert_eq!(code(status("kill -9 $$")), 1);
    }
}
