//! Rows of figures, as every campaign shows them.

use std::borrow::Cow;

use comfy_table::Table;
use serde::Serialize;
use serde_json::{Map, Value};

use crate::report::{page_of, svg::escape, table};
use crate::scenario::brief;
use crate::table::{number, plain, width, wrapped};

/// A column: the figure of each row that has its key.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Column {
    /// Its key in JSON and CSV.
    pub key: Cow<'static, str>,
    /// Its heading; the unit follows.
    pub name: Cow<'static, str>,
    pub unit: &'static str,
    /// Decimals shown to a reader, or [`AS_GIVEN`]; CSV has all.
    pub decimals: usize,
}

/// As many decimals as the number has.
pub(crate) const AS_GIVEN: usize = usize::MAX;

pub(crate) const fn column(
    key: &'static str,
    name: &'static str,
    unit: &'static str,
    decimals: usize,
) -> Column {
    Column { key: Cow::Borrowed(key), name: Cow::Borrowed(name), unit, decimals }
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Frame {
    columns: Vec<Column>,
    rows: Vec<Map<String, Value>>,
}

impl Frame {
    /// Of rows as JSON has them.
    pub(crate) fn of<R: Serialize>(columns: &[Column], rows: impl IntoIterator<Item = R>) -> Self {
        let row = |row: R| match serde_json::to_value(row) {
            Ok(Value::Object(row)) => row,
            _ => Map::new(),
        };
        Self { columns: columns.to_vec(), rows: rows.into_iter().map(row).collect() }
    }

    /// As a table of the terminal: where that is too narrow, without as many of these keys as it
    /// takes, from the first on, which it names.
    pub(crate) fn text(&self, spare: &[&str]) -> String {
        let table = |without: &[&str]| {
            let mut frame = self.clone();
            frame.columns.retain(|column| !without.contains(&&*column.key));
            let heads: Vec<String> = frame.heads("\n").collect();
            plain(&heads, frame.shown())
        };
        let is_wide =
            |table: &Table| table.lines().any(|line| line.chars().count() > usize::from(width()));
        let mut count = 0;
        while count < spare.len() && is_wide(&table(&spare[..count])) {
            count += 1;
        }
        let (table, keys) = (table(&spare[..count]), spare[..count].join(", "));
        let note = format!("left out, but in --table: {keys}");
        format!("{table}\n")
            + &if count == 0 { String::new() } else { wrapped(&note, "  ", width()) }
    }

    pub(crate) fn csv(&self) -> String {
        let mut table = csv::Writer::from_writer(Vec::new());
        let cell = |value: Option<&Value>| match value {
            None | Some(Value::Null) => String::new(),
            Some(value) => brief(value),
        };
        let head = self.columns.iter().map(|column| column.key.to_string()).collect();
        let rows = self.rows.iter();
        let rows = rows.map(|row| self.columns.iter().map(|c| cell(row.get(&*c.key))).collect());
        for line in std::iter::once::<Vec<String>>(head).chain(rows) {
            // Memory takes every line.
            let _ = table.write_record(line);
        }
        String::from_utf8(table.into_inner().unwrap_or_default()).unwrap_or_default()
    }

    /// As a page with this headline, and what was printed.
    pub(crate) fn html(&self, headline: &str, text: &str, good: bool) -> String {
        let heads: Vec<String> = self.heads(", ").map(|head| escape(&head)).collect();
        let rows = self.shown().map(|row| row.iter().map(|cell| escape(cell)).collect());
        let rows = table("ledger pairs rows", &heads, rows.collect());
        let grade = if good { "good" } else { "bad" };
        // Rows of printed tables keep their length; what is said between them wraps.
        let mut in_table = false;
        let line = |line: &str| {
            let is_rule = line.starts_with('\u{2500}');
            in_table ^= is_rule;
            let class = if in_table || is_rule { "row" } else { "said" };
            format!("<span class=\"{class}\">{}</span>", escape(line))
        };
        let printed: String = text.lines().map(line).collect();
        let body =
            format!("<section>\n{rows}</section>\n<section>\n<pre>{printed}</pre>\n</section>\n");
        page_of("a campaign", grade, headline, &body)
    }

    fn heads(&self, between: &'static str) -> impl Iterator<Item = String> {
        self.columns.iter().map(move |Column { name, unit, .. }| match *unit {
            "" => name.to_string(),
            unit => format!("{name}{between}{unit}"),
        })
    }

    /// The rows as a reader sees them.
    fn shown(&self) -> impl Iterator<Item = Vec<String>> {
        let cell = |row: &Map<String, Value>, column: &Column| match row.get(&*column.key) {
            None => String::new(),
            Some(Value::Null) => "-".to_owned(),
            Some(Value::Bool(yes)) => if *yes { "yes" } else { "no" }.to_owned(),
            Some(Value::Number(value)) if value.is_f64() && column.decimals != AS_GIVEN => {
                number(value.as_f64(), column.decimals)
            }
            Some(Value::Array(list)) if list.is_empty() => "-".to_owned(),
            Some(other) => brief(other),
        };
        self.rows.iter().map(move |row| self.columns.iter().map(|c| cell(row, c)).collect())
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn a_frame_is_the_same_in_every_form() {
        let columns = [
            column("name", "name", "", 0),
            column("gap_mm", "gap", "mm", 2),
            column("ok", "ok", "", 0),
        ];
        let rows = [
            json!({ "name": "a, <b>", "gap_mm": 1.2345, "ok": true }),
            json!({ "name": 2, "ok": null }),
        ];
        let frame = Frame::of(&columns, rows);
        assert_eq!(frame.csv(), "name,gap_mm,ok\n\"a, <b>\",1.2345,true\n2,,\n");
        let text = frame.text(&["gap_mm"]);
        assert!(
            text.contains("a, <b>") && text.contains("1.23 ") && text.contains("yes"),
            "{text}"
        );
        let page = frame.html("5 runs", "a > b\n\u{2500}\n 1\n\u{2500}\n", true);
        let cells = ["<th>gap, mm</th>", "<td>a, &lt;b&gt;</td>", "<td>1.23</td>", "<td>-</td>"];
        for part in cells.into_iter().chain(["said\">a &gt; b<", "row\"> 1<"]) {
            assert!(page.contains(part), "{part}: {page}");
        }
    }
}
