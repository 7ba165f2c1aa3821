//! Results on standard output.

use std::io::{self, ErrorKind, IsTerminal, Write};
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::failure::Failure;
use crate::files::is_one_file;
use crate::table::{NARROW, width, wrapped};

/// A result with the files that were written, as `--json` prints both.
#[derive(Serialize)]
pub struct WithFiles<'a, T: Serialize> {
    #[serde(flatten)]
    pub result: &'a T,
    pub files: &'a [PathBuf],
}

/// Prints `value` as one line of JSON, or the text of `human`.
pub fn result(
    json: bool,
    value: &impl Serialize,
    human: impl FnOnce() -> String,
) -> Result<(), Failure> {
    if json {
        let text = serde_json::to_string(value).map_err(Failure::run)?;
        print(&format!("{text}\n"))
    } else {
        print(&human())
    }
}

/// The files that were written: a line a file, or a folder and their names. Paths are not wrapped, so that
/// they can be copied.
pub fn wrote(files: &[PathBuf]) -> String {
    let folder = files.first().and_then(|file| file.parent());
    if let Some(folder) = folder.filter(|folder| files.len() > 1 && *folder != Path::new(""))
        && files.iter().all(|file| file.parent() == Some(folder))
    {
        let names = files.iter().filter_map(|file| file.file_name()).map(|n| n.to_string_lossy());
        let names: Vec<_> = names.collect();
        let (to, names) = (format!("  wrote {}/:", folder.display()), names.join(", "));
        let is_short = to.chars().count() + 1 + names.len() <= usize::from(NARROW);
        let below = || format!("{to}\n{}", wrapped(&names, "    ", NARROW));
        return if is_short { format!("{to} {names}\n") } else { below() };
    }
    files.iter().map(|file| format!("  wrote {}\n", file.display())).collect()
}

/// Refuses to write the file that the option or argument `name` gives over one that is read.
pub(super) fn spare(name: &str, to: &Path, inputs: &[&Path]) -> Result<(), Failure> {
    if inputs.iter().any(|input| is_one_file(input, to)) {
        let to = to.display();
        return Err(Failure::input(format!("{name} {to}: is read by this command: name another")));
    }
    Ok(())
}

/// Refuses a folder `out` for the files where a file is.
pub(super) fn no_file(out: &Path) -> Result<(), Failure> {
    if out.exists() && !out.is_dir() {
        let out = out.display();
        return Err(Failure::input(format!("--out {out}: exists and is not a directory")));
    }
    Ok(())
}

/// Refuses to write to a file of another ending.
pub(super) fn ends_in(name: &str, to: &Path, ending: &str) -> Result<(), Failure> {
    let why = || format!("{name} {}: expected a name that ends in .{ending}", to.display());
    let is_so = to.extension().is_some_and(|found| found == ending);
    is_so.then_some(()).ok_or_else(|| Failure::input(why()))
}

/// Prints an error as one line, wrapped where a person reads it.
pub(super) fn complain(error: &str) {
    if io::stderr().is_terminal() {
        eprint!("{}", wrapped(error, "", width()));
    } else {
        eprintln!("{error}");
    }
}

/// Prints `text`. A reader that closes the pipe early is no error.
pub(crate) fn print(text: &str) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            Err(Failure::run(format!("standard output: {error}")))
        }
        _ => Ok(()),
    }
}
