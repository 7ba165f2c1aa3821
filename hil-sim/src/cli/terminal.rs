//! A run on the terminal: verdict, ledger, faults, limits and the paths of its files.

use std::io::IsTerminal;
use std::path::PathBuf;

use comfy_table::Table;

use super::output::wrote;
use crate::record::{CrossingLine, Report, Summary};
use crate::report::verdict::{Grade, gap_sentence, headline, origin, slip_sentence, verdict};
use crate::report::{COLUMNS, slowed_by};
use crate::table::{number, plain, wrapped};

/// Most columns of a run's text.
const WIDTH: u16 = 80;

/// The run of `summary` as text, with the paths of `files` at the end; `all` columns of the
/// crossings or those that matter most. Ends with a line feed.
pub fn run(summary: &Summary, files: &[PathBuf], all: bool) -> String {
    let mut text =
        painted(&wrapped(&headline(summary), "", WIDTH), Grade::of(summary), is_coloured());
    for missing in &summary.missing {
        text += &wrapped(&format!("incomplete log: {missing}"), "  ", WIDTH);
    }
    let speed = (!summary.measured)
        .then(|| format!("simulated at {:.0} times real time", summary.real_time_factor));
    text += &wrapped(&details(summary, speed), "  ", WIDTH);
    if !summary.crossings.is_empty() {
        text += &format!("{}\n", ledger(&summary.crossings, all));
    }
    if let Some(lost) = &summary.lost {
        text += &wrapped(&lost.sentence(), "  ", WIDTH);
    }
    for fault in &summary.injected {
        text += &wrapped(&format!("injected: {fault}"), "  ", WIDTH);
    }
    for (kind, reports) in [("fault", &summary.faults), ("limit", &summary.limits)] {
        for report in reports {
            text += &wrapped(&report_line(kind, report, summary.commanded_s), "  ", WIDTH);
        }
    }
    text + &wrote(files)
}

/// One of two runs that are compared, by its letter and its log: outcome, verdict and origin.
pub(crate) fn one_of_two(letter: char, log: &str, summary: &Summary) -> String {
    let headline = wrapped(&format!("{letter}: {}", headline(summary)), "", WIDTH);
    painted(&headline, Grade::of(summary), is_coloured())
        + &wrapped(&details(summary, Some(log.to_owned())), "  ", WIDTH)
}

/// Whether standard output shows colours: a terminal, unless `NO_COLOR` is set.
fn is_coloured() -> bool {
    std::io::stdout().is_terminal() && std::env::var_os("NO_COLOR").is_none_or(|no| no.is_empty())
}

/// The lines of `text` in the colour of the grade.
fn painted(text: &str, grade: Grade, is_coloured: bool) -> String {
    if !is_coloured {
        return text.to_owned();
    }
    text.lines().map(|line| format!("\u{1b}[{}m{line}\u{1b}[0m\n", grade.ansi())).collect()
}

/// Verdict, gap, slip and origin as far as there is something to say, and what is given.
fn details(s: &Summary, more: Option<String>) -> String {
    let parts = [verdict(s), gap_sentence(s), slip_sentence(s), origin(s)].into_iter().chain(more);
    parts.filter(|part| !part.is_empty()).collect::<Vec<_>>().join("; ")
}

/// A row a crossing; with `all` quantities a row each.
fn ledger(crossings: &[CrossingLine], all: bool) -> Table {
    let columns = || COLUMNS.iter().filter(|column| all || column.on_terminal);
    let (between, by) = if all { (", ", "slowed by") } else { ("\n", "slowed\nby") };
    let names = columns().map(|c| format!("{}{between}{}", c.title.replace(", ", between), c.unit));
    let names = names.map(|name| name.trim_end_matches(between).to_owned());
    let head = std::iter::once("step".to_owned()).chain(names).chain([by.to_owned()]);
    let rows = crossings.iter().map(|line| {
        let cells = columns().map(|column| number((column.of)(line), column.decimals));
        let by = slowed_by(line).to_owned();
        std::iter::once(line.index.to_string()).chain(cells).chain([by]).collect()
    });
    let mut lines: Vec<Vec<String>> = std::iter::once(head.collect()).chain(rows).collect();
    if all {
        lines = (0..lines[0].len())
            .map(|quantity| lines.iter().map(|line| line[quantity].clone()).collect())
            .collect();
    }
    let mut table = plain(&lines[0], lines[1..].iter().cloned());
    table.set_width(WIDTH);
    table
}

/// A fault or a limit, its time from the command as on the page; from the start without one.
fn report_line(kind: &str, report: &Report, commanded_s: Option<f64>) -> String {
    let at_s = report.t_s - commanded_s.unwrap_or(0.0);
    format!("{kind} {} at {} s: {}", report.code, number(at_s, 3), report.text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::example;

    #[test]
    fn nothing_is_wider_than_the_terminal() {
        for recording in [example::deploy(), example::faulted()] {
            let [text, all] = [false, true].map(|all| run(&recording.summary, &[], all));
            for line in text.lines().chain(all.lines()) {
                assert!(line.chars().count() <= usize::from(WIDTH), "{line}");
            }
        }
    }

    #[test]
    fn a_ledger_line_and_the_files_of_a_folder_take_one_line_each() {
        let summary = example::deploy().summary;
        let text = run(&summary, &[PathBuf::from("out/run/report.html")], false);
        let c = &summary.crossings[1];
        // By its number: a gap may equal another crossing's prediction.
        let number = c.index.to_string();
        let mut lines = text.lines();
        let first = |line: &&str| line.split_whitespace().next() == Some(number.as_str());
        let line = lines.find(first).expect(&text);
        assert!(line.contains(&format!(" {:.3} ", c.gap_mm)), "{line}");
        assert!(line.contains(&format!(" {:.2} ", c.step_mm)), "{line}");
        assert!(line.contains(" - "), "the missing measurement is shown: {line}");
        assert!(text.contains(" measured "), "no heading is broken: {text}");
        let words = ["preload limit", "preload slew"];
        assert!(words.iter().any(|words| line.contains(words)), "{line}");
        assert!(!text.contains(" predicted"));
        assert!(run(&summary, &[], true).contains("\n gap, predicted, mm "), "a row each");
        assert!(text.ends_with("  wrote out/run/report.html\n"));
        let files = ["report.html", "log.csv"].map(|name| PathBuf::from("out/run").join(name));
        assert!(run(&summary, &files, false).ends_with("/: report.html, log.csv\n"));
    }

    #[test]
    fn the_headline_has_the_colour_of_its_grade_on_a_terminal() {
        for (grade, colour) in [(Grade::Good, 32), (Grade::Fair, 33), (Grade::Bad, 31)] {
            assert_eq!(painted("a\n", grade, false), "a\n");
            assert_eq!(painted("a\n", grade, true), format!("\u{1b}[{colour}ma\u{1b}[0m\n"));
        }
    }

    #[test]
    fn faults_and_limits_are_listed() {
        let summary = example::faulted().summary;
        let text = run(&summary, &[], false);
        assert!(text.starts_with("Did not complete: fault 121"));
        let from_command_s = summary.faults[0].t_s - summary.commanded_s.expect("a command");
        assert!(text.contains(&format!("  fault 121 at {from_command_s:.3} s: ")), "{text}");
        assert!(text.contains("  limit 201 at "));
    }
}
