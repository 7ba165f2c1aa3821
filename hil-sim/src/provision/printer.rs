//! `defmt-print`, the reader that comes with defmt: a second opinion on the text log.

use std::path::PathBuf;
use std::process::{Command, Stdio};

use super::{ProvisionError, started};
use crate::firmware;

/// Its name on crates.io.
const CRATE: &str = "defmt-print";
/// The version, as tried.
const VERSION: &str = "1.2.0";

/// The program, built from crates.io into the target directory if it is not there.
///
/// # Errors
/// [`ProvisionError::Tool`] if it cannot be built, which takes a network.
pub fn defmt_print() -> Result<PathBuf, ProvisionError> {
    let root = firmware::target_directory().join("board-tools").join(format!("{CRATE}-{VERSION}"));
    let program = root.join("bin").join(CRATE);
    if program.is_file() {
        return Ok(program);
    }
    let mut cargo = Command::new(firmware::tool("CARGO", "cargo"));
    cargo
        .args(["install", CRATE, "--version", VERSION, "--locked", "--root"])
        .arg(&root)
        // A build of its own, that leaves nothing behind but the program.
        .env_remove("CARGO_TARGET_DIR")
        .stdout(Stdio::null());
    let status = cargo.status().map_err(|source| started("cargo", source))?;
    if status.success() { Ok(program) } else { Err(ProvisionError::Tool(CRATE, status)) }
}
