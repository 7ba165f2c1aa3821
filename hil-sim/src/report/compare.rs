//! Two runs side by side, crossing by crossing.

use super::beside::beside_svg;
use super::ledger::{COLUMNS, Column};
use super::page::{head, section};
use super::svg::escape;
use super::tables;
use super::verdict::{gap_sentence, headline};
use crate::record::{CrossingLine, Recording};
use crate::table::number;

/// A difference between the two runs at a crossing.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Difference {
    /// Step number.
    pub index: u8,
    /// Name of the quantity.
    pub quantity: &'static str,
    pub unit: &'static str,
    /// Decimals that are shown.
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
pub fn differences(a: &Recording, b: &Recording) -> Vec<Difference> {
    let mut all = Vec::new();
    for (index, a, b) in pairs(a, b) {
        for Column { name: quantity, unit, decimals, of, .. } in COLUMNS {
            let value =
                |line: Option<&CrossingLine>| line.and_then(of).filter(|value| value.is_finite());
            let (a, b) = (value(a), value(b));
            if a.is_some() || b.is_some() {
                let change = a.zip(b).map(|(a, b)| b - a);
                all.push(Difference { index, quantity, unit, decimals, a, b, change });
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

/// The page of two runs with their names.
pub fn compare_html((name_a, a): (&str, &Recording), (name_b, b): (&str, &Recording)) -> String {
    let mut page = head("two runs");
    for (letter, name, run) in [("A", name_a, a), ("B", name_b, b)] {
        page += &format!(
            "<header>\n<p class=\"what\">{letter}: {}</p>\n<p><b>{}</b>; {}</p>\n</header>\n",
            escape(name),
            escape(&headline(&run.summary)),
            escape(&gap_sentence(&run.summary)),
        );
    }
    let (head, rows) = table(&differences(a, b));
    page += &section("Crossing by crossing", &tables::table("ledger", &head, rows));
    let picture = beside_svg([("A", a), ("B", b)]);
    page += &section("Over time", &format!("<figure class=\"wide\">{picture}</figure>\n"));
    page + "</main>\n</body>\n</html>\n"
}

/// The differences as a table's head and rows.
pub fn table(differences: &[Difference]) -> (Vec<String>, Vec<Vec<String>>) {
    let head = ["step", "quantity", "A", "B", "B - A"].map(str::to_owned).to_vec();
    let rows =
        differences.iter().map(|Difference { index, quantity, unit, decimals, a, b, change }| {
            let [a, b, change] = [a, b, change].map(|value| number(*value, *decimals));
            let unit = if unit.is_empty() { String::new() } else { format!(", {unit}") };
            vec![index.to_string(), format!("{quantity}{unit}"), a, b, change]
        });
    (head, rows.collect())
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
    fn the_page_shows_both_runs() {
        let (a, b) = (example::deploy(), example::faulted());
        let page = compare_html(("one.mcap", &a), ("two <2>.mcap", &b));
        assert!(page.contains("A: one.mcap") && page.contains("B: two &lt;2&gt;.mcap"));
        assert!(page.contains("fault 121") && page.contains("B - A"));
        assert_eq!(page.matches("<svg").count(), 1);
        assert!(!page.contains("NaN"));
    }
}
