//! The tables of the page, and the columns of the crossings' ledger, for page, terminal and
//! comparison.

use interstage::model::LimitedBy;

use super::svg::escape;
use crate::record::{CrossingLine, LogLine, Report, Summary};
use crate::table::{number, signed};

/// A table as HTML, without a head if that is empty; the cells are HTML already.
pub(crate) fn table(class: &str, head: &[String], rows: Vec<Vec<String>>) -> String {
    let cells = |tag: &str, cells: &[String]| -> String {
        let cells: String = cells.iter().map(|cell| format!("<{tag}>{cell}</{tag}>")).collect();
        format!("<tr>{cells}</tr>\n")
    };
    let head = if head.is_empty() { String::new() } else { cells("th", head) };
    let rows: String = rows.iter().map(|row| cells("td", row)).collect();
    format!(
        "<table class=\"{class}\">\n<thead>\n{head}</thead>\n<tbody>\n{rows}</tbody>\n</table>\n"
    )
}

/// The summary as pairs.
pub(super) fn summary(s: &Summary) -> String {
    let pairs = [
        ("Direction", s.direction.clone()),
        (
            if s.completed { "From command to arrival" } else { "From command to end" },
            with_unit(s.duration_s, 3, "s"),
        ),
        ("In motion", with_unit(s.moving_s, 3, "s")),
        ("From boot to end", with_unit(s.total_s, 3, "s")),
        ("Travel", with_unit(s.travel_mm, 2, "mm")),
        ("Position at the end, one sigma", with_unit(s.position_sigma_mm, 2, "mm")),
        (
            if s.measured { "Worst measured gap" } else { "Worst gap" },
            with_unit(s.max_gap_mm, 4, "mm"),
        ),
        ("Reference gap", with_unit(s.gap_ref_mm, 4, "mm")),
        (if s.measured { "Measured slip" } else { "Gross slip" }, with_unit(s.slip_mm, 3, "mm")),
        ("Mean preload", with_unit(s.mean_preload_n, 2, "N")),
        ("Drive energy", with_unit(s.energy_j, 3, "J")),
        ("Friction work", with_unit(s.friction_work_j, 3, "J")),
    ];
    let cells: String = pairs
        .iter()
        .filter(|(_, value)| !value.is_empty())
        .map(|(name, value)| format!("<div><dt>{name}</dt><dd>{}</dd></div>\n", escape(value)))
        .collect();
    let lost = s.lost.as_ref().map(|lost| format!("<p>{}.</p>\n", lost.sentence()));
    format!("<dl>\n{cells}</dl>\n{}", lost.unwrap_or_default())
}

/// A value with its unit; empty if it is not known.
fn with_unit(value: impl Into<Option<f64>>, decimals: usize, unit: &str) -> String {
    let value = value.into().filter(|value| value.is_finite());
    value.map_or_else(String::new, |value| format!("{} {unit}", number(value, decimals)))
}

pub(super) fn crossings(crossings: &[CrossingLine]) -> String {
    if crossings.is_empty() {
        return "<p>No crossing is complete in the log.</p>\n".to_owned();
    }
    let names = COLUMNS.iter().map(|column| format!("{}<br>{}", column.title, column.unit));
    let head = std::iter::once("step".to_owned()).chain(names).chain(["slowed<br>by".to_owned()]);
    let head: Vec<String> = head.collect();
    let rows = crossings.iter().map(|line| {
        let cells = COLUMNS.iter().map(|column| cell(column, line));
        let by = slowed_by(line).to_owned();
        std::iter::once(line.index.to_string()).chain(cells).chain([by]).collect()
    });
    table("ledger", &head, rows.collect())
}

/// A value, with its error in small print if there is a true one.
fn cell(column: &Column, line: &CrossingLine) -> String {
    let value = (column.of)(line);
    let error = column.truth.zip(value).map(|((truth, show), value)| {
        let truth = truth(line);
        if truth.is_finite() { show(value - truth, truth) } else { String::new() }
    });
    let error = error.filter(|text| !text.is_empty());
    number(value, column.decimals)
        + &error.map_or_else(String::new, |text| format!("<small>{text}</small>"))
}

/// Faults and limits, in the order of time.
pub(super) fn reports(s: &Summary) -> String {
    let mut all: Vec<(&str, &Report)> = s.faults.iter().map(|r| ("fault", r)).collect();
    all.extend(s.limits.iter().map(|r| ("limit", r)));
    all.sort_by(|a, b| a.1.t_s.total_cmp(&b.1.t_s));
    let injected = s.injected.iter().map(|fault| format!("<p>Injected: {}.</p>\n", escape(fault)));
    let injected: String = injected.collect();
    if all.is_empty() {
        return injected + "<p>No fault (code 101 to 160), no limit (code from 200).</p>\n";
    }
    let rows = all.iter().map(|(kind, r)| {
        vec![
            format!("{} s", number(r.t_s, 3)),
            format!("<b class={kind}>{kind} {}</b>", r.code),
            escape(&r.text),
        ]
    });
    injected + &table("lines", &[], rows.collect())
}

pub(super) fn log(lines: &[LogLine]) -> String {
    if lines.is_empty() {
        return "<p>The log is empty.</p>\n".to_owned();
    }
    let rows =
        lines.iter().map(|line| vec![format!("{} s", number(line.t_s, 3)), escape(&line.text)]);
    table("lines", &[], rows.collect())
}

