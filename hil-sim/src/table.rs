//! Tables and text of the terminal, at most [`width`] columns wide, and their numbers.

use comfy_table::presets::UTF8_HORIZONTAL_ONLY;
use comfy_table::{Cell, CellAlignment, ContentArrangement, Table, TableComponent};

/// Most columns that the output takes.
const WIDTH: u16 = 100;
/// Columns that every output may take.
pub const NARROW: u16 = 80;

/// Columns that the output takes: those of the terminal within 80 to 100, elsewhere 100.
pub fn width() -> u16 {
    Table::new().width().map_or(WIDTH, |columns| columns.clamp(NARROW, WIDTH))
}

/// Whether the terminal is too narrow for every column.
pub fn is_narrow() -> bool {
    width() < WIDTH
}

/// `text` broken at blanks to at most this many columns, each line after `indent`.
pub fn wrapped(text: &str, indent: &str, columns: u16) -> String {
    let most = usize::from(columns) - indent.len();
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        let line = lines.last_mut().expect("there is always one");
        if line.is_empty() {
            line.push_str(word);
        } else if line.chars().count() + 1 + word.chars().count() <= most {
            line.push(' ');
            line.push_str(word);
        } else {
            lines.push(word.to_owned());
        }
    }
    lines.iter().map(|line| format!("{indent}{line}\n")).collect()
}

/// A count of things of which one is a `noun`: "1 run", "2 runs".
pub fn counted(count: impl std::fmt::Display, noun: &str) -> String {
    let count = count.to_string();
    let plural = if count == "1" || count == "-1" { "" } else { "s" };
    format!("{count} {noun}{plural}")
}

/// A table of `head` and `rows` in the style of the others, its first column on the
/// left and the rest on the right.
pub fn plain(head: &[&str], rows: impl IntoIterator<Item = Vec<String>>) -> Table {
    let mut table = Table::new();
    table
        .load_preset(UTF8_HORIZONTAL_ONLY)
        .remove_style(TableComponent::HorizontalLines)
        .remove_style(TableComponent::MiddleIntersections)
        .remove_style(TableComponent::LeftBorderIntersections)
        .remove_style(TableComponent::RightBorderIntersections)
        .set_content_arrangement(ContentArrangement::Dynamic)
        .set_width(width())
        .set_header(head.iter().enumerate().map(|(column, text)| cell(column, (*text).to_owned())));
    for row in rows {
        table.add_row(row.into_iter().enumerate().map(|(column, text)| cell(column, text)));
    }
    table
}

fn cell(column: usize, text: String) -> Cell {
    let side = if column == 0 { CellAlignment::Left } else { CellAlignment::Right };
    Cell::new(text).set_alignment(side)
}

/// `value` with `decimals`; a dash if it is missing or no number.
pub fn number(value: impl Into<Option<f64>>, decimals: usize) -> String {
    let value = value.into().filter(|value| value.is_finite());
    value.map_or_else(|| "-".to_owned(), |value| label(value, decimals))
}

/// `value` with `decimals`, without a negative zero.
pub fn label(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    if text.trim_start_matches(['-', '0', '.']).is_empty() {
        text.trim_start_matches('-').to_owned()
    } else {
        text
    }
}

/// `value` with `decimals` and its sign; without one where it rounds to zero.
pub fn signed(value: f64, decimals: usize) -> String {
    let text = label(value, decimals);
    let zero = text.trim_start_matches(['0', '.']).is_empty();
    if zero || text.starts_with('-') { text } else { format!("+{text}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_minus_zero() {
        let shown = [-0.0, -0.004, -0.006, 0.0, f64::NAN].map(|value| number(value, 2));
        assert_eq!(shown, ["0.00", "0.00", "-0.01", "0.00", "-"]);
        let shown = [-0.04, 0.04, -0.06, 0.06].map(|value| signed(value, 1));
        assert_eq!(shown, ["0.0", "0.0", "-0.1", "+0.1"]);
    }

    #[test]
    fn one_is_singular() {
        let shown = [0, 1, 2, -1].map(|n| counted(n, "slip event"));
        assert_eq!(shown, ["0 slip events", "1 slip event", "2 slip events", "-1 slip event"]);
    }
}
