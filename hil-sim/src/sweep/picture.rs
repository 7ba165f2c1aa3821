//! A sweep as a picture: each figure over the first key that has numbers, a line for each
//! combination of the others.

use serde_json::{Map, Value};

use super::Axis;
use crate::report::axis;
use crate::report::palette;
use crate::report::panel::{Line, Look, Panel, sheet};
use crate::scenario::brief;

/// A figure of the rows that is plotted.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plot {
    /// Its name in the rows.
    pub column: &'static str,
    pub title: &'static str,
    /// Name of its axis, with the unit.
    pub y_name: &'static str,
}

/// The picture as SVG; none if no key has numbers.
pub(crate) fn picture(
    axes: &[Axis],
    rows: &[Map<String, Value>],
    plots: &[Plot],
) -> Option<String> {
    let is_numeric = |axis: &&Axis| axis.values.iter().all(|value| value.parse::<f64>().is_ok());
    let x = axes.iter().find(is_numeric)?;
    let others: Vec<&Axis> = axes.iter().filter(|axis| axis.key != x.key).collect();
    let group = |row: &Map<String, Value>| {
        let parts = others.iter().map(|axis| format!("{} = {}", axis.key, brief(&row[&axis.key])));
        parts.collect::<Vec<_>>().join(", ")
    };
    let mut names: Vec<String> = rows.iter().map(group).collect();
    let mut seen = std::collections::HashSet::new();
    names.retain(|name| seen.insert(name.clone()));
    let number = |row: &Map<String, Value>, key: &str| row[key].as_f64().unwrap_or(f64::NAN);
    let range = axis::padded(axis::extent(rows.iter().map(|row| number(row, &x.key)))?, 0.02);
    let panel = |plot: &Plot| {
        let line = |(place, name): (usize, &String)| {
            let own = rows.iter().filter(|row| group(row) == *name);
            let mut points: Vec<(f64, f64)> =
                own.map(|row| (number(row, &x.key), number(row, plot.column))).collect();
            points.sort_by(|a, b| a.0.total_cmp(&b.0));
            let name = if name.is_empty() { plot.title } else { name };
            let look = Look::Other(palette::SERIES[1..][place % 6], 2.0);
            Line { name: name.to_owned(), look, points }
        };
        let lines: Vec<Line> = names.iter().enumerate().map(line).collect();
        Panel {
            title: plot.title.to_owned(),
            y_name: plot.y_name.to_owned(),
            x_name: x.key.clone(),
            x: range,
            // A value between two failed runs has no line.
            marks: lines.iter().map(Line::dots).collect(),
            lines,
            ..Panel::default()
        }
    };
    Some(sheet(plots.iter().map(panel).collect(), 1, names.len() > 1))
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn a_run_that_failed_has_no_duration_and_a_lone_value_a_dot() {
        let axis =
            Axis { key: "x".to_owned(), values: ["1", "2", "3"].map(str::to_owned).to_vec() };
        let row = |x: u8, completed: bool| {
            let row = json!({ "x": x, "duration_s": completed.then_some(x) });
            row.as_object().cloned().unwrap_or_default()
        };
        let plot = Plot { column: "duration_s", title: "Duration", y_name: "duration, s" };
        let svg = picture(&[axis], &[row(1, false), row(2, true), row(3, false)], &[plot]).unwrap();
        assert!(svg.contains("d=\"M220 78h0\""), "{svg}");
    }
}
