//! Two runs side by side: crossing by crossing, and in the same plots over time.

use std::collections::{BTreeMap, BTreeSet};

use super::page::{SIZE, end, folded, head, section};
use super::palette::{self, Colour};
use super::panel::{Line, Look, Marks, Panel, Shape, sheet};
use super::panels::{Across, View, figure};
use super::svg::escape;
use super::tables::{COLUMNS, Column};
use super::verdict::{Grade, gap_sentence, headline, origin, verdict};
use super::{axis, tables};
use crate::record::{CrossingLine, Recording, Row};
use crate::scenario::{brief, leaves};
use crate::table::number;

/// A difference between the two runs at a crossing.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub(crate) struct Difference {
    /// Step number.
    pub index: u8,
    pub quantity: &'static str,
    #[serde(skip)]
    pub title: &'static str,
    pub unit: &'static str,
    #[serde(skip)]
    pub decimals: usize,
    /// In the first run.
    pub a: Option<f64>,
    /// In the second.
    pub b: Option<f64>,
    /// Second minus first.
    pub change: Option<f64>,
}

/// Every quantity of a crossing in either run; crossings of one step are paired in their order.
pub(crate) fn differences(a: &Recording, b: &Recording) -> Vec<Difference> {
    let mut all = Vec::new();
    for (index, a, b) in pairs(a, b) {
        for Column { name: quantity, title, unit, decimals, of, .. } in COLUMNS {
            let value =
                |line: Option<&CrossingLine>| line.and_then(of).filter(|value| value.is_finite());
            let (a, b) = (value(a), value(b));
            if a.is_some() || b.is_some() {
                let change = a.zip(b).map(|(a, b)| b - a);
                all.push(Difference { index, quantity, title, unit, decimals, a, b, change });
            }
        }
    }
    all
}

/// A step's crossing in either run.
type Pair<'a> = (u8, Option<&'a CrossingLine>, Option<&'a CrossingLine>);

fn pairs<'a>(a: &'a Recording, b: &'a Recording) -> Vec<Pair<'a>> {
    let mut left: Vec<&CrossingLine> = b.summary.crossings.iter().collect();
    let mut pairs = Vec::new();
    for line in &a.summary.crossings {
        let place = left.iter().position(|other| other.index == line.index);
        pairs.push((line.index, Some(line), place.map(|place| left.remove(place))));
    }
    pairs.extend(left.into_iter().map(|line| (line.index, None, Some(line))));
    pairs
}

/// The page of two runs with their names, each on the time since its command.
pub(crate) fn compare_html(
    (name_a, a): (&str, &Recording),
    (name_b, b): (&str, &Recording),
) -> String {
    let (a, b) = (&a.since_command(), &b.since_command());
    let mut page = head("two runs");
    for (letter, name, run) in [("A", name_a, a), ("B", name_b, b)] {
        let sentences = [verdict(&run.summary), gap_sentence(&run.summary)];
        let sentence = sentences.join("; ");
        let sentence = sentence.trim_start_matches("; ");
        page += &format!(
            "<header class=\"{}\">\n<p class=\"what\">{letter}: {} · {}</p>\n<h1>{}</h1>\n\
<p>{}</p>\n</header>\n",
            Grade::of(&run.summary).name(),
            escape(name),
            escape(&origin(&run.summary)),
            escape(&headline(&run.summary)),
            escape(sentence),
        );
    }
    page += &section("Parameters that differ", &parameters(a, b));
    let all = differences(a, b);
    let (first, rest): (Vec<_>, Vec<_>) = all.into_iter().partition(|one| {
        COLUMNS.iter().any(|column| column.on_terminal && column.name == one.quantity)
    });
    let ledger = |rows: &[Difference]| {
        let (head, rows) = table(rows);
        tables::table("ledger pairs", &head, rows)
    };
    let more = folded("The other quantities", &ledger(&rest));
    page += &section("Crossing by crossing", &(ledger(&first) + &more));
    let plots: String = panels(&[("A", a), ("B", b)])
        .iter()
        .rev()
        .map(|panel| figure(panel, Across::Time, SIZE, &panel.title))
        .collect();
    page += &section("Over time from the command", &plots);
    page + &end("", "")
}

