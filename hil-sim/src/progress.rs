//! Progress on standard error, hidden when that is no terminal; standard output is for
//! results alone.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Time between two frames of a spinner.
const FRAME: Duration = Duration::from_millis(120);

/// A bar over `length` items of `what`. Dropping it removes it.
pub fn bar(what: &str, length: u64) -> Progress {
    Progress::new(Some(length), "{msg} {wide_bar} {pos}/{len}, {eta} left", what)
}

/// A spinner for work of unknown length.
pub fn spinner(what: &str) -> Progress {
    let spinner = Progress::new(None, "{spinner} {msg} {elapsed}", what);
    spinner.0.enable_steady_tick(FRAME);
    spinner
}

/// Progress of some work. Cheap to share between threads by reference.
#[derive(Debug)]
pub struct Progress(ProgressBar);

impl Progress {
    fn new(length: Option<u64>, template: &str, what: &str) -> Self {
        let bar = ProgressBar::with_draw_target(length, ProgressDrawTarget::stderr());
        bar.set_style(ProgressStyle::with_template(template).expect("a template of this file"));
        bar.set_message(what.to_owned());
        Self(bar)
    }

    /// `count` more items are done.
    pub fn advance(&self, count: u64) {
        self.0.inc(count);
    }

    /// Shows what is being done.
    pub fn say(&self, what: &str) {
        self.0.set_message(what.to_owned());
    }

    /// Prints a line above the bar; without a terminal, just the line.
    pub(crate) fn line(&self, text: &str) {
        self.0.suspend(|| eprintln!("{text}"));
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
