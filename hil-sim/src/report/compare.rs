//! Two runs side by side, crossing by crossing.

use super::page::{STYLE, section};
use super::palette;
use super::panel::{Line, Look, Panel};
use super::panels::Across;
use super::svg::{self, escape};
use super::tables::number;
use super::verdict::{gap_sentence, headline};
use crate::record::{CrossingLine, Recording, Tick};

/// Size of a plot, CSS pixels.
const SIZE: (u32, u32) = (1100, 240);

/// A quantity of the ledger: name, unit, decimals, value.
type Quantity = (&'static str, &'static str, usize, fn(&CrossingLine) -> Option<f64>);

const QUANTITIES: [Quantity; 12] = [
    ("gap", "mm", 4, |c| Some(c.gap_mm)),
    ("gap measured", "mm", 4, |c| c.gap_measured_mm),
    ("gap predicted", "mm", 4, |c| c.gap_predicted_mm),
    ("speed", "mm/s", 3, |c| Some(c.speed_mm_s)),
    ("preload", "N", 2, |c| Some(c.preload_n)),
    ("peak preload", "N", 2, |c| Some(c.peak_preload_n)),
    ("corner force", "N", 2, |c| Some(c.corner_force_n)),
    ("lead", "s", 3, |c| c.lead_time_s),
    ("slip", "mm", 3, |c| Some(c.slip_mm)),
    ("step found at", "mm", 3, |c| c.step_found_mm),
    ("touch to lift", "s", 3, |c| Some((c.lift_s - c.touch_s).abs())),
    ("touch at", "s", 3, |c| Some(c.touch_s)),
];

/// A difference between the two runs at a crossing.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Difference {
    /// Step number.
    pub index: u8,
    /// Name of the quantity.
    pub quantity: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// In the first run.
    pub a: Option<f64>,
    /// In the second.
    pub b: Option<f64>,
    /// Second minus first.
    pub change: Option<f64>,
}

/// Every quantity that either run has of a crossing; crossings of one step are paired
/// in their order.
#[must_use]
pub fn differences(a: &Recording, b: &Recording) -> Vec<Difference> {
    let mut all = Vec::new();
    for (index, a, b) in pairs(a, b) {
        for (quantity, unit, _, of) in QUANTITIES {
            let value =
                |line: Option<&CrossingLine>| line.and_then(of).filter(|value| value.is_finite());
            let (a, b) = (value(a), value(b));
            if a.is_none() && b.is_none() {
                continue;
            }
            let change = a.zip(b).map(|(a, b)| b - a);
            all.push(Difference { index, quantity, unit, a, b, change });
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

/// The page of two runs, which are called by these names.
#[must_use]
pub fn compare_html((name_a, a): (&str, &Recording), (name_b, b): (&str, &Recording)) -> String {
    let mut page = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
<title>interstage: two runs</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n<main>\n"
    );
    for (letter, name, run) in [("A", name_a, a), ("B", name_b, b)] {
        page += &format!(
            "<header>\n<p class=\"what\">{letter}: {}</p>\n<p><b>{}</b>; {}</p>\n</header>\n",
            escape(name),
            escape(&headline(&run.summary)),
            escape(&gap_sentence(&run.summary)),
        );
    }
    page += &section("Crossing by crossing", &table(&differences(a, b)));
    page += &section("Along the way", &plots(a, b));
    page + "</main>\n</body>\n</html>\n"
}

fn table(differences: &[Difference]) -> String {
    if differences.is_empty() {
        return "<p>Neither run crossed a step.</p>\n".to_owned();
    }
    let mut html = "<table class=\"ledger\">\n<thead>\n<tr><th>step</th><th>quantity</th>\
<th>A</th><th>B</th><th>B - A</th></tr>\n</thead>\n<tbody>\n"
        .to_owned();
    for difference in differences {
        let decimals = QUANTITIES
            .iter()
            .find(|(name, ..)| *name == difference.quantity)
            .map_or(3, |(_, _, decimals, _)| *decimals);
        let change = difference
            .change
            .map_or_else(|| number(None, 0), |change| format!("{change:+.decimals$}"));
        html += &format!(
            "<tr><td>{}</td><td>{}, {}</td><td>{}</td><td>{}</td><td>{change}</td></tr>\n",
            difference.index,
            difference.quantity,
            difference.unit,
            number(difference.a, decimals),
            number(difference.b, decimals),
        );
    }
    html + "</tbody>\n</table>\n"
}

/// A plot: title, name of the axis, what it shows.
type Plot = (&'static str, &'static str, fn(&Tick) -> f64);

fn plots(a: &Recording, b: &Recording) -> String {
    let plots: [Plot; 4] = [
        ("Speed", "speed, mm/s", |row| row.controller.wheel_speed_mm_s),
        ("Preload", "preload, N", |row| row.controller.preload_n),
        ("Tread compression", "compression, mm", |row| row.controller.compression_mm),
        ("Radial position", "radius, mm", |row| row.controller.radius_mm),
    ];
    let mut html = String::new();
    for (title, y_name, of) in plots {
        let line = |name, colour, rows: &[Tick]| Line {
            name,
            look: Look::Other(colour),
            points: rows
                .iter()
                .filter(|row| (5..=9).contains(&row.controller.mode))
                .map(|row| (row.position_mm(), of(row)))
                .collect(),
        };
        let rows = |run: &Recording| Across::Position.range(&run.rows);
        let ((a0, a1), (b0, b1)) = (rows(a), rows(b));
        let panel = Panel {
            title: title.to_owned(),
            y_name,
            x_name: Some(Across::Position.name()),
            x: (a0.min(b0), a1.max(b1)),
            y: None,
            least_span: 0.0,
            lines: vec![line("A", palette::SPEED, &a.rows), line("B", palette::PRELOAD, &b.rows)],
            marks: Vec::new(),
            levels: Vec::new(),
            shades: Vec::new(),
        };
        html += &format!("<figure>{}</figure>\n", svg::fluid(SIZE, title, |area| panel.draw(area)));
    }
    html
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
        assert_eq!(all.len(), 3 * QUANTITIES.len() - 1);
        let at = |index, quantity| {
            all.iter().find(|d| d.index == index && d.quantity == quantity).unwrap()
        };
        assert_eq!((at(1, "gap").b, at(1, "gap").change), (None, None));
        assert!((at(2, "preload").change.unwrap() - 1.5).abs() < 1e-9);
        assert_eq!(at(3, "gap").change, Some(0.0));
    }

    #[test]
    fn the_page_shows_both_runs() {
        let (a, b) = (example::deploy(), example::faulted());
        let page = compare_html(("one.mcap", &a), ("two <2>.mcap", &b));
        assert!(page.contains("A: one.mcap") && page.contains("B: two &lt;2&gt;.mcap"));
        assert!(page.contains("fault 121") && page.contains("B - A"));
        assert_eq!(page.matches("<svg").count(), 4);
        assert!(!page.contains("NaN"));
    }
}
