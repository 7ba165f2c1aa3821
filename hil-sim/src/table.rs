//! Tables and text of the terminal, at most `width` columns wide, and their numbers.

use comfy_table::presets::UTF8_HORIZONTAL_ONLY;
use comfy_table::{
    Cell, CellAlignment, ColumnConstraint, ContentArrangement, Table, TableComponent, Width,
};

/// Most columns that the output takes.
const WIDTH: u16 = 100;
/// Columns that every output may take.
pub(crate) const NARROW: u16 = 80;

/// Columns that the output takes: those of the terminal within 80 to 100, elsewhere 100.
pub(crate) fn width() -> u16 {
    Table::new().width().map_or(WIDTH, |columns| columns.clamp(NARROW, WIDTH))
}

/// `text` broken at blanks to at most this many columns, each line after `indent`.
pub(crate) fn wrapped(text: &str, indent: &str, columns: u16) -> String {
    let most = usize::from(columns) - indent.len();
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= most => {
                *line += &format!(" {word}");
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines.iter().map(|line| format!("{indent}{line}\n")).collect()
}

/// A count of things of which one is a `noun`: "1 run", "2 runs".
pub(crate) fn counted(count: impl std::fmt::Display, noun: &str) -> String {
    let count = count.to_string();
    let plural = if count == "1" || count == "-1" { "" } else { "s" };
    format!("{count} {noun}{plural}")
}

/// A table of `head` and `rows` in the style of the others, its first column on the
/// left and the rest on the right. No word is broken, nor a line of the first column: a table
/// of too many columns is wider than the terminal.
pub fn plain(head: &[impl AsRef<str>], rows: impl IntoIterator<Item = Vec<String>>) -> Table {
    let (columns, head) = (head.len(), head.iter().enumerate());
    let mut table = Table::new();
    table
        .load_preset(UTF8_HORIZONTAL_ONLY)
        .remove_style(TableComponent::HorizontalLines)
        .remove_style(TableComponent::MiddleIntersections)
        .remove_style(TableComponent::LeftBorderIntersections)
        .remove_style(TableComponent::RightBorderIntersections)
        .set_content_arrangement(ContentArrangement::Dynamic)
        .set_width(width())
        .set_header(head.map(|(column, text)| cell(column, text.as_ref().to_owned())));
    for row in rows {
        table.add_row(row.into_iter().enumerate().map(|(column, text)| cell(column, text)));
    }
    let word = |text: String| text.split_whitespace().map(|word| word.chars().count()).max();
    let least = |column: usize| {
        let cells = table.column_cells_with_header_iter(column).flatten();
        cells.filter_map(|cell| word(cell.content())).max().unwrap_or(0) as u16
    };
    let words: Vec<u16> = (0..columns).map(least).collect();
    for (column, word) in table.column_iter_mut().zip(words) {
        column.set_constraint(match column.index {
            0 => ColumnConstraint::ContentWidth,
            // With a blank on both sides.
            _ => ColumnConstraint::LowerBoundary(Width::Fixed(word + 2)),
        });
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
pub(crate) fn label(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    if text.trim_start_matches(['-', '0', '.']).is_empty() {
        text.trim_start_matches('-').to_owned()
    } else {
        text
    }
}

/// `value` with `decimals` and its sign; without one where it rounds to zero.
pub(crate) fn signed(value: f64, decimals: usize) -> String {
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
}