/// The keys in which the parameters of two runs differ, with both values.
fn parameters(a: &Recording, b: &Recording) -> String {
    let [a, b] = [a, b].map(|run| run.parameters.parse::<toml::Table>().unwrap_or_default());
    let [a, b] = [&a, &b].map(|table| BTreeMap::from_iter(leaves(table)));
    let keys: BTreeSet<&String> = a.keys().chain(b.keys()).collect();
    let shown = |value: Option<&&toml::Value>| {
        value.map_or_else(|| "-".to_owned(), |value| escape(&brief(&serde_json::json!(value))))
    };
    let differ = keys.into_iter().filter(|key| a.get(*key) != b.get(*key));
    let rows: Vec<_> =
        differ.map(|key| vec![escape(key), shown(a.get(key)), shown(b.get(key))]).collect();
    if rows.is_empty() {
        return "<p>None: both runs have the same parameters.</p>\n".to_owned();
    }
    tables::table("lines", &["key", "A", "B"].map(str::to_owned), rows)
}

/// The differences as a table's head and rows.
pub(crate) fn table(differences: &[Difference]) -> (Vec<String>, Vec<Vec<String>>) {
    let head = ["step", "quantity", "A", "B", "B - A"].map(str::to_owned).to_vec();
    let rows = differences.iter().map(|one| {
        let Difference { index, title, unit, decimals, a, b, change, .. } = one;
        let [a, b, change] = [a, b, change].map(|value| number(*value, *decimals));
        let unit = if unit.is_empty() { String::new() } else { format!(", {unit}") };
        vec![index.to_string(), format!("{title}{unit}"), a, b, change]
    });
    (head, rows.collect())
}

/// Colours of up to three, widths of their lines, CSS pixels, and marks: all are seen at one place.
const LOOKS: [(Colour, f64, Shape); 3] = [
    (palette::PRELOAD, 4.5, Shape::Ring),
    (palette::SPEED, 2.5, Shape::Square),
    (palette::GAP, 1.2, Shape::Dot),
];

/// The picture of up to three runs with their names: preload, position, slip and gap.
pub(crate) fn beside_svg(runs: &[(String, &Recording)]) -> String {
    let own: Vec<_> = runs.iter().map(|(name, run)| (&**name, run.since_command())).collect();
    let own: Vec<_> = own.iter().map(|(name, run)| (*name, run)).collect();
    sheet(panels(&own), 1, true)
}

/// Gap, preload, speed, position and slip of runs with their names, each since its command.
fn panels(runs: &[(&str, &Recording)]) -> Vec<Panel> {
    let views: Vec<_> = runs.iter().map(|(_, run)| View::new(run, Across::Time)).collect();
    let ends = views.iter().map(|view| view.x);
    let x = ends.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))).unwrap_or_default();
    let line = |of: &dyn Fn(&Row) -> f64| -> Vec<Line> {
        let all = views.iter().zip(runs).zip(LOOKS);
        all.map(|((view, (name, _)), (colour, width, _))| {
            view.line((*name).to_owned(), Look::Other(colour, width), of)
        })
        .collect()
    };
    // Where a run ended by a fault.
    let ends = |of: &dyn Fn(&Row) -> f64| {
        let failed = views.iter().filter(|view| !view.recording.summary.faults.is_empty());
        let end = |row: &Row| (row.controller.t_s, of(row));
        let points = failed.filter_map(|view| view.rows.last().map(end)).collect();
        let name = "ended by a fault".into();
        vec![Marks { name, shape: Shape::Dot, colour: palette::LIMIT, points }]
    };
    let panel = |title: &str, y_name, of: &dyn Fn(&Row) -> f64| Panel {
        x,
        lines: line(of),
        marks: ends(of),
        shades: Vec::new(),
        rules: Vec::new(),
        ..views[0].panel(title, y_name)
    };
    let mut preload = panel("Preload", "preload, N", &|row| row.controller.preload_n);
    preload.levels = views[0].limit.into_iter().collect();
    let speed = panel("Speed", "speed, mm/s", &|row| {
        row.known(|t| t.speed_true_mm_s, |c| c.wheel_speed_mm_s)
    });
    let position = panel("Position on the sleeve", "position, mm", &Row::position_mm);
    let mut slip = panel("Gross slip of the wheel", "slip, mm", &|row| row.of_truth(|t| t.slip_mm));
    slip.least_span = 2.0;
    let without = views.iter().find(|view| view.recording.summary.gap_ref_mm <= 0.0);
    let gap = Panel { x, ..without.unwrap_or(&views[0]).gap() };
    let all = [preload, speed, position, slip, own_gaps(&views, runs, gap)];
    all.into_iter().filter(Panel::has_data).collect()
}

