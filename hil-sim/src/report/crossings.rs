//! Each crossing enlarged: from just before the corner touches until just after lift-off.

use super::axis;
use super::palette;
use super::panel::{Look, Panel};
use super::panels::{Across, View, figure};
use crate::record::{CrossingLine, Recording};

/// Shown before the corner touches and after lift-off, s.
const AROUND_S: (f64, f64) = (0.15, 0.25);
/// Size of a plot, CSS pixels.
const SIZE: (u32, u32) = (540, 250);

/// The enlarged plots of every crossing, as HTML.
pub(super) fn html(recording: &Recording) -> String {
    let crossings = &recording.summary.crossings;
    if crossings.is_empty() {
        return "<p>No crossing is complete in the log.</p>\n".to_owned();
    }
    crossings.iter().map(|line| one(recording, line)).collect()
}

fn one(recording: &Recording, line: &CrossingLine) -> String {
    let mut html = format!("<h3>Crossing {}: step at {:.2} mm</h3>\n", line.index, line.step_mm);
    let view = view(recording, line, AROUND_S);
    if view.rows.is_empty() {
        return html + "<p>No rows were recorded around it.</p>\n";
    }
    html += "<div class=\"grid\">\n";
    for panel in panels(&view) {
        let name = format!("Crossing {}: {}", line.index, panel.title);
        html += &figure(&panel, view.across, SIZE, &name);
    }
    html + "</div>\n"
}

/// The rows from so long before `line` until so long behind it, s.
pub(super) fn view<'a>(
    recording: &'a Recording,
    line: &CrossingLine,
    (before_s, after_s): (f64, f64),
) -> View<'a> {
    let (first, last) = (line.touch_s.min(line.lift_s), line.touch_s.max(line.lift_s));
    let x = (-before_s, last - first + after_s);
    let rows = &recording.rows;
    let from = rows.partition_point(|row| row.controller.t_s < first + x.0);
    let to = rows.partition_point(|row| row.controller.t_s <= first + x.1).max(from);
    View { rows: &rows[from..to], x, ..View::new(recording, Across::Since(first)) }
}

/// The plots that have something to show.
fn panels(view: &View) -> Vec<Panel> {
    let mut clearance = view.gap();
    clearance.title = "Clearance at the step root".to_owned();
    let mut forces = view.panel("Forces of corner and wall", "force, N");
    forces.lines = view.lines([
        ("corner", Look::Truth, |row| row.of_truth(|t| t.corner_force_n)),
        ("wall", Look::Other(palette::FLOOR, 2.0), |row| row.of_truth(|t| t.floor_force_n)),
    ]);
    let mut preload = view.preload();
    // The limit may be far above; it is in the plot of the run.
    let shown = preload.lines.iter().flat_map(|line| &line.points).map(|point| point.1);
    let range = axis::padded(axis::extent(shown).unwrap_or((0.0, 1.0)), 0.08);
    preload.levels.retain(|level| level.2 <= range.1 + 0.5 * (range.1 - range.0));
    let all = [preload, view.speed(), clearance, forces, view.compression(), view.slip_margin()];
    all.into_iter().filter(Panel::has_data).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::example;

    #[test]
    fn a_crossing_without_rows_is_said_to_have_none() {
        let mut recording = example::deploy();
        recording.rows.clear();
        assert_eq!(html(&recording).matches("No rows were recorded").count(), 3);
        recording.summary.crossings.clear();
        assert!(html(&recording).contains("No crossing is complete"));
    }

    #[test]
    fn a_legend_names_what_its_plot_shows() {
        let recording = example::deploy();
        for (line, measured) in recording.summary.crossings.iter().zip([true, false, true]) {
            let view = view(&recording, line, AROUND_S);
            let panel = &panels(&view)[2];
            let text = panel.figure("", SIZE, "");
            assert_eq!(
                text.contains("<span data-name=\"gap, measured\">"),
                measured,
                "crossing {}",
                line.index
            );
        }
    }
}
