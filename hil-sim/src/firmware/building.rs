//! A build by cargo as it goes on: a spinner on a terminal with the number of units compiled, and a
//! line where something is compiled.

use std::io::{self, BufRead, BufReader};
use std::process::{Command, ExitStatus, Stdio};

use crate::progress;
use crate::table::counted;

/// Runs cargo and returns its messages, one JSON object a line; its warnings and errors go to
/// standard error.
pub(super) fn run(cargo: &mut Command, what: &str) -> io::Result<(ExitStatus, String)> {
    let mut child = cargo.arg("--quiet").stdout(Stdio::piped()).spawn()?;
    let progress = progress::spinner(&format!("building {what}"));
    let (mut messages, mut compiled) = (String::new(), 0);
    for line in child.stdout.take().into_iter().flat_map(|out| BufReader::new(out).lines()) {
        let line = line?;
        if line.contains("\"fresh\":false") {
            compiled += 1;
            if compiled == 1 {
                progress.line(&format!("building {what}, once: up to some minutes"));
            }
            progress.say(&format!("building {what}: {} compiled", counted(compiled, "unit")));
        }
        messages += &(line + "\n");
    }
    Ok((child.wait()?, messages))
}
