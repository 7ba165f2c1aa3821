//! Files that are whole or absent.

use std::error::Error;
use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use super::ExportError;

/// What may go wrong while a file is filled.
pub(super) type Failure = Box<dyn Error + Send + Sync>;

/// Fills the file at `path` by `fill`, under a temporary name until it is whole.
pub(super) fn write(
    path: &Path,
    fill: impl FnOnce(&mut BufWriter<File>) -> Result<(), Failure>,
) -> Result<(), ExportError> {
    let partial = partial_name(path);
    let result = File::create(&partial).map_err(Failure::from).and_then(|file| {
        let mut out = BufWriter::with_capacity(1 << 18, file);
        fill(&mut out)?;
        out.flush()?;
        Ok(fs::rename(&partial, path)?)
    });
    result.map_err(|source| {
        // Nothing more can be done about a file that cannot be removed either.
        let _ = fs::remove_file(&partial);
        ExportError::File { path: path.to_owned(), source }
    })
}

/// Writes `text` to `path`.
///
/// # Errors
/// [`ExportError::File`] with the reason.
pub fn write_text(path: &Path, text: &str) -> Result<(), ExportError> {
    write(path, |out| Ok(out.write_all(text.as_bytes())?))
}

/// A hidden name beside `path`, of this process alone.
fn partial_name(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!(".{name}.{}.partial", std::process::id()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_fails_half_way_leaves_the_old_one() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("report.html");
        write_text(&path, "old").unwrap();
        let error = write(&path, |out| {
            out.write_all(b"new")?;
            Err("the disk is full".into())
        })
        .unwrap_err();
        assert!(error.to_string().ends_with("report.html: cannot be written: the disk is full"));
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        assert_eq!(fs::read_dir(directory.path()).unwrap().count(), 1);
    }
}
