//! The page around the plots.

use super::panels::{Across, View};
use super::svg::{self, escape};
use super::verdict::{Grade, gap_sentence, headline};
use super::{band, crossings, tables};
use crate::record::Recording;
use crate::table::number;

const STYLE: &str = include_str!("style.css");
/// Size of a plot of the run, CSS pixels.
const SIZE: (u32, u32) = (1100, 240);
/// Size of the bands, CSS pixels.
const BAND_SIZE: (u32, u32) = (1100, 175);

/// A section of a page beside those that every run has.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Section {
    /// Its heading.
    pub title: &'static str,
    /// Its content, as HTML.
    pub body: String,
}

/// The page of `recording`, with `more` sections. It needs no other file and no script.
#[must_use]
pub fn html(recording: &Recording, more: &[Section]) -> String {
    let s = &recording.summary;
    let title = escape(&format!("{} on {}, seed {}", s.direction, s.rig, s.seed));
    let grade = match Grade::of(s) {
        Grade::Good => "good",
        Grade::Fair => "fair",
        Grade::Bad => "bad",
    };
    let mut page = head(&title);
    page += &format!(
        "<header class=\"{grade}\">\n<p class=\"what\">interstage · {} controller · {} · rig {} · seed {}</p>\n\
<h1>{}</h1>\n<p>{}; gross slip {} mm; {}</p>\n</header>\n",
        escape(&s.controller),
        escape(&s.target),
        escape(&s.rig),
        s.seed,
        escape(&headline(s)),
        capital(&gap_sentence(s)),
        number(s.slip_mm, 3),
        count(s.faults.len(), "fault") + ", " + &count(s.limits.len(), "limit") + " reported",
    );
    page += &section("Summary", &tables::summary(s));
    page += &section(
        "Crossings",
        &format!(
            "{}<p class=\"note\">The gap of a crossing is the clearance between the step root \
and the undeformed wheel at the instant at which the lower wall stops carrying load (on retraction: \
 begins to). Errors are against the true value. Lead: how long before the corner touched \
the preload was reached.</p>\n",
            tables::ledger(&s.crossings)
        ),
    );
    page += &section("Faults and limits", &tables::reports(s));
    page += &section("The run", &plots(recording));
    page += &section("The crossings enlarged", &crossings::html(recording));
    for Section { title, body } in more {
        page += &section(title, body);
    }
    page += &section("Log", &folded("Lines of the log", &tables::log(&recording.log)));
    let parameters = format!("<pre>{}</pre>\n", escape(&recording.parameters));
    page += &section("Parameters", &folded("Parameters used, as TOML", &parameters));
    page += &format!(
        "<footer>\n<p>Written by hil-sim {} with the controller interstage {}.</p>\n\
<p>Trace digest, SHA-256: <code>{}</code></p>\n</footer>\n</main>\n</body>\n</html>\n",
        env!("CARGO_PKG_VERSION"),
        env!("CARGO_PKG_VERSION"),
        escape(&s.trace_digest),
    );
    page
}

/// The beginning of a page, up to its content.
pub(super) fn head(title: &str) -> String {
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
<title>interstage: {title}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n<main>\n"
    )
}

pub(super) fn section(title: &str, body: &str) -> String {
    format!("<section>\n<h2>{title}</h2>\n{body}</section>\n")
}

fn folded(title: &str, body: &str) -> String {
    format!("<details>\n<summary>{title}</summary>\n{body}</details>\n")
}

/// The plots over time and over position, one of the two shown.
fn plots(recording: &Recording) -> String {
    if recording.rows.is_empty() {
        return "<p>No rows were recorded.</p>\n".to_owned();
    }
    let time = stack(recording, Across::Time);
    let position = stack(recording, Across::Position);
    format!(
        "<input type=\"radio\" name=\"across\" id=\"time\" checked>\
<label for=\"time\">over time</label>\n\
<input type=\"radio\" name=\"across\" id=\"position\">\
<label for=\"position\">over position</label>\n\
<p class=\"note\">Shaded: from the first touch of the corner to the instant of the gap.</p>\n\
<div class=\"time\">\n{time}</div>\n<div class=\"position\">\n{position}</div>\n"
    )
}

fn stack(recording: &Recording, across: Across) -> String {
    let view = View::new(recording, across);
    let mut html = String::new();
    for panel in view.all() {
        let name = format!("{}, {}", panel.title, across.name());
        html += &format!("<figure>{}</figure>\n", svg::fluid(SIZE, &name, |area| panel.draw(area)));
    }
    let name = format!("Mode, contact stage and sleeve level, {}", across.name());
    let bands = svg::fluid(BAND_SIZE, &name, |area| band::draw(&view, area));
    html + &format!("<figure>{bands}{}</figure>\n", band::legend(&recording.rows))
}

fn count(n: usize, what: &str) -> String {
    match n {
        0 => format!("no {what}"),
        1 => format!("1 {what}"),
        n => format!("{n} {what}s"),
    }
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}
