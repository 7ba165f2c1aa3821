//! The plots of the last seconds.

use std::collections::VecDeque;

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::{Color, Style};
use ratatui::symbols::Marker;
use ratatui::text::{Line, Span};
use ratatui::widgets::{Axis, Block, Chart, Dataset, GraphType};

use crate::record::{Column, Columns};
use crate::report::axis::{extent, steps};
use crate::table::label;

/// Time span of the plots, s.
pub(super) const SPAN_S: f64 = 10.0;
/// Most intervals of an axis: so many rows a small plot has.
const INTERVALS: f64 = 4.0;

/// What a plot has of a tick.
pub(super) struct Row {
    pub(super) seen: Columns,
    /// Clearance of the next step's root, mm; `NaN` away from a step.
    pub(super) clearance_mm: f64,
    /// The largest gap that is wanted, mm.
    pub(super) gap_ref_mm: f64,
    /// Gap of the crossing whose instant this is, mm; `NaN` otherwise.
    pub(super) gap_mm: f64,
}

/// How a curve is drawn.
#[derive(Clone, Copy, PartialEq)]
enum Look {
    Line,
    /// Dots where there is a value, so that nothing joins one crossing to the next.
    Dots,
    /// A mark for each value.
    Marks,
}

/// A curve: name, colour, look, points.
type Curve = (&'static str, Color, Look, Vec<(f64, f64)>);

pub(super) struct Plot {
    /// Quantity, which is that of its curves, and unit.
    title: &'static str,
    colour: Color,
    /// Least span of its axis.
    least: f64,
}

/// Every plot; a small terminal shows the first four.
pub(super) const PLOTS: [Plot; 6] = [
    Plot { title: "speed, mm/s", colour: Color::Cyan, least: 2.0 },
    Plot { title: "preload, N", colour: Color::Magenta, least: 4.0 },
    Plot { title: GAP, colour: Color::LightRed, least: 1.5 },
    Plot { title: "compression, mm", colour: Color::Green, least: 0.2 },
    Plot { title: "radius, mm", colour: Color::Magenta, least: 2.0 },
    Plot { title: "slip margin", colour: Color::Cyan, least: 0.2 },
];

/// The plot of what no quantity of a tick is.
const GAP: &str = "gap, mm";

impl Plot {
    /// Draws the rows of the last seconds, of which `end_s` is the latest.
    pub(super) fn draw(&self, frame: &mut Frame<'_>, area: Rect, rows: &VecDeque<Row>, end_s: f64) {
        let curves = self.curves(rows);
        // Before a step and behind it the clearance is unrelated to the gap.
        let shown = curves.iter().filter(|curve| curve.2 != Look::Dots);
        let marks = marks(shown.flat_map(|curve| &curve.3).map(|point| point.1), self.least);
        let sets = curves.iter().flat_map(|(_, colour, look, points)| {
            let (marker, kind) = match look {
                Look::Line => (Marker::Braille, GraphType::Line),
                Look::Dots => (Marker::Braille, GraphType::Scatter),
                Look::Marks => (Marker::Dot, GraphType::Scatter),
            };
            let style = Style::new().fg(*colour);
            // A curve ends where its value is unknown.
            let parts = points.split(|point| !point.1.is_finite()).filter(|part| !part.is_empty());
            let set = Dataset::default().marker(marker).graph_type(kind).style(style);
            parts.map(move |part| set.clone().data(part))
        });
        let (low, high) = (marks[0], marks[marks.len() - 1]);
        let digits = if marks[1] - low < 1.0 { 2 } else { 0 };
        let begin_s = end_s - SPAN_S;
        let [begin, end] = [begin_s, end_s].map(|at| Line::from(format!("{at:.1} s")));
        let block = Block::bordered().title(self.title(&curves));
        let chart = Chart::new(sets.collect())
            .legend_position(None)
            .block(block.title_bottom(begin).title_bottom(end.right_aligned()))
            .x_axis(Axis::default().bounds([begin_s, end_s]))
            .y_axis(
                Axis::default()
                    .bounds([low, high])
                    .labels(marks.iter().map(|mark| label(*mark, digits))),
            );
        frame.render_widget(chart, area);
    }

    /// The controller's curves of the plot, or those of the gap; later ones are drawn on top.
    fn curves(&self, rows: &VecDeque<Row>) -> Vec<Curve> {
        let curve = |name, colour, look, of: &dyn Fn(&Row) -> f64| -> Curve {
            (name, colour, look, rows.iter().map(|row| (row.seen.t_s, of(row))).collect())
        };
        if self.title == GAP {
            return vec![
                curve("wanted", Color::Reset, Look::Line, &|row| row.gap_ref_mm),
                curve("clearance", Color::Magenta, Look::Dots, &|row| row.clearance_mm),
                curve("measured", self.colour, Look::Marks, &|row| row.gap_mm),
            ];
        }
        let of_plot = |column: &Column| {
            let (_, name) = column.curve.filter(|(plot, _)| self.title.starts_with(plot))?;
            let colour = if name == "reference" { Color::Reset } else { self.colour };
            Some(curve(name, colour, Look::Line, &|row| (column.of)(&row.seen)))
        };
        let mut curves: Vec<Curve> = Columns::QUANTITIES.iter().filter_map(of_plot).collect();
        curves.sort_by_key(|curve| curve.0 != "reference");
        curves
    }

    /// Quantity, and the names of the curves in their colours.
    fn title(&self, curves: &[Curve]) -> Line<'static> {
        let legend = curves.iter().map(|(name, colour, look, _)| {
            let mark = if *look == Look::Marks { '•' } else { '─' };
            Span::styled(format!(" {mark}{name}"), Style::new().fg(*colour))
        });
        std::iter::once(Span::raw(self.title)).chain(legend).collect::<Vec<_>>().into()
    }
}

/// Round numbers over the range of the values and at least so wide, two or more.
fn marks(values: impl Iterator<Item = f64>, least: f64) -> Vec<f64> {
    let (low, high) = extent(values).unwrap_or((0.0, least));
    let lacking = 0.5 * (least - (high - low)).max(0.0);
    let ends = |step: f64| {
        // Noise around a mark takes no interval more.
        let (low, high) = ((low - lacking) / step, (high + lacking) / step);
        ((low + 0.02).floor(), (high - 0.02).ceil())
    };
    let fits = |step: &f64| ends(*step).1 - ends(*step).0 <= INTERVALS;
    let step = steps(0.01).find(fits).unwrap_or(1e6);
    let (first, last) = ends(step);
    (first as i64..=last as i64).map(|n| n as f64 * step).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_are_round_and_never_narrower_than_asked() {
        assert_eq!(marks([1.0, 2.0].into_iter(), 4.0), [-2.0, 0.0, 2.0, 4.0]);
        assert_eq!(marks([].into_iter(), 4.0), [0.0, 1.0, 2.0, 3.0, 4.0]);
        assert_eq!(marks([-0.1, 27.8, f64::NAN].into_iter(), 2.0), [0.0, 10.0, 20.0, 30.0]);
        assert_eq!(marks([2.65].into_iter(), 1.5), [1.5, 2.0, 2.5, 3.0, 3.5]);
    }
}
