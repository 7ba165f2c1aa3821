//! Python with pinned packages in a virtual environment under the target directory.

use std::path::PathBuf;
use std::sync::Mutex;

use hil_sim::firmware::target_directory;
use hil_sim::provision::fetched;

/// The Python of the environment `name`, which has these packages, each `name==version`. It is
/// made first if it is missing or has others; if it cannot be, one line says why.
pub(crate) fn python(name: &str, packages: &[&str]) -> Result<PathBuf, String> {
    static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());
    let _guard = ONE_AT_A_TIME.lock();
    let folder = target_directory().join(name);
    fetched(&folder, packages)?;
    Ok(folder.join("bin/python3"))
}
