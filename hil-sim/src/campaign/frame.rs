//! Rows of figures, as every campaign shows them.

use std::borrow::Cow;

use serde::Serialize;
use serde_json::{Map, Value};

use crate::report::{page_of, svg::escape, table};
use crate::scenario::brief;
use crate::table::{number, plain};

/// A column: the figure of each row that has its key.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Column {
    /// Its key in JSON and CSV.
    pub key: Cow<'static, str>,
    /// Its heading; the unit follows.
    pub name: Cow<'static, str>,
    pub unit: &'static str,
    /// Decimals shown to a reader; CSV has all.
    pub decimals: usize,
}

/// A column of these.
pub const fn column(
    key: &'static str,
    name: &'static str,
    unit: &'static str,
    decimals: usize,
) -> Column {
    Column { key: Cow::Borrowed(key), name: Cow::Borrowed(name), unit, decimals }
}

/// Columns and rows.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    columns: Vec<Column>,
    rows: Vec<Map<String, Value>>,
}

impl Frame {
    /// Of rows as JSON has them.
    pub fn of<R: Serialize>(columns: &[Column], rows: impl IntoIterator<Item = R>) -> Self {
        let row = |row: R| match serde_json::to_value(row) {
            Ok(Value::Object(row)) => row,
            _ => Map::new(),
        };
        Self { columns: columns.to_vec(), rows: rows.into_iter().map(row).collect() }
    }

    /// Without the columns of these keys if the terminal `is_narrow`.
    pub fn fitted(&self, spare: &[&str], is_narrow: bool) -> Self {
        let mut frame = self.clone();
        frame.columns.retain(|column| !(is_narrow && spare.contains(&&*column.key)));
        frame
    }

    /// As a table of the terminal.
    pub fn text(&self) -> String {
        let heads: Vec<String> = self.heads("\n").collect();
        let heads: Vec<&str> = heads.iter().map(String::as_str).collect();
        format!("{}\n", plain(&heads, self.shown()))
    }

    /// As comma-separated values.
    pub fn csv(&self) -> String {
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
    pub fn html(&self, headline: &str, text: &str, good: bool) -> String {
        let heads: Vec<String> = self.heads(", ").map(|head| escape(&head)).collect();
        let rows = self.shown().map(|row| row.iter().map(|cell| escape(cell)).collect());
        let rows = table("ledger pairs rows", &heads, rows.collect());
        let grade = if good { "good" } else { "bad" };
        let printed = escape(text);
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
            None | Some(Value::Null) => "-".to_owned(),
            Some(Value::Bool(yes)) => if *yes { "yes" } else { "no" }.to_owned(),
            Some(Value::Number(value)) if value.is_f64() => number(value.as_f64(), column.decimals),
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
        let rows =
            [json!({ "name": "a, <b>", "gap_mm": 1.2345, "ok": true }), json!({ "name": 2 })];
        let frame = Frame::of(&columns, rows);
        assert_eq!(frame.csv(), "name,gap_mm,ok\n\"a, <b>\",1.2345,true\n2,,\n");
        assert_eq!(frame.fitted(&["gap_mm"], true).csv(), "name,ok\n\"a, <b>\",true\n2,\n");
        assert_eq!(frame.fitted(&["gap_mm"], false), frame);
        let text = frame.text();
        assert!(
            text.contains("a, <b>") && text.contains("1.23 ") && text.contains("yes"),
            "{text}"
        );
        let page = frame.html("5 runs", "a > b", true);
        for part in
            ["<th>gap, mm</th>", "<td>a, &lt;b&gt;</td>", "<td>1.23</td>", "<td>-</td>", "a &gt; b"]
        {
            assert!(page.contains(part), "{part}: {page}");
        }
    }
}
