//! Two runs on one rig in the same plots over time: what the one holds and the other does not.

use plotters::style::RGBColor;

use super::axis;
use super::palette;
use super::panel::{Line, Look, Marks, Panel, Shape, stacked};
use super::panels::{Across, View};
use crate::record::{CrossingLine, Recording, Tick};

/// Size, CSS pixels: its text can still be read at 400.
const SIZE: (u32, u32) = (640, 860);
/// Colours of the two.
const COLOURS: [RGBColor; 2] = [palette::PRELOAD, palette::SPEED];

/// The picture of two runs with their names: preload, position, slip and gap.
pub fn beside_svg(runs: [(&str, &Recording); 2]) -> String {
    let own = runs.map(|(name, run)| (name, run.since_command()));
    stacked(SIZE, &mut panels([(own[0].0, &own[0].1), (own[1].0, &own[1].1)]))
}

/// Gap, preload, speed, position and slip of two runs with their names, each since its command.
pub(super) fn panels(runs: [(&str, &Recording); 2]) -> Vec<Panel> {
    let views = runs.map(|(_, run)| View::new(run, Across::Time));
    let x = (views[0].x.0.min(views[1].x.0), views[0].x.1.max(views[1].x.1));
    let line = |of: &dyn Fn(&Tick) -> f64| -> Vec<Line> {
        let all = views.iter().zip(runs).zip(COLOURS);
        all.map(|((view, (name, _)), colour)| {
            let points = view.rows.iter().map(|row| (row.controller.t_s, of(row))).collect();
            Line { name: name.to_owned().into(), look: Look::Other(colour), points }
        })
        .collect()
    };
    let panel = |title: &str, y_name, of: &dyn Fn(&Tick) -> f64| Panel {
        x,
        lines: line(of),
        shades: Vec::new(),
        rules: Vec::new(),
        ..views[0].panel(title, y_name)
    };
    let mut preload = panel("Preload", "preload, N", &|row| row.controller.preload_n);
    preload.levels = views[0].limit_n.iter().map(|&n| ("limit", Look::Limit, n)).collect();
    let speed = panel("Speed", "speed, mm/s", &|row| {
        row.truth.map_or(row.controller.wheel_speed_mm_s, |t| t.speed_true_mm_s)
    });
    let position = panel("Position on the sleeve", "position, mm", &Tick::position_mm);
    let mut slip = panel("Gross slip of the wheel", "slip, mm", &|row| row.of_truth(|t| t.slip_mm));
    slip.least_span = 2.0;
    let mut gap = views[0].gap();
    gap.title = "Gap at the steps".to_owned();
    let all = [preload, speed, position, slip, own_gaps(&views, runs, Panel { x, ..gap })];
    all.into_iter().filter(Panel::has_data).collect()
}

/// The gap of every crossing, beside the reference of the first run.
fn own_gaps(views: &[View; 2], runs: [(&str, &Recording); 2], mut panel: Panel) -> Panel {
    let one = panel.also.map_or(1.0, |also| also.0);
    let own = |line: &CrossingLine| {
        let gap = Some(line.gap_mm).filter(|gap| gap.is_finite());
        Some((line.lift_s, gap.or(line.gap_measured_mm)? / one))
    };
    let all = views.iter().zip(runs).zip(COLOURS);
    panel.marks = all
        .map(|((view, (name, _)), colour)| {
            let points = view.recording.summary.crossings.iter().filter_map(own).collect();
            Marks { name: name.to_owned().into(), shape: Shape::Dot, colour, points }
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
    fn both_runs_are_in_every_plot() {
        let (a, b) = (example::deploy(), example::faulted());
        let svg = beside_svg([("scheduled preload", &a), ("constant preload", &b)]);
        for name in ["scheduled preload", "constant preload"] {
            // A line in four plots; the marks, with their rims, in one; five legends.
            assert_eq!(svg.matches(name).count(), 4 + 2 + 5, "{name}");
        }
        assert!(svg.contains("reference gap") && !svg.contains("NaN"));
    }
}
