//! Progress on standard error, hidden when that is no terminal, so that standard
//! output holds results and nothing else.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Time between two turns of a spinner.
const TURN: Duration = Duration::from_millis(120);

/// A bar over `length` items of `what`. It goes away when it is finished or dropped.
#[must_use]
pub fn bar(what: &str, length: u64) -> Progress {
    let bar = ProgressBar::with_draw_target(Some(length), ProgressDrawTarget::stderr());
    bar.set_style(style("{msg} {wide_bar} {pos}/{len}, {eta} left"));
    bar.set_message(what.to_owned());
    Progress(bar)
}

/// A bar over `seconds` of simulated time.
#[must_use]
pub fn time(what: &str, seconds: f64) -> Progress {
    let bar = ProgressBar::with_draw_target(Some(millis(seconds)), ProgressDrawTarget::stderr());
    bar.set_style(style("{msg} {wide_bar} {percent} %, {eta} left"));
    bar.set_message(what.to_owned());
    Progress(bar)
}

/// A spinner for work of unknown length.
#[must_use]
pub fn spinner(what: &str) -> Progress {
    let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr());
    bar.set_style(style("{spinner} {msg} {elapsed}"));
    bar.set_message(what.to_owned());
    bar.enable_steady_tick(TURN);
    Progress(bar)
}

/// Progress of some work. Cheap to share between threads by reference.
#[derive(Debug)]
pub struct Progress(ProgressBar);

impl Progress {
    /// `count` more items are done.
    pub fn advance(&self, count: u64) {
        self.0.inc(count);
    }

    /// Simulated time has come to `seconds`.
    pub fn at(&self, seconds: f64) {
        self.0.set_position(millis(seconds));
    }

    /// Says what is being done.
    pub fn say(&self, what: &str) {
        self.0.set_message(what.to_owned());
    }

    /// Prints a line above the bar; without a terminal, just the line.
    pub fn line(&self, text: &str) {
        self.0.suspend(|| eprintln!("{text}"));
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}

fn millis(seconds: f64) -> u64 {
    (seconds * 1e3) as u64
}

fn style(template: &str) -> ProgressStyle {
    ProgressStyle::with_template(template).expect("the templates above are right")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn templates_are_right_and_positions_count() {
        let items = bar("runs", 3);
        items.advance(2);
        assert_eq!(items.0.position(), 2);
        let seconds = time("deploy", 10.0);
        seconds.at(2.5);
        assert_eq!((seconds.0.position(), seconds.0.length()), (2500, Some(10_000)));
        spinner("build").say("link");
    }
}