/// The gap of every crossing, beside the reference of its own run: in mm if a run has none.
fn own_gaps(views: &[View<'_>], runs: &[(&str, &Recording)], mut panel: Panel) -> Panel {
    let is_relative = panel.also.take().is_some();
    panel.y_name = if is_relative { "gap, % of reference" } else { "gap, mm" }.to_owned();
    panel.title = "Gap at the steps".to_owned();
    let all = views.iter().zip(runs).zip(LOOKS);
    panel.marks = all
        .map(|((view, (name, _)), (colour, _, shape))| {
            let summary = &view.recording.summary;
            let one = if is_relative { summary.gap_ref_mm / 100.0 } else { 1.0 };
            let own = |line: &CrossingLine| {
                let gap = Some(line.gap_mm).filter(|gap| gap.is_finite());
                Some((line.lift_s, gap.or(line.gap_measured_mm)? / one))
            };
            let points = summary.crossings.iter().filter_map(own).collect();
            Marks { name: (*name).to_owned(), shape, colour, points }
        })
        .collect();
    (panel.lines, panel.shades, panel.rules) = Default::default();
    let gaps = panel.marks.iter().flat_map(|marks| &marks.points).map(|point| point.1);
    let range = axis::extent(gaps.chain(panel.levels.iter().map(|level| level.2)));
    panel.y = range.map(|range| axis::padded((range.0 - 0.5, range.1 + 0.5), 0.1));
    panel
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::example;

    #[test]
    fn crossings_are_paired_by_their_step() {
        let (a, mut b) = (example::deploy(), example::deploy());
        b.summary.crossings.remove(0);
        b.summary.crossings[0].preload_n += 1.5;
        let all = differences(&a, &b);
        // The second crossing's gap was measured in neither.
        assert_eq!(all.len(), 3 * COLUMNS.len() - 1);
        let at = |index, quantity| {
            all.iter().find(|d| d.index == index && d.quantity == quantity).unwrap()
        };
        assert_eq!((at(1, "gap").b, at(1, "gap").change), (None, None));
        assert!((at(2, "preload").change.unwrap() - 1.5).abs() < 1e-9);
        assert_eq!(at(3, "gap").change, Some(0.0));
    }

    #[test]
    fn the_page_shows_both_runs_with_their_verdicts_and_what_differs() {
        let (a, mut b) = (example::deploy(), example::faulted());
        let page = compare_html(("one.mcap", &a), ("two <2>.mcap", &b));
        assert!(page.contains("A: one.mcap") && page.contains("B: two &lt;2&gt;.mcap"));
        assert!(page.contains("fault 121") && page.contains("B - A"));
        assert!(
            page.contains("<header class=\"good\">") && page.contains("<header class=\"bad\">")
        );
        assert!(page.contains("same parameters"));
        // Gap, slip, position, speed and preload, each since its own command.
        assert_eq!(page.matches("<figure").count(), 5);
        assert!(page.contains("gap, % of reference") && !page.contains("NaN"));
        assert!(page.contains("ended by a fault"));
        b.parameters = b.parameters.replace("limit_n = 50.0", "limit_n = 48.5");
        let page = compare_html(("one.mcap", &a), ("two.mcap", &b));
        let row = "<tr><td>preload.limit_n</td><td>50</td><td>48.5</td></tr>";
        assert_eq!(page.matches(row).count(), 1, "{page}");
    }

    #[test]
    fn both_runs_are_in_every_plot() {
        let (a, b) = (example::deploy(), example::faulted());
        let names = ["scheduled preload", "constant preload", "limit preload"];
        let svg =
            beside_svg(&names.map(str::to_owned).into_iter().zip([&a, &b, &b]).collect::<Vec<_>>());
        for name in names {
            // A line in four plots; the marks, some with rims, in one; one legend.
            assert!([6, 7].contains(&svg.matches(name).count()), "{name}");
        }
        assert!(svg.contains("reference gap") && !svg.contains("NaN"));
        // Each gap is a part of its own run's reference.
        let mut b = a.clone();
        b.summary.gap_ref_mm *= 2.0;
        let marks = panels(&[("A", &a), ("B", &b)]).pop().unwrap().marks;
        assert!((marks[0].points[0].1 - 2.0 * marks[1].points[0].1).abs() < 1e-9);
    }
}
