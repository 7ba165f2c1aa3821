//! Plots in rows and columns as one picture. Its text can still be read when it is 400 CSS pixels
//! wide.

use std::fmt::Write as _;

use super::Panel;
use super::legend::{flow, merged};
use super::plot::{LEFT, RIGHT};

/// Width of a picture, user units, and how many CSS pixels each of them is.
pub(in crate::report) const WIDE: f64 = 512.0;
pub(in crate::report) const ZOOM: f64 = 1.25;
/// Height of a plot without names above and below, user units.
const PLOT: f64 = 156.0;

/// Plots in this many columns as an SVG on white: under one legend that all share, or each with
/// its own.
pub fn sheet(mut panels: Vec<Panel>, columns: usize, is_shared: bool) -> String {
    for place in 1..panels.len() {
        let (above, below) = panels.split_at_mut(place);
        let (above, below) = (&mut above[place - 1], &below[0]);
        // One axis for plots below one another.
        if columns == 1 && (&above.x_name, above.x) == (&below.x_name, below.x) {
            above.x_name.clear();
        }
    }
    let wide = WIDE / columns as f64;
    let left = panels.iter().map(|panel| panel.left(PLOT)).fold(0.0, f64::max);
    let (mut svg, mut down) = (String::new(), 4.0);
    if is_shared {
        let (legend, high) = flow(&merged(panels.iter().flat_map(Panel::legend)), 0.0, WIDE);
        let _ = write!(svg, "<g transform=\"translate(0 {down})\">\n{legend}</g>\n");
        down += high + 4.0;
    }
    for row in panels.chunks(columns) {
        let own =
            |panel: &Panel| panel.head(wide, &if is_shared { Vec::new() } else { panel.legend() });
        let heads: Vec<_> = row.iter().map(own).collect();
        let head = heads.iter().map(|head| head.1).fold(0.0, f64::max);
        let around = row.iter().map(|one| one.above() + one.below()).fold(0.0, f64::max);
        for (place, (panel, (title, _))) in row.iter().zip(heads).enumerate() {
            let high = panel.above() + PLOT + panel.below();
            let plot = panel.plot((wide, high), left, false);
            let across = place as f64 * wide;
            let _ = write!(
                svg,
                "<g transform=\"translate({across} {down})\">\n{title}\
<g transform=\"translate(0 {head})\">\n{plot}</g></g>\n"
            );
        }
        down += head + PLOT + around + 4.0;
    }
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{}\" height=\"{}\" viewBox=\"0 0 {WIDE} {down}\">\n\
<rect width=\"{WIDE}\" height=\"{down}\" fill=\"white\"/>\n{svg}</svg>\n",
        ZOOM * WIDE,
        ZOOM * down,
    )
}

impl Panel {
    /// Title, legend and plot in a picture of this height, and where the plot is: left, right, top,
    /// bottom; user units.
    pub(in crate::report) fn alone(&self, high: f64) -> (String, [f64; 4]) {
        let (head, taken) = self.head(WIDE, &self.legend());
        let plot = self.plot((WIDE, high - taken), LEFT, false);
        let svg = format!("{head}<g transform=\"translate(0 {taken})\">\n{plot}</g>\n");
        (svg, [LEFT, WIDE - RIGHT, taken + self.above(), high - self.below()])
    }
}
