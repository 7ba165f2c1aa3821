//! Grid, axes and their text, for all plots.

use plotters::chart::MeshStyle;
use plotters::coord::ranged1d::Ranged;
use plotters::prelude::DrawingBackend;
use plotters::style::{Color, TRANSPARENT};

use super::palette;
use super::svg::size;

/// Text of axes, CSS pixels.
pub const TEXT_PX: f64 = 12.0;

/// Lines at the ticks and none between them, and the text of a plot. A plot may override them
/// afterwards.
pub fn plain<'m, 'a, 'b, X: Ranged, Y: Ranged, DB: DrawingBackend>(
    mesh: &'m mut MeshStyle<'a, 'b, X, Y, DB>,
) -> &'m mut MeshStyle<'a, 'b, X, Y, DB> {
    let text = || ("sans-serif", size(TEXT_PX), &palette::TEXT);
    mesh.light_line_style(TRANSPARENT)
        .bold_line_style(palette::GRID.stroke_width(2))
        .axis_style(palette::AXIS.stroke_width(2))
        .x_label_style(text())
        .y_label_style(text())
        .axis_desc_style(text())
}