/// The true value that a column is compared with, and the error as text.
type Truth = (fn(&CrossingLine) -> f64, fn(f64, f64) -> String);

pub(crate) struct Column {
    pub(crate) name: &'static str,
    /// Its name in tables, as that in plots.
    pub(crate) title: &'static str,
    pub(crate) unit: &'static str,
    pub(crate) decimals: usize,
    pub(crate) of: fn(&CrossingLine) -> Option<f64>,
    /// The true value of a prediction or measurement, and the error as text.
    pub(crate) truth: Option<Truth>,
    /// Shown on a terminal without -v: it has no room for all.
    pub(crate) on_terminal: bool,
}

impl Column {
    const fn new(
        name: &'static str,
        unit: &'static str,
        decimals: usize,
        of: fn(&CrossingLine) -> Option<f64>,
    ) -> Self {
        Self { name, title: name, unit, decimals, of, truth: None, on_terminal: true }
    }

    /// Compared with the true gap.
    const fn of_gap(self, title: &'static str) -> Self {
        let error = |error, truth| {
            format!("{} µm, {} %", signed(1e3 * error, 0), signed(100.0 * error / truth, 1))
        };
        Self { title, truth: Some((|c| c.gap_mm, error)), ..self }
    }

    const fn off_terminal(self) -> Self {
        Self { on_terminal: false, ..self }
    }
}

/// All of them, after the step's number.
pub(crate) const COLUMNS: [Column; 13] = [
    Column::new("gap", "mm", 3, |c| Some(c.gap_mm)),
    Column::new("predicted", "mm", 3, |c| c.gap_predicted_mm)
        .of_gap("gap, predicted")
        .off_terminal(),
    Column::new("measured", "mm", 3, |c| c.gap_measured_mm).of_gap("gap, measured"),
    Column::new("speed", "mm/s", 2, |c| Some(c.speed_mm_s)),
    Column::new("preload", "N", 2, |c| Some(c.preload_n)),
    Column::new("peak preload", "N", 2, |c| Some(c.peak_preload_n)).off_terminal(),
    Column::new("peak corner", "N", 1, |c| Some(c.corner_force_n)).off_terminal(),
    Column::new("friction used", "", 2, |c| Some(c.peak_utilisation)).off_terminal(),
    Column::new("lead", "s", 2, |c| c.lead_time_s),
    Column::new("slip", "mm", 2, |c| Some(c.slip_mm)).off_terminal(),
    Column::new("step at", "mm", 2, |c| Some(c.step_mm)),
    Column {
        truth: Some((|c| c.step_mm, |error, _| format!("{} µm", signed(1e3 * error, 0)))),
        ..Column::new("found at", "mm", 2, |c| c.step_found_mm).off_terminal()
    },
    Column::new("touch to lift", "s", 3, |c| Some((c.lift_s - c.touch_s).abs())).off_terminal(),
];

/// What kept a crossing from being faster, in words.
pub(crate) fn slowed_by(line: &CrossingLine) -> &'static str {
    match line.limited_by {
        None => "-",
        Some(LimitedBy::Preload) => "preload limit",
        Some(LimitedBy::Slew) => "preload slew",
        Some(LimitedBy::Friction) => "low friction",
        Some(LimitedBy::Resonance) => "resonance",
        Some(LimitedBy::LeastSpeed) => "least speed",
        Some(LimitedBy::Drive) => "drive speed",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::example;

    #[test]
    fn errors_are_shown_beside_the_gaps() {
        let line = CrossingLine { gap_mm: 1.5, ..CrossingLine::default() };
        let measured = &COLUMNS[2];
        let show = |gap_mm, gap_measured_mm| {
            cell(measured, &CrossingLine { gap_mm, gap_measured_mm, ..line })
        };
        assert_eq!(show(1.5, Some(1.55)), "1.550<small>+50 µm, +3.3 %</small>");
        assert_eq!((show(1.5, None), show(f64::NAN, Some(1.55))), ("-".into(), "1.550".into()));
    }

    #[test]
    fn what_is_not_known_is_left_out_of_the_summary() {
        let known = Summary { max_gap_mm: 2.5, ..Summary::default() };
        assert!(summary(&known).contains("<dd>2.5000 mm</dd>"), "{}", summary(&known));
        assert!(summary(&Summary { duration_s: Some(11.0), ..known.clone() }).contains("to end<"));
        let unknown = summary(&Summary { max_gap_mm: f64::NAN, energy_j: f64::NAN, ..known });
        for part in ["Worst gap", "Drive energy", "<dd>-"] {
            assert!(!unknown.contains(part), "{part} in {unknown}");
        }
    }

    #[test]
    fn log_text_cannot_become_markup() {
        let line = LogLine { t_s: 1.0, text: "<script>".into() };
        assert!(log(&[line]).contains("&lt;script&gt;"));
    }

    #[test]
    fn what_was_injected_comes_first_then_faults_and_limits_in_the_order_of_time() {
        let mut summary = example::faulted().summary;
        summary.injected = vec!["preload-sensor stuck from 2 s".to_owned()];
        let html = reports(&summary);
        assert!(html.starts_with("<p>Injected: preload-sensor stuck from 2 s.</p>"), "{html}");
        assert!(html.find("limit 201").unwrap() < html.find("fault 121").unwrap());
        assert!(html.contains("limit &amp; speed"));
        assert!(reports(&Summary::default()).contains("No fault"));
    }
}
