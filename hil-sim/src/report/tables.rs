//! The tables of the page.

use super::svg::escape;
use crate::record::{CrossingLine, LogLine, Report, Summary};

/// What has no value.
const NONE: &str = "–";

/// `value` with `decimals`; a dash if it is missing or no number.
pub(super) fn number(value: impl Into<Option<f64>>, decimals: usize) -> String {
    let value = value.into().filter(|value| value.is_finite());
    value.map_or(NONE.to_owned(), |value| format!("{value:.decimals$}"))
}

/// The summary as pairs.
pub(super) fn summary(s: &Summary) -> String {
    let pairs = [
        ("Completed", if s.completed { "yes" } else { "no" }.to_owned()),
        ("Target", s.target.clone()),
        ("Controller", s.controller.clone()),
        ("Direction", s.direction.clone()),
        ("Rig", s.rig.clone()),
        ("Seed", s.seed.to_string()),
        ("Duration", number(s.duration_s, 3) + " s"),
        ("From boot to end", number(s.total_s, 3) + " s"),
        ("Travel", number(s.travel_mm, 2) + " mm"),
        ("Worst gap", number(s.max_gap_mm, 4) + " mm"),
        ("Reference gap", number(s.gap_ref_mm, 4) + " mm"),
        ("Gross slip", number(s.slip_mm, 3) + " mm"),
        ("Mean preload", number(s.mean_preload_n, 2) + " N"),
        ("Drive energy", number(s.energy_j, 3) + " J"),
        ("Friction work", number(s.wear_j, 3) + " J"),
        ("Real-time factor", number(s.real_time_factor, 1)),
    ];
    let cells: String = pairs
        .iter()
        .map(|(name, value)| format!("<div><dt>{name}</dt><dd>{}</dd></div>\n", escape(value)))
        .collect();
    format!("<dl>\n{cells}</dl>\n")
}

/// The ledger of the crossings.
pub(super) fn ledger(crossings: &[CrossingLine]) -> String {
    const HEAD: &str = "<table class=\"ledger\">\n<thead>\n<tr><th rowspan=2>step</th>\
<th colspan=3>gap, mm</th><th colspan=2>preload, N</th><th rowspan=2>lead<br>s</th>\
<th rowspan=2>speed<br>mm/s</th><th rowspan=2>slip<br>mm</th><th rowspan=2>corner<br>N</th>\
<th rowspan=2>friction<br>used</th><th colspan=2>step position, mm</th></tr>\n\
<tr><th>true</th><th>predicted</th><th>measured</th><th>at lift</th><th>peak</th>\
<th>true</th><th>found</th></tr>\n</thead>\n<tbody>\n";
    if crossings.is_empty() {
        return "<p>No step was crossed.</p>\n".to_owned();
    }
    let rows: String = crossings.iter().map(ledger_row).collect();
    format!("{HEAD}{rows}</tbody>\n</table>\n")
}

fn ledger_row(c: &CrossingLine) -> String {
    let cells = [
        c.index.to_string(),
        number(c.gap_mm, 4),
        against(c.gap_predicted_mm, c.gap_mm),
        against(c.gap_measured_mm, c.gap_mm),
        number(c.preload_n, 2),
        number(c.peak_preload_n, 2),
        number(c.lead_time_s, 3),
        number(c.speed_mm_s, 2),
        number(c.slip_mm, 3),
        number(c.corner_force_n, 1),
        number(c.peak_utilisation, 2),
        number(c.step_mm, 3),
        number(c.step_found_mm, 3)
            + &error(c.step_found_mm, c.step_mm, |error| format!("{:+.0} µm", 1e3 * error)),
    ];
    let cells: String = cells.iter().map(|cell| format!("<td>{cell}</td>")).collect();
    format!("<tr>{cells}</tr>\n")
}

/// A gap with its error against the true one.
fn against(gap_mm: Option<f64>, true_mm: f64) -> String {
    let show = |error| format!("{:+.0} µm, {:+.1} %", 1e3 * error, 100.0 * error / true_mm);
    number(gap_mm, 4) + &error(gap_mm, true_mm, show)
}

/// The error of `value` in small print, if there is a value and a true one.
fn error(value: Option<f64>, true_value: f64, show: impl Fn(f64) -> String) -> String {
    let error = value.map(|value| value - true_value).filter(|error| error.is_finite());
    error.map_or(String::new(), |error| format!("<small>{}</small>", show(error)))
}

/// Faults and limits, in the order of time.
pub(super) fn reports(s: &Summary) -> String {
    let mut all: Vec<(&str, &Report)> = s.faults.iter().map(|r| ("fault", r)).collect();
    all.extend(s.limits.iter().map(|r| ("limit", r)));
    all.sort_by(|a, b| a.1.t_s.total_cmp(&b.1.t_s));
    let injected =
        s.injected.iter().map(|fault| format!("<p>Brought about: {}.</p>\n", escape(fault)));
    let injected: String = injected.collect();
    if all.is_empty() {
        return injected + "<p>No fault, no limit.</p>\n";
    }
    let rows: String = all
        .iter()
        .map(|(kind, r)| {
            format!(
                "<tr class={kind}><td>{:.3} s</td><td>{kind} {}</td><td>{}</td></tr>\n",
                r.t_s,
                r.code,
                escape(&r.text)
            )
        })
        .collect();
    format!("{injected}<table class=\"lines\">\n{rows}</table>\n")
}

/// The log.
pub(super) fn log(lines: &[LogLine]) -> String {
    if lines.is_empty() {
        return "<p>The log is empty.</p>\n".to_owned();
    }
    let rows: String = lines
        .iter()
        .map(|line| format!("<tr><td>{:.3} s</td><td>{}</td></tr>\n", line.t_s, escape(&line.text)))
        .collect();
    format!("<table class=\"lines\">\n{rows}</table>\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::example;

    #[test]
    fn errors_stand_beside_the_gaps() {
        assert_eq!(against(Some(1.55), 1.5), "1.5500<small>+50 µm, +3.3 %</small>");
        assert_eq!(against(None, 1.5), NONE);
        assert_eq!(against(Some(1.55), f64::NAN), "1.5500");
    }

    #[test]
    fn log_text_cannot_become_markup() {
        let line = LogLine { t_s: 1.0, text: "<script>".into() };
        assert!(log(&[line]).contains("&lt;script&gt;"));
    }

    #[test]
    fn what_was_brought_about_is_named_before_what_was_found() {
        let mut summary = example::faulted().summary;
        summary.injected = vec!["load-cell stuck from 2 s".to_owned()];
        let text = reports(&summary);
        assert!(text.starts_with("<p>Brought about: load-cell stuck from 2 s.</p>"), "{text}");
        assert!(text.contains("fault 121"));
    }

    #[test]
    fn faults_and_limits_stand_in_order_of_time() {
        let html = reports(&example::faulted().summary);
        assert!(html.find("limit 201").unwrap() < html.find("fault 121").unwrap());
        assert!(html.contains("limit &amp; speed"));
        assert!(reports(&Summary::default()).contains("No fault"));
    }
}
