//! Mode, contact stage and sleeve level as three bands on the axis of the plots.

use super::axis::Scale;
use super::palette::{self, Colour};
use super::panel::{HeatCell, Panel};
use super::panels::View;
use crate::record::{MODE_NAMES, Row};

/// What happens in the study's stages, from number 1.
const STAGES: [&str; 6] = [
    "no preload",
    "preload rises at rest",
    "both walls carry",
    "corner carries",
    "over the corner",
    "rolls on a wall",
];

/// One band: its name, what a row shows in it, in words, and the colours by number.
struct Lane {
    name: &'static str,
    of: fn(&Row) -> u8,
    show: fn(u8) -> String,
    colours: &'static [Colour],
}

const LANES: [Lane; 3] = [
    Lane { name: "mode", of: |row| row.controller.mode, show: mode, colours: &palette::MODES },
    Lane { name: "stage", of: |row| row.controller.stage, show: stage, colours: &palette::STAGES },
    Lane {
        name: "level",
        of: |row| row.controller.level,
        show: |number| number.to_string(),
        colours: &palette::LEVELS,
    },
];

fn mode(number: u8) -> String {
    let name = MODE_NAMES.get(usize::from(number));
    name.map_or_else(|| format!("mode {number}"), |&name| name.to_owned())
}

fn stage(number: u8) -> String {
    let name = STAGES.get(usize::from(number).wrapping_sub(1));
    name.map_or_else(|| "none".to_owned(), |name| format!("{number} {name}"))
}

/// The three bands of `view`.
pub(super) fn panel(view: &View) -> Panel {
    // What is too short to be seen has no place in the legend either.
    let least = 1e-3 * (view.x.1 - view.x.0);
    let cells = LANES.iter().enumerate().flat_map(|(place, lane)| {
        let low = -0.92 - place as f64;
        let cell = move |(from, to, value): (f64, f64, u8)| {
            let colour = lane.colours[usize::from(value) % lane.colours.len()];
            let (name, text) = ((lane.show)(value), String::new());
            HeatCell { x: (from, to), y: (low, low + 0.84), colour, name, text }
        };
        spans(view, lane.of).into_iter().map(cell)
    });
    let cells = cells.filter(|one| one.x.1.min(view.x.1) - one.x.0.max(view.x.0) > least).collect();
    let names = LANES.iter().enumerate().map(|(n, lane)| (-0.5 - n as f64, lane.name.to_owned()));
    Panel {
        y: Some((-(LANES.len() as f64), 0.0)),
        y_axis: Scale::Named(names.collect()),
        cells,
        shades: Vec::new(),
        rules: Vec::new(),
        ..view.panel("Mode, contact stage and sleeve level", "")
    }
}

/// Spans of the axis over which `of` stays the same.
fn spans(view: &View, of: fn(&Row) -> u8) -> Vec<(f64, f64, u8)> {
    let x = |row: &Row| view.across.of(row);
    let runs: Vec<&[Row]> = view.rows.chunk_by(|a, b| of(a) == of(b)).collect();
    let next = runs.iter().skip(1).map(|run| x(&run[0])).chain(view.rows.last().map(x));
    let spans = runs.iter().zip(next).map(|(run, end)| (x(&run[0]), end, of(&run[0])));
    spans.map(|(a, b, value)| (a.min(b), a.max(b), value)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::{Columns, Recording};
    use crate::report::panels::Across;

    #[test]
    fn spans_join_and_name_what_follows() {
        let row = |t_s, mode| Row {
            controller: Columns { t_s, mode, ..Columns::default() },
            truth: None,
        };
        let rows = vec![row(0.0, 5), row(1.0, 5), row(2.0, 6), row(3.0, 7), row(3.002, 7)];
        let recording = Recording { rows, ..Recording::default() };
        let view = View::new(&recording, Across::Time);
        assert_eq!(
            spans(&view, |row| row.controller.mode),
            [(0.0, 2.0, 5), (2.0, 3.0, 6), (3.0, 3.002, 7)]
        );
        let cells = panel(&view).cells;
        let modes = cells.iter().filter(|cell| cell.y.1 > -1.0);
        let names: Vec<&str> = modes.map(|one| one.name.as_str()).collect();
        assert_eq!(names, ["cruise", "approach"]);
    }

    #[test]
    fn unknown_numbers_still_have_a_name() {
        assert_eq!(mode(77), "mode 77");
        assert_eq!((&*stage(0), &*stage(7)), ("none", "none"));
    }
}
