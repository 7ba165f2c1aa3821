//! The page around the plots.

use super::panel::Panel;
use super::panels::{Across, View, figure};
use super::scene::Scene;
use super::svg::escape;
use super::verdict::{Grade, gap_sentence, headline, origin, slip_sentence, verdict};
use super::{animation, band, crossings, tables};
use crate::record::Recording;
use crate::table::counted;

const STYLE: &str = include_str!("style.css");
const PLOTS: &str = include_str!("plots.js");
/// Size of a plot of the run, CSS pixels.
pub(super) const SIZE: (u32, u32) = (1100, 210);

/// A section of a page beside those that every run has.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Section {
    pub title: &'static str,
    /// Its content, as HTML.
    pub body: String,
}

/// The page of `recording`, with `more` sections. It needs no other file; without its
/// script it lacks the animation alone.
pub fn html(recording: &Recording, more: &[Section]) -> String {
    let recording = &recording.since_command();
    let s = &recording.summary;
    let title = escape(&format!("{} on {}, seed {}", s.direction, s.rig, s.seed));
    let grade = Grade::of(s).name();
    let remarks = Some(verdict(s)).filter(|verdict| !verdict.is_empty()).into_iter();
    let remarks = remarks.chain(s.missing.iter().map(|what| format!("incomplete log: {what}")));
    let remarks: String =
        remarks.map(|text| format!("<p class=\"remark\">{}</p>\n", escape(&text))).collect();
    let mut page = head(&title);
    page += &format!(
        "<header class=\"{grade}\">\n<p class=\"what\">interstage · {}</p>\n\
<h1>{}</h1>\n{remarks}<p>{}; {}; {}</p>\n</header>\n",
        escape(&origin(s)),
        escape(&headline(s)),
        capital(&gap_sentence(s)),
        slip_sentence(s),
        counted(s.faults.len(), "fault") + ", " + &counted(s.limits.len(), "limit") + " reported",
    );
    page += &section("Summary", &tables::summary(s));
    page += &section(
        "Crossings",
        &format!(
            include_str!("crossings.html"),
            tables::crossings(&s.crossings),
            if s.measured {
                "Every figure of this log is measured or estimated by the controller; where a step was \
found is compared with the step table. Slip includes creep and the steps' tolerances."
            } else {
                "Errors are against the true value."
            }
        ),
    );
    page += &section("Faults and limits", &tables::reports(s));
    let scene = Scene::new(recording);
    if !recording.rows.is_empty() {
        page += &section("The gap at the steps", &animation::html(scene.as_ref()));
    }
    page += &section("The run", &plots(recording));
    page += &section("The crossings enlarged", &crossings::html(recording));
    for Section { title, body } in more {
        page += &section(title, body);
    }
    page += &section("Log", &folded("Lines of the log", &tables::log(&recording.log)));
    let all = format!("<pre>{}</pre>\n", escape(&recording.parameters));
    let all = folded("Parameters used, as TOML", &all);
    page += &section("Parameters", &all);
    page += &format!(
        "<footer>\n<p>Written by interstage {}.</p>\n\
<p>Trace digest, SHA-256: <code>{}</code></p>\n</footer>\n",
        env!("CARGO_PKG_VERSION"),
        escape(&s.trace_digest),
    );
    page + &end(&track(recording), &scene.as_ref().map(animation::script).unwrap_or_default())
}

