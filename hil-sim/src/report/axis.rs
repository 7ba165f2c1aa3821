//! Ranges and tick marks of axes; grid, axes and their text.

use std::ops::Range;

use plotters::chart::MeshStyle;
use plotters::coord::ranged1d::{DefaultFormatting, KeyPointHint, Ranged};
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::DrawingBackend;
use plotters::style::{Color, TRANSPARENT};

use super::palette;
use super::svg::size;

pub use crate::table::label;

/// An axis with ticks of our own choice.
pub struct Scale {
    coord: RangedCoordf64,
    ticks: Vec<f64>,
}

impl Scale {
    /// An axis over `range` with `ticks`.
    pub fn new(range: (f64, f64), ticks: Vec<f64>) -> Self {
        Self { coord: (range.0..range.1).into(), ticks }
    }
}

impl Ranged for Scale {
    type FormatOption = DefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        self.coord.map(value, limit)
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        // The grid asks a second time for finer lines, which are not drawn.
        if hint.weight().allow_light_points() { Vec::new() } else { self.ticks.clone() }
    }

    fn range(&self) -> Range<f64> {
        self.coord.range()
    }
}

/// Least and largest finite number; None if there is none.
pub fn extent(values: impl IntoIterator<Item = f64>) -> Option<(f64, f64)> {
    values.into_iter().filter(|v| v.is_finite()).fold(None, |range, v| match range {
        None => Some((v, v)),
        Some((low, high)) => Some((low.min(v), high.max(v))),
    })
}

/// `range` with a margin of `part` of it on both sides, and never empty.
pub fn padded(range: (f64, f64), part: f64) -> (f64, f64) {
    let least = 1e-3_f64.max(1e-3 * range.0.abs().max(range.1.abs()));
    let margin = if range.1 - range.0 < least { least } else { part * (range.1 - range.0) };
    (range.0 - margin, range.1 + margin)
}

/// Round numbers inside `range`, at most `most` of them, and how many decimals
/// distinguish them.
pub fn ticks(range: (f64, f64), most: usize) -> (Vec<f64>, usize) {
    let rough = (range.1 - range.0) / most.max(1) as f64;
    if !(rough.is_finite() && rough > 0.0) {
        return (Vec::new(), 0);
    }
    let decade = 10_f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0]
        .map(|factor| factor * decade)
        .into_iter()
        .find(|&step| step >= rough * (1.0 - 1e-9))
        .unwrap_or(10.0 * decade);
    let first = (range.0 / step - 1e-9).ceil() as i64;
    let last = (range.1 / step + 1e-9).floor() as i64;
    let decimals = (-(step * 1.000_001).log10().floor()).max(0.0) as usize;
    ((first..=last).map(|n| n as f64 * step).collect(), decimals)
}

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_few() {
        assert_eq!(ticks((0.0, 10.0), 5), (vec![0.0, 2.0, 4.0, 6.0, 8.0, 10.0], 0));
        let (marks, decimals) = ticks((1.53, 1.92), 6);
        let labels: Vec<String> = marks.iter().map(|&m| label(m, decimals)).collect();
        assert_eq!(labels, ["1.6", "1.7", "1.8", "1.9"]);
        assert_eq!(ticks((0.0, f64::NAN), 5).0.len(), 0);
        assert_eq!(
            ticks((0.0, 0.25), 5),
            (vec![0.0, 0.05, 0.1, 0.15000000000000002, 0.2, 0.25], 2)
        );
    }

    #[test]
    fn a_range_is_never_empty_and_skips_what_is_not_a_number() {
        assert_eq!(extent([f64::NAN, 2.0, -1.0, f64::INFINITY]), Some((-1.0, 2.0)));
        assert_eq!(extent([f64::NAN]), None);
        let (low, high) = padded((33.3, 33.3), 0.1);
        assert!(high > low);
        assert_eq!(padded((0.0, 10.0), 0.1), (-1.0, 11.0));
    }
}
