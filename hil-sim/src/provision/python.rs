//! Python with pinned packages in a virtual environment under the target directory.

use std::fs;
use std::path::PathBuf;
use std::process::Command;

use anyhow::{Context, Result, ensure};

use crate::firmware;

/// The Python of the environment `name` in the target directory, which has these packages, each
/// `name==version`. It is made first if it is missing or has others.
pub fn python(name: &str, packages: &[&str]) -> Result<PathBuf> {
    let folder = firmware::target_directory().join(name);
    let (program, stamp) = (folder.join("bin/python"), folder.join("complete"));
    let wanted = packages.join("\n");
    if fs::read_to_string(&stamp).is_ok_and(|there| there == wanted) && program.is_file() {
        return Ok(program);
    }
    fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
    let mut venv = Command::new("python3");
    succeeds(venv.args(["-m", "venv"]).arg(&folder))?;
    let mut pip = Command::new(&program);
    pip.args("-m pip install --quiet --disable-pip-version-check --no-input".split(' '));
    pip.args(["--only-binary=:all:", "--retries=2", "--timeout=15"]).args(packages);
    succeeds(&mut pip)?;
    fs::write(&stamp, wanted).with_context(|| stamp.display().to_string())?;
    Ok(program)
}

/// Runs a command; an error with the last line of its standard error if it fails.
fn succeeds(command: &mut Command) -> Result<()> {
    let output = firmware::output(command)?;
    let said = String::from_utf8_lossy(&output.stderr);
    let last = said.lines().rfind(|line| !line.trim().is_empty()).unwrap_or("no message");
    ensure!(output.status.success(), "{:?} failed: {}", command.get_program(), last.trim());
    Ok(())
}