/// The page of a log: of one start of the target as [`html`], of several a section each.
pub fn log_html(boots: &[Recording]) -> String {
    if let [boot] = boots {
        return html(boot, &[]);
    }
    let one = |(n, boot): (usize, &Recording)| {
        let boot = &boot.since_command();
        let s = &boot.summary;
        // The headline of a run that it cut short says it.
        let cause = s.restart.as_ref().filter(|cause| !headline(s).contains(*cause));
        let cause = cause.map_or_else(String::new, |cause| {
            format!("<p class=\"remark\">Ended by a restart: {}</p>\n", escape(cause))
        });
        let lost =
            s.missing.iter().map(|what| format!("<p>Incomplete log: {}</p>\n", escape(what)));
        let plots = if boot.rows.is_empty() { String::new() } else { stack(boot, Across::Time) };
        let body = format!(
            "<p><b>{}</b>; {}; {}</p>\n{cause}{}{}{}{plots}{}{}",
            escape(&headline(s)),
            gap_sentence(s),
            slip_sentence(s),
            lost.collect::<String>(),
            tables::crossings(&s.crossings),
            tables::reports(s),
            folded("The crossings enlarged", &crossings::html(boot)),
            folded("Lines of the log", &tables::log(&boot.log)),
        );
        let body = format!("<div data-clock>\n{body}</div>\n");
        section(&format!("Start {} of {}", n + 1, boots.len()), &body)
    };
    let sections: String = boots.iter().enumerate().map(one).collect();
    let moved = boots.iter().map(|boot| &boot.summary).filter(|s| s.moving_s > 0.0);
    let grade = moved.map(Grade::of).max_by_key(|grade| *grade as u8).map_or("fair", Grade::name);
    let title = boots.last().map_or_else(String::new, |boot| origin(&boot.summary));
    let headline = format!("{} starts of the controller, each on its own clock", boots.len());
    page_of(&title, grade, &headline, &sections)
}

/// A page of its own: title, grade (`good`, `fair`, `bad`), headline and sections.
pub fn page_of(title: &str, grade: &str, headline: &str, body: &str) -> String {
    let (title, headline) = (escape(title), escape(headline));
    head(&title)
        + &format!(
            "<header class=\"{grade}\">\n<p class=\"what\">interstage · {title}</p>\n\
<h1>{headline}</h1>\n</header>\n{body}"
        )
        + &end("", "")
}

/// The end of a page: the plots' script between its data and other scripts.
pub(super) fn end(data: &str, others: &str) -> String {
    format!("</main>\n{data}<script>\n{PLOTS}</script>\n{others}</body>\n</html>\n")
}

/// Times and positions, by which the cursors of plots over either go together.
fn track(recording: &Recording) -> String {
    let rows = &recording.rows;
    let part = rows.iter().step_by(rows.len() / 2000 + 1);
    let pairs = part.map(|row| (row.controller.t_s, row.position_mm()));
    let pairs = pairs.filter(|pair| pair.1.is_finite());
    let pairs: Vec<String> = pairs.map(|(t, x)| format!("[{t:.3},{x:.3}]")).collect();
    let pairs = pairs.join(",");
    format!("<script type=\"application/json\" id=\"track\">[{pairs}]</script>\n")
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

pub(super) fn folded(title: &str, body: &str) -> String {
    format!("<details>\n<summary>{title}</summary>\n{body}</details>\n")
}

/// The plots over time and over position, one of the two shown.
fn plots(recording: &Recording) -> String {
    if recording.rows.is_empty() {
        return "<p>No rows were recorded.</p>\n".to_owned();
    }
    let time = stack(recording, Across::Time);
    let position = stack(recording, Across::Position);
    let s = &recording.summary;
    let from = s.duration_s.map_or_else(String::new, |duration_s| {
        format!(" The preload carries the wheel from {:.2} s.", duration_s - s.moving_s)
    });
    let commanded = s.commanded_s.is_some();
    let zero = if commanded { "the command" } else { "the start of the controller" };
    format!(include_str!("run.html"), time = time, position = position, zero = zero, from = from)
}

fn stack(recording: &Recording, across: Across) -> String {
    let view = View::new(recording, across);
    let mut html = String::new();
    let panels = view.all().into_iter().chain([band::panel(&view)]);
    for panel in panels.filter(Panel::has_data) {
        let name = format!("{}, {}", panel.title, across.name());
        html += &figure(&panel, across, SIZE, &name);
    }
    html
}

/// A text with a capital at its beginning.
pub(crate) fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}
