//! Python with pinned packages in a virtual environment under the target directory.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, Result, ensure};
use serde::Serialize;
use serde::de::DeserializeOwned;

/// A Python that has what the scripts import.
pub(super) struct Python {
    program: PathBuf,
    /// A folder for what the scripts build.
    pub(super) folder: PathBuf,
}

/// Folder of the environment in the target directory.
const FOLDER: &str = "peers";

/// The folder of the scripts.
fn scripts() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("peers")
}

/// Makes the environment, unless it has these packages already.
pub(super) fn provide(say: &dyn Fn(&str)) -> Result<Python> {
    say("setting up Python");
    let wanted = fs::read_to_string(scripts().join("requirements.txt"))?;
    let program = hil_sim::provision::python(FOLDER, &wanted.lines().collect::<Vec<_>>())?;
    let folder = program.ancestors().nth(2).context("no folder")?.to_owned();
    Ok(Python { program, folder })
}

/// Standard output of a command that is given `input`; an error with the last line of its
/// standard error if it fails.
fn output(command: &mut Command, input: &[u8]) -> Result<Vec<u8>> {
    let name = format!("{command:?}");
    command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().with_context(|| format!("could not start {name}"))?;
    child.stdin.take().context("no standard input")?.write_all(input)?;
    let output = child.wait_with_output()?;
    let said = String::from_utf8_lossy(&output.stderr);
    let last = said.lines().rfind(|line| !line.trim().is_empty()).unwrap_or("no message");
    ensure!(output.status.success(), "{name} failed: {}", last.trim());
    Ok(output.stdout)
}

impl Python {
    /// Runs a script with `given` on its standard input; its standard output is the result,
    /// both JSON.
    pub(super) fn run<T: DeserializeOwned>(
        &self,
        script: &str,
        given: &impl Serialize,
    ) -> Result<T> {
        let mut command = Command::new(&self.program);
        command
            .arg(scripts().join(script))
            // Single threads are compared.
            .envs([("OMP_NUM_THREADS", "1"), ("OPENBLAS_NUM_THREADS", "1")])
            .env("PYTHONDONTWRITEBYTECODE", "1");
        let text = output(&mut command, &serde_json::to_vec(given)?)?;
        serde_json::from_slice(&text).with_context(|| format!("output of {script}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_packages_are_pinned() {
        let wanted = fs::read_to_string(scripts().join("requirements.txt")).unwrap();
        assert!(wanted.lines().count() >= 2 && wanted.lines().all(|line| line.contains("==")));
    }

    #[test]
    fn a_script_that_fails_says_why_in_one_line() {
        let python = Python { program: "python3".into(), folder: "/nowhere".into() };
        let error = python.run::<serde_json::Value>("no_such_script.py", &1).unwrap_err();
        let text = error.to_string();
        assert!(text.contains("no_such_script.py") && !text.contains('\n'), "{text}");
    }
}
