//! A run in one picture.

use super::panels::{Across, View};
use super::svg;
use crate::record::Recording;

/// Size of the picture, CSS pixels.
const SIZE: (u32, u32) = (1000, 820);
/// More height for the last plot, which carries the time axis.
const AXIS_HEIGHT: u32 = 36;

/// Speed, preload, gap and radius of a run over time, stacked, as an SVG of
/// 1000 x 820.
#[must_use]
pub fn overview_svg(recording: &Recording) -> String {
    let view = View::new(recording, Across::Time);
    let mut panels = [view.speed(), view.preload(), view.gap(), view.radius()];
    let count = panels.len() as u32;
    for panel in &mut panels[..3] {
        panel.x_name = None;
    }
    svg::fixed(SIZE, |area| {
        let height = svg::SCALE * (SIZE.1 - AXIS_HEIGHT) / count;
        let mut rest = area.clone();
        for panel in &panels[..3] {
            let (top, below) = rest.split_vertically(height);
            panel.draw(&top)?;
            rest = below;
        }
        panels[3].draw(&rest)
    })
}
