//! The plots of the last seconds.

use std::collections::VecDeque;

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::{Color, Style};
use ratatui::symbols::Marker;
use ratatui::text::{Line, Span};
use ratatui::widgets::{Axis, Block, Chart, Dataset, GraphType};

use crate::record::Controller;
use crate::table::label;

/// Time span of the plots, s.
pub(super) const SPAN_S: f64 = 10.0;
/// Least height of a plot with a labelled time axis, lines.
const WITH_TIMES: u16 = 10;

/// What a plot has of a tick.
pub(super) struct Row {
    pub(super) seen: Controller,
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

/// A curve: name, colour, look, value.
type Curve = (&'static str, Color, Look, fn(&Row) -> f64);

pub(super) struct Plot {
    /// Quantity and unit.
    title: &'static str,
    /// Least span of its axis.
    least: f64,
    /// Later ones are drawn on top.
    curves: &'static [Curve],
}

/// Every plot; a small terminal shows the first four.
pub(super) const PLOTS: [Plot; 6] = [
    Plot {
        title: "speed, mm/s",
        least: 2.0,
        curves: &[
            ("wanted", Color::Gray, Look::Line, |row| row.seen.speed_ref_mm_s),
            ("measured", Color::Cyan, Look::Line, |row| row.seen.wheel_speed_mm_s),
        ],
    },
    Plot {
        title: "preload, N",
        least: 4.0,
        curves: &[
            ("wanted", Color::Gray, Look::Line, |row| row.seen.preload_ref_n),
            ("measured", Color::Yellow, Look::Line, |row| row.seen.preload_n),
        ],
    },
    Plot {
        title: "gap, mm",
        least: 1.5,
        curves: &[
            ("wanted", Color::Gray, Look::Line, |row| row.gap_ref_mm),
            ("clearance", Color::Magenta, Look::Dots, |row| row.clearance_mm),
            ("measured", Color::LightRed, Look::Marks, |row| row.gap_mm),
        ],
    },
    Plot {
        title: "compression, mm",
        least: 0.2,
        curves: &[("measured", Color::Green, Look::Line, |row| row.seen.compression_mm)],
    },
    Plot {
        title: "wheel centre to axis, mm",
        least: 2.0,
        curves: &[("by the arm", Color::Magenta, Look::Line, |row| row.seen.radius_mm)],
    },
    Plot {
        title: "slip margin",
        least: 0.2,
        curves: &[("estimated", Color::Cyan, Look::Line, |row| row.seen.slip_margin)],
    },
];

impl Plot {
    /// Draws the rows of the last seconds, of which `end_s` is the latest.
    pub(super) fn draw(&self, frame: &mut Frame<'_>, area: Rect, rows: &VecDeque<Row>, end_s: f64) {
        let points = |of: fn(&Row) -> f64| -> Vec<(f64, f64)> {
            let all = rows.iter().map(|row| (row.seen.t_s, of(row)));
            all.filter(|point| point.1.is_finite()).collect()
        };
        let lines: Vec<_> = self.curves.iter().map(|(.., of)| points(*of)).collect();
        // Before a step and behind it the clearance is unrelated to the gap.
        let shown = self.curves.iter().zip(&lines).filter(|(curve, _)| curve.2 != Look::Dots);
        let fitted = shown.flat_map(|(_, line)| line).map(|point| point.1);
        let (low, high) = range(fitted, self.least);
        let sets = self.curves.iter().zip(&lines).map(|((_, colour, look, _), points)| {
            let (marker, kind) = match look {
                Look::Line => (Marker::Braille, GraphType::Line),
                Look::Dots => (Marker::Braille, GraphType::Scatter),
                Look::Marks => (Marker::Dot, GraphType::Scatter),
            };
            let style = Style::new().fg(*colour);
            Dataset::default().marker(marker).graph_type(kind).style(style).data(points)
        });
        let digits = if high - low < 1.0 { 2 } else { 1 };
        let axis = |low: f64, high: f64| Axis::default().bounds([low, high]);
        let begin_s = end_s - SPAN_S;
        let mut across = axis(begin_s, end_s);
        if area.height >= WITH_TIMES {
            across = across.labels([begin_s, end_s].map(|at| format!("{at:.1} s")));
        }
        let labels = [low, 0.5 * (low + high), high].map(|value| label(value, digits));
        let chart = Chart::new(sets.collect())
            .legend_position(None)
            .block(Block::bordered().title(self.title()))
            .x_axis(across)
            .y_axis(axis(low, high).labels(labels));
        frame.render_widget(chart, area);
    }

    /// Quantity, and the names of the curves in their colours.
    fn title(&self) -> Line<'static> {
        let legend = self.curves.iter().map(|(name, colour, look, _)| {
            let mark = if *look == Look::Marks { '•' } else { '─' };
            Span::styled(format!(" {mark}{name}"), Style::new().fg(*colour))
        });
        std::iter::once(Span::raw(self.title)).chain(legend).collect::<Vec<_>>().into()
    }
}

/// Range of the values, at least so wide.
fn range(values: impl Iterator<Item = f64>, least: f64) -> (f64, f64) {
    let (low, high) =
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
    if low > high {
        return (0.0, least);
    }
    let lacking = (least - (high - low)).max(0.0);
    (low - 0.5 * lacking, high + 0.5 * lacking)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_range_is_never_narrower_than_asked() {
        assert_eq!(range([1.0, 2.0].into_iter(), 4.0), (-0.5, 3.5));
        assert_eq!(range([].into_iter(), 4.0), (0.0, 4.0));
        assert_eq!(range([0.0, 9.0].into_iter(), 4.0), (0.0, 9.0));
    }

    #[test]
    fn the_first_plots_have_their_legend_in_half_a_small_terminal() {
        for plot in &PLOTS[..4] {
            assert!(plot.title().width() <= 38, "{}", plot.title());
        }
    }
}
