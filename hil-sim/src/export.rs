//! A run as files for other programs: `log.csv` with a row a tick, `log.mcap` with
//! telemetry, crossings and log on one time axis, and `summary.json`.
//!
//! A file is written under a temporary name beside its place and renamed at the
//! end, so that a file of the final name is always whole.

mod csv_log;
pub(crate) mod json;
mod mcap_log;
mod whole;

use std::path::{Path, PathBuf};

use crate::record::Recording;

pub use csv_log::write_csv;
pub use json::write_summary;
pub use mcap_log::write_mcap;
pub use whole::write_text;

/// A file that could not be written; displays as one line with its path.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// The directory cannot be made.
    #[error("{}: cannot make the directory: {source}", path.display())]
    Directory {
        /// The directory.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The file cannot be written.
    #[error("{}: cannot be written: {source}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Why.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
}

/// Writes `log.csv`, `log.mcap` and `summary.json` of `recording` into `directory`,
/// which is made if it is missing, and returns their paths.
///
/// # Errors
/// The first file that cannot be written; those before it stay.
pub fn write_all(recording: &Recording, directory: &Path) -> Result<Vec<PathBuf>, ExportError> {
    make_directory(directory)?;
    let [csv, mcap, summary] =
        ["log.csv", "log.mcap", "summary.json"].map(|name| directory.join(name));
    write_csv(recording, &csv)?;
    write_mcap(recording, &mcap)?;
    write_summary(&recording.summary, &summary)?;
    Ok(vec![csv, mcap, summary])
}

/// Makes `directory` and those above it.
///
/// # Errors
/// [`ExportError::Directory`] with the reason.
pub fn make_directory(directory: &Path) -> Result<(), ExportError> {
    std::fs::create_dir_all(directory)
        .map_err(|source| ExportError::Directory { path: directory.to_owned(), source })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::example;

    #[test]
    fn writes_every_file_and_leaves_no_temporary_one() {
        let directory = tempfile::tempdir().unwrap();
        let run = directory.path().join("out/run");
        let files = write_all(&example::deploy(), &run).unwrap();
        assert!(files.iter().all(|file| file.is_file()));
        assert_eq!(std::fs::read_dir(&run).unwrap().count(), files.len());
    }

    #[test]
    fn an_error_names_the_path() {
        let directory = tempfile::tempdir().unwrap();
        let file = directory.path().join("taken");
        std::fs::write(&file, "").unwrap();
        let error = write_all(&example::deploy(), &file.join("run")).unwrap_err().to_string();
        assert!(error.contains("taken/run: cannot make the directory"), "{error}");
        let error = write_csv(&Recording::default(), &file.join("log.csv")).unwrap_err();
        assert!(error.to_string().contains("taken/log.csv: cannot be written"), "{error}");
    }
}
