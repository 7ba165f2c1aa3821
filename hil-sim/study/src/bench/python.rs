//! Python with pinned packages in a virtual environment under the target directory.

use std::env;
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
    pub(super) folder: String,
}

/// The folder of the scripts.
fn scripts() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("peers")
}

/// Makes the environment, unless it has these packages already.
pub(super) fn provide(say: &dyn Fn(&str)) -> Result<Python> {
    let workspace = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let target = env::var_os("CARGO_TARGET_DIR").map_or(workspace.join("target"), PathBuf::from);
    let folder = target.join("peers");
    let wanted = fs::read_to_string(scripts().join("requirements.txt"))?;
    let stamp = folder.join("requirements.txt");
    let program = folder.join("bin/python");
    if fs::read_to_string(&stamp).ok().as_ref() != Some(&wanted) || !program.is_file() {
        say("setting up Python");
        fs::create_dir_all(&folder)?;
        quiet(Command::new("python3").args(["-m", "venv"]).arg(&folder))?;
        let install = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "-r"];
        quiet(Command::new(&program).args(install).arg(scripts().join("requirements.txt")))?;
        fs::write(&stamp, &wanted)?;
    }
    let folder = folder.to_str().context("the target directory's name is not text")?.to_owned();
    Ok(Python { program, folder })
}

/// Runs a command whose output matters only if it fails.
fn quiet(command: &mut Command) -> Result<()> {
    let name = command.get_program().to_string_lossy().into_owned();
    let output = command.output().with_context(|| format!("could not start `{name}`"))?;
    ensure!(output.status.success(), "`{name}` failed: {}", last_line(&output.stderr));
    Ok(())
}

fn last_line(text: &[u8]) -> String {
    let text = String::from_utf8_lossy(text);
    text.lines().map(str::trim).rfind(|line| !line.is_empty()).unwrap_or("no message").to_owned()
}

impl Python {
    /// Runs a script with `given` on its standard input; its standard output is the result,
    /// both JSON.
    pub(super) fn run<T: DeserializeOwned>(
        &self,
        script: &str,
        given: &impl Serialize,
    ) -> Result<T> {
        let mut child = Command::new(&self.program)
            .arg(scripts().join(script))
            // Single threads are compared.
            .envs([("OMP_NUM_THREADS", "1"), ("OPENBLAS_NUM_THREADS", "1")])
            .env("PYTHONDONTWRITEBYTECODE", "1")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .with_context(|| format!("could not start `{}`", self.program.display()))?;
        let text = serde_json::to_vec(given)?;
        child.stdin.take().context("the script has no input")?.write_all(&text)?;
        let output = child.wait_with_output()?;
        ensure!(output.status.success(), "{script} failed: {}", last_line(&output.stderr));
        serde_json::from_slice(&output.stdout).with_context(|| format!("output of {script}"))
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
