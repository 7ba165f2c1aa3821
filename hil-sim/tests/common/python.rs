//! Python with pinned packages in a virtual environment under the target directory.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;

/// The Python of the environment `name`, which has these packages, each `name==version`. It is
/// made first if it is missing or has others; if it cannot be, one line says why.
pub(crate) fn python(name: &str, packages: &[&str]) -> Result<PathBuf, String> {
    static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());
    let _guard = ONE_AT_A_TIME.lock();
    let target = std::env::var_os("CARGO_TARGET_DIR").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).with_file_name("target"),
        PathBuf::from,
    );
    let folder = target.join(name);
    let (program, stamp) = (folder.join("bin/python"), folder.join("complete"));
    let wanted = packages.join("\n");
    if fs::read_to_string(&stamp).is_ok_and(|there| there == wanted) && program.is_file() {
        return Ok(program);
    }
    succeeds(Command::new("python3").args(["-m", "venv"]).arg(&folder))?;
    let mut pip = Command::new(&program);
    pip.args("-m pip install --quiet --disable-pip-version-check --no-input".split(' '));
    succeeds(pip.args(["--only-binary=:all:", "--retries=2", "--timeout=15"]).args(packages))?;
    fs::write(&stamp, wanted).map_err(|error| error.to_string())?;
    Ok(program)
}

/// Runs a command; an error with the last line of its standard error if it fails.
fn succeeds(command: &mut Command) -> Result<(), String> {
    let output = command.output().map_err(|error| error.to_string())?;
    let said = String::from_utf8_lossy(&output.stderr);
    let last = said.lines().rfind(|line| !line.trim().is_empty()).unwrap_or("no message");
    if output.status.success() { Ok(()) } else { Err(last.trim().to_owned()) }
}
