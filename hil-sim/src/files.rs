//! Files that are complete or absent.

use std::error::Error;
use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// Why a file could not be filled.
pub(crate) type Failure = Box<dyn Error + Send + Sync>;

/// A file or directory that could not be written; displays as one line with its path.
#[derive(Debug, thiserror::Error)]
#[error("{}: {what}: {source}", path.display())]
pub struct FileError {
    path: PathBuf,
    what: &'static str,
    source: Failure,
}

/// An error and its causes in one line, the system's own last.
pub(crate) fn with_causes(error: &(dyn Error + 'static)) -> String {
    let causes = std::iter::successors(Some(error), |&error| error.source());
    let mut texts: Vec<String> = causes.map(ToString::to_string).collect();
    texts.dedup();
    texts.join(": ")
}

/// Fills the file at `path` by `fill`, under a temporary name beside it until it is complete.
pub(crate) fn atomic_write(
    path: &Path,
    fill: impl FnOnce(&mut BufWriter<&File>) -> Result<(), Failure>,
) -> Result<(), FileError> {
    let write = || {
        let mut builder = tempfile::Builder::new();
        builder.suffix(".partial");
        // As any new file: the user's mask decides.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        let file = builder.tempfile_in(folder.unwrap_or(Path::new(".")))?;
        let mut out = BufWriter::with_capacity(1 << 18, file.as_file());
        fill(&mut out)?;
        out.flush()?;
        drop(out);
        file.persist(path)?;
        Ok(())
    };
    let what = "cannot be written";
    write().map_err(|source| FileError { path: path.to_owned(), what, source })
}

/// `path` if no other result is there by `is_other`; else the first of `name-2`, `name-3` and so on
/// where none is, so that nothing is replaced.
pub(crate) fn vacant(path: &Path, is_other: impl Fn(&Path) -> bool) -> PathBuf {
    if !is_other(path) {
        return path.to_owned();
    }
    // A folder's name may have dots.
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let (stem, ending) = match name.rsplit_once('.') {
        Some((stem, ending)) if !path.is_dir() => (stem, format!(".{ending}")),
        _ => (&*name, String::new()),
    };
    let numbered = |n: u32| path.with_file_name(format!("{stem}-{n}{ending}"));
    (2..).map(numbered).find(|path| !is_other(path)).unwrap_or_else(|| path.to_owned())
}

/// Where a result goes: as asked for, or to the usual place if that is [`vacant`]. Standard error
/// names the other result that is there.
pub(crate) fn place(
    asked: Option<&Path>,
    usual: &Path,
    is_other: impl Fn(&Path) -> bool,
) -> PathBuf {
    let place = asked.map_or_else(|| vacant(usual, &is_other), Path::to_owned);
    if is_other(&place) {
        eprintln!("{}: replaces another result", place.display());
    } else if asked.is_none() && place != usual {
        eprintln!("{} holds another result; this one goes to {}", usual.display(), place.display());
    }
    place
}

/// Whether another text than this is at `path`.
pub(crate) fn is_other(path: &Path, text: &str) -> bool {
    path.exists() && fs::read(path).map_or(true, |there| there != text.as_bytes())
}

/// Writes `text` to `path`; if that fails, the file stays as it was.
pub fn write_text(path: &Path, text: &str) -> Result<(), FileError> {
    atomic_write(path, |out| Ok(out.write_all(text.as_bytes())?))
}

/// Whether both paths lead to one file that is there.
pub(crate) fn is_one_file(a: &Path, b: &Path) -> bool {
    let [a, b] = [a, b].map(|path| path.canonicalize().ok());
    a.is_some() && a == b
}

/// Makes `directory` and those above it.
pub(crate) fn make_directory(directory: &Path) -> Result<(), FileError> {
    let what = "cannot make the directory";
    fs::create_dir_all(directory).map_err(|error| FileError {
        path: directory.to_owned(),
        what,
        source: error.into(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_there_keeps_its_name_unless_it_is_the_same() {
        let directory = tempfile::tempdir().unwrap();
        let at = |name: &str| directory.path().join(name);
        let usual = |text| place(None, &at("a.b.html"), |path| is_other(path, text));
        for (text, name) in [("one", "a.b.html"), ("two", "a.b-2.html"), ("three", "a.b-3.html")] {
            assert_eq!(usual(text), at(name));
            write_text(&at(name), text).unwrap();
            assert_eq!(usual(text), at(name));
        }
        make_directory(&at("run-tau=0.2")).unwrap();
        assert_eq!(vacant(&at("run-tau=0.2"), Path::exists), at("run-tau=0.2-2"));
    }

    #[test]
    fn a_file_that_fails_half_way_leaves_the_old_one() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("report.html");
        write_text(&path, "old").unwrap();
        let error = atomic_write(&path, |out| {
            out.write_all(b"new")?;
            Err("the disk is full".into())
        })
        .unwrap_err();
        assert!(error.to_string().ends_with("report.html: cannot be written: the disk is full"));
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        assert_eq!(fs::read_dir(directory.path()).unwrap().count(), 1);
    }
}
