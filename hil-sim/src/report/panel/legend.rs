//! Title and legend of a plot: in its picture, or as text of a page.

use super::super::axis::TEXT_PX;
use super::super::svg::{escape, hex, width};
use super::{Look, Panel, RIGHT, Shape};

/// Heights of the title and of a legend below it, in a picture that is no page's.
const HEAD: f64 = 30.0;
const LEGEND: f64 = 20.0;
const TITLE_PX: f64 = 14.0;

impl Panel {
    /// Everything that the legend names, in its order: what has a point in the plot.
    pub(super) fn legend(&self) -> Vec<Sample<'_>> {
        let (x, y) = (self.x, self.y_range());
        let is_inside =
            |point: &(f64, f64)| (x.0..=x.1).contains(&point.0) && (y.0..=y.1).contains(&point.1);
        let lines = self.lines.iter().filter(|line| line.points.iter().any(is_inside));
        let sample = |name, look, has_value| Sample { name, look, mark: None, has_value };
        let lines = lines.map(|line| sample(&*line.name, line.look, true));
        let levels = self.levels.iter().filter(|level| (y.0..=y.1).contains(&level.2));
        let levels = levels.map(|&(name, look, _)| sample(name, look, false));
        let mut levels: Vec<_> = levels.collect();
        // The two ends of a band have one sample.
        levels.dedup_by_key(|level| level.name);
        let bands = self.bands.iter().map(|&(name, _)| sample(name, Look::Truth, true));
        let marks = self.marks.iter().filter(|marks| marks.points.iter().any(is_inside));
        let marks = marks.map(|marks| Sample {
            name: &marks.name,
            look: Look::Other(marks.colour),
            mark: Some(marks.shape),
            has_value: false,
        });
        lines.chain(levels).chain(bands).chain(marks).collect()
    }

    /// Title and legend, in one row, or in two where they do not fit side by side, and their height.
    pub(super) fn head(&self, wide: f64) -> (String, f64) {
        let legend = self.legend();
        let title = 8.0 + width(&self.title, TITLE_PX);
        let fits = title + legend.iter().map(Sample::width).sum::<f64>() + RIGHT <= wide;
        let (mut left, middle, high) = match fits {
            true => (title, 0.5 * HEAD, HEAD),
            false => (8.0, HEAD - 4.0 + 0.5 * LEGEND, HEAD + LEGEND),
        };
        let mut svg = format!(
            "<g font-family=\"sans-serif\" font-size=\"{TEXT_PX}\" fill=\"#374151\">\n\
<text x=\"8\" y=\"{}\" font-size=\"{TITLE_PX}\" fill=\"#1f2937\">{}</text>\n",
            0.5 * HEAD + 5.0,
            escape(&self.title)
        );
        for sample in legend {
            svg += &format!(
                "<g transform=\"translate({left:.1} {middle})\">{}<text x=\"38\" y=\"4\">{}</text></g>\n",
                sample.strokes(25.0, 12.0),
                escape(sample.name)
            );
            left += sample.width();
        }
        (svg + "</g>\n", high)
    }
}

/// An entry of a legend.
pub(super) struct Sample<'a> {
    name: &'a str,
    look: Look,
    mark: Option<Shape>,
    /// It has a value at the cursor.
    has_value: bool,
}

impl Sample<'_> {
    /// Width of the entry with the room before it, CSS pixels.
    fn width(&self) -> f64 {
        44.0 + width(self.name, TEXT_PX)
    }

    /// The line of this length, or the mark at the place `left + length / 2`.
    fn strokes(&self, length: f64, left: f64) -> String {
        let Some(shape) = self.mark else {
            let class = if self.look == Look::Truth { " class=\"truth\"" } else { "" };
            return format!("<path{class} {} d=\"M{left} 0h{length}\"/>", self.look.stroke());
        };
        let one = |&(class, cap, width): &(&str, &str, f64)| {
            let colour = if class == "rim" { "white".to_owned() } else { hex(self.look.style().1) };
            format!(
                "<path class=\"{class}\" stroke=\"{colour}\" stroke-width=\"{width}\" stroke-linecap=\"{cap}\" d=\"M{} 0h0\"/>",
                left + 0.5 * length
            )
        };
        shape.strokes().iter().map(one).collect()
    }

    /// The entry as text of a page, with room for the value at the cursor.
    pub(super) fn html(&self) -> String {
        let (name, value) = (escape(self.name), if self.has_value { "<b></b>" } else { "" });
        format!(
            "<span data-name=\"{name}\"><svg width=\"26\" height=\"16\" viewBox=\"0 -8 26 16\" \
aria-hidden=\"true\">{}</svg>{name}{value}</span>",
            self.strokes(24.0, 1.0)
        )
    }
}
