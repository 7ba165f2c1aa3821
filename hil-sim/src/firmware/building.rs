//! A build by cargo as it goes on: silent where everything is built already, else one line that
//! says so and a bar with cargo's own count of what is left.

use std::io::{self, Read};
use std::process::{Command, Output, Stdio};

use crate::progress::{self, Progress};

/// Runs cargo and returns its standard output; its messages go to standard error.
pub(super) fn run(cargo: &mut Command, what: &str) -> io::Result<Output> {
    // The bar of cargo is read here, and never shown.
    cargo.env("CARGO_TERM_PROGRESS_WHEN", "always").env("CARGO_TERM_PROGRESS_WIDTH", "120");
    cargo.stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = cargo.spawn()?;
    let Some(errors) = child.stderr.take() else { return child.wait_with_output() };
    std::thread::scope(|scope| {
        scope.spawn(|| Shown::new(what).follow(errors));
        child.wait_with_output()
    })
}

/// What a piece of cargo's standard error says.
#[derive(Debug, PartialEq, Eq)]
enum Said<'a> {
    /// So many of so many units are done.
    Done(u64, u64),
    /// Something is compiled or fetched.
    Busy,
    /// A warning, an error, or that another cargo is waited for.
    Message(&'a str),
    /// Nothing that anybody needs to know.
    Nothing,
}

impl<'a> Said<'a> {
    fn of(text: &'a str) -> Self {
        let plain = text.trim();
        let word = plain.split_whitespace().next().unwrap_or_default();
        match word {
            "Building" => done(plain).unwrap_or(Self::Nothing),
            "Compiling" | "Downloading" | "Downloaded" | "Updating" => Self::Busy,
            "" | "Finished" | "Fresh" | "Checking" | "Locking" | "Adding" => Self::Nothing,
            _ => Self::Message(text),
        }
    }
}

/// The numbers of `Building [=====>   ] 12/345: names`.
fn done(text: &str) -> Option<Said<'_>> {
    let (_, rest) = text.split_once("] ")?;
    let (done, all) = rest.split(':').next()?.split_once('/')?;
    Some(Said::Done(done.trim().parse().ok()?, all.trim().parse().ok()?))
}

/// What is shown of a build.
struct Shown<'a> {
    what: &'a str,
    /// The bar, and how many units were done before anything was built.
    bar: Option<(Progress, u64)>,
    /// Latest count.
    count: (u64, u64),
    busy: bool,
}

impl<'a> Shown<'a> {
    const fn new(what: &'a str) -> Self {
        Self { what, bar: None, count: (0, 0), busy: false }
    }

    /// Reads to the end of cargo's standard error.
    fn follow(&mut self, mut errors: impl Read) {
        let (mut held, mut piece) = (Vec::new(), [0; 4096]);
        while let Ok(length @ 1..) = errors.read(&mut piece) {
            for &byte in &piece[..length] {
                if matches!(byte, b'\r' | b'\n') {
                    self.see(&plain(&String::from_utf8_lossy(&held)));
                    held.clear();
                } else {
                    held.push(byte);
                }
            }
        }
        self.see(&plain(&String::from_utf8_lossy(&held)));
    }

    fn see(&mut self, text: &str) {
        match Said::of(text) {
            Said::Done(done, all) => self.count = (done, all),
            Said::Busy => self.busy = true,
            Said::Message(text) => match &self.bar {
                Some((bar, _)) => bar.line(text),
                None => eprintln!("{text}"),
            },
            Said::Nothing => return,
        }
        let (done, all) = self.count;
        if self.bar.is_none() && self.busy && all > done {
            let left = all - done;
            eprintln!("building {}, once: {left} units to compile", self.what);
            self.bar = Some((progress::bar(&format!("building {}", self.what), left), done));
        }
        if let Some((bar, before)) = &self.bar {
            bar.reach(done.saturating_sub(*before), all.saturating_sub(*before));
        }
    }
}

/// Text without the control sequences of a terminal.
fn plain(text: &str) -> String {
    let mut parts = text.split('\u{1b}');
    let first = parts.next().unwrap_or_default().to_owned();
    parts.fold(first, |all, part| {
        let end =
            part.find(|letter: char| letter.is_ascii_alphabetic()).map_or(part.len(), |at| at + 1);
        all + &part[end..]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_count_is_cargos_own() {
        let line = "    Building [=====>      ] 87/312: serde, unicorn-engine-sys(build)";
        assert_eq!(Said::of(line), Said::Done(87, 312));
        assert_eq!(Said::of("   Compiling serde v1.0.0"), Said::Busy);
        assert_eq!(Said::of("    Finished `dev` profile in 0.1s"), Said::Nothing);
        assert_eq!(Said::of("error: no luck"), Said::Message("error: no luck"));
        assert_eq!(plain("\u{1b}[1m\u{1b}[32m   Compiling\u{1b}[0m serde"), "   Compiling serde");
    }

    #[test]
    fn nothing_is_said_of_what_is_built_and_the_bar_counts_what_is_not() {
        let mut shown = Shown::new("the study");
        shown.follow(&b"    Building [=> ] 311/312: rig\r    Finished dev\n"[..]);
        assert!(shown.bar.is_none());
        let text =
            "    Building [=> ] 300/312: a\r   Compiling a v1\n    Building [=> ] 304/312: b\r";
        let mut shown = Shown::new("the study");
        shown.follow(text.as_bytes());
        let (bar, before) = shown.bar.as_ref().expect("it builds");
        assert_eq!((*before, bar.position()), (300, (4, 12)));
    }
}
