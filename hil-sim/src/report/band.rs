//! Mode, contact stage and sleeve level as three bands on the axis of the plots.

use plotters::style::RGBColor;

use super::palette;
use super::panel::{Panel, Stretch};
use super::panels::View;
use crate::record::{MODE_NAMES, Tick};

/// What happens in the study's stages, from number 1.
const STAGES: [&str; 6] = [
    "no preload",
    "preload rises at rest",
    "both walls carry",
    "corner carries",
    "onto the next wall",
    "rolls on a wall",
];

/// One band: its name, and what a row shows in it.
struct Lane {
    name: &'static str,
    of: fn(&Tick) -> u8,
    show: fn(u8) -> (String, RGBColor),
}

const LANES: [Lane; 3] = [
    Lane { name: "mode", of: |row| row.controller.mode, show: mode },
    Lane { name: "stage", of: |row| row.controller.stage, show: stage },
    Lane { name: "level", of: |row| row.controller.level, show: level },
];

fn mode(number: u8) -> (String, RGBColor) {
    let place = usize::from(number);
    let name = MODE_NAMES.get(place).map_or_else(|| format!("mode {number}"), |&n| n.to_owned());
    (name, palette::MODES[place % palette::MODES.len()])
}

fn stage(number: u8) -> (String, RGBColor) {
    let place = usize::from(number).wrapping_sub(1);
    let name = STAGES.get(place).map_or_else(|| "none".to_owned(), |n| format!("{number} {n}"));
    (name, palette::STAGES[place % palette::STAGES.len()])
}

fn level(number: u8) -> (String, RGBColor) {
    let place = usize::from(number);
    (number.to_string(), palette::LEVELS[place % palette::LEVELS.len()])
}

/// The three bands of `view`.
pub(super) fn panel(view: &View) -> Panel {
    let mut panel = view.panel("Mode, contact stage and sleeve level", "");
    (panel.shades, panel.rules) = (Vec::new(), Vec::new());
    let stretch = |show: fn(u8) -> (String, RGBColor)| {
        move |(from, to, value)| {
            let (name, colour) = show(value);
            Stretch { from, to, name, colour }
        }
    };
    let band = |lane: &Lane| {
        let all = spans(view, lane.of).into_iter().map(stretch(lane.show));
        (lane.name, all.filter(|one| one.to > view.x.0 && one.from < view.x.1).collect())
    };
    panel.bands = LANES.iter().map(band).collect();
    panel
}

/// Spans of the axis over which `of` stays the same.
fn spans(view: &View, of: fn(&Tick) -> u8) -> Vec<(f64, f64, u8)> {
    let x = |row: &Tick| view.across.of(row);
    let runs: Vec<&[Tick]> = view.rows.chunk_by(|a, b| of(a) == of(b)).collect();
    let next = runs.iter().skip(1).map(|run| x(&run[0])).chain(view.rows.last().map(x));
    let spans = runs.iter().zip(next).map(|(run, end)| (x(&run[0]), end, of(&run[0])));
    spans.map(|(a, b, value)| (a.min(b), a.max(b), value)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::{Controller, Recording};
    use crate::report::panels::Across;

    #[test]
    fn spans_join_and_name_what_follows() {
        let row = |t_s, mode| {
            let controller = Controller { t_s, mode, ..Controller::default() };
            Tick { controller, truth: None }
        };
        let rows = vec![row(0.0, 5), row(1.0, 5), row(2.0, 6), row(3.0, 7)];
        let recording = Recording { rows, ..Recording::default() };
        let view = View::new(&recording, Across::Time);
        assert_eq!(
            spans(&view, |row| row.controller.mode),
            [(0.0, 2.0, 5), (2.0, 3.0, 6), (3.0, 3.0, 7)]
        );
        let modes = panel(&view).bands.swap_remove(0).1;
        let names: Vec<&str> = modes.iter().map(|one| one.name.as_str()).collect();
        assert_eq!(names, ["cruise", "approach"]);
    }

    #[test]
    fn unknown_numbers_still_have_a_name() {
        assert_eq!(mode(77).0, "mode 77");
        assert_eq!(stage(0).0, "none");
        assert_eq!(stage(7).0, "none");
    }
}
