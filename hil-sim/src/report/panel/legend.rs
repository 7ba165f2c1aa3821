//! Title and legend of a plot: in its picture, or as text of a page.

use super::super::axis::TEXT_PX;
use super::super::svg::{escape, width};
use super::{Line, Look, Panel, RIGHT, Shape, Stretch};

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
        // A line with marks of its own name has their sample.
        let is_marked = |line: &Line| self.marks.iter().any(|marks| marks.name == line.name);
        let lines = self.lines.iter().filter(|line| line.points.iter().any(is_inside));
        let sample =
            |name, look, has_value| Sample { name, look: Some(look), mark: None, has_value };
        let lines = lines.filter(|line| !is_marked(line));
        let lines = lines.map(|line| sample(&*line.name, line.look, true));
        let levels = self.levels.iter().filter(|level| (y.0..=y.1).contains(&level.2));
        let levels = levels.map(|&(name, look, _)| sample(name, look, false));
        let mut levels: Vec<_> = levels.collect();
        // The two ends of a band have one sample.
        levels.dedup_by_key(|level| level.name);
        let bands = self.bands.iter();
        let bands =
            bands.map(|&(name, _)| Sample { name, look: None, mark: None, has_value: true });
        // The colours of the bands whose names are words, each once.
        let mut key: Vec<&Stretch> = self.bands.iter().flat_map(|band| &band.1).collect();
        key.retain(|one| one.name.parse::<u8>().is_err());
        key.sort_by(|a, b| a.name.cmp(&b.name));
        key.dedup_by(|a, b| a.name == b.name);
        let key = key.into_iter().map(|one| Sample {
            name: &one.name,
            look: Some(Look::Other(one.colour, 1.0)),
            mark: Some(Shape::Square),
            has_value: false,
        });
        let marks = self.marks.iter().filter(|marks| marks.points.iter().any(is_inside));
        let marks = marks.map(|marks| Sample {
            name: &marks.name,
            look: Some(Look::Other(marks.colour, 1.0)),
            mark: Some(marks.shape),
            has_value: false,
        });
        lines.chain(levels).chain(bands).chain(key).chain(marks).collect()
    }

    /// Title and legend and their height: the legend beside the title and in as many rows as it needs.
    pub(super) fn head(&self, wide: f64) -> (String, f64) {
        let (mut left, mut middle) = (8.0 + width(&self.title, TITLE_PX), 0.5 * HEAD);
        let mut svg = format!(
            "<g font-family=\"sans-serif\" font-size=\"{TEXT_PX}\" fill=\"#374151\">\n\
<text x=\"8\" y=\"{}\" font-size=\"{TITLE_PX}\" fill=\"#1f2937\">{}</text>\n",
            0.5 * HEAD + 5.0,
            escape(&self.title)
        );
        for sample in self.legend() {
            if left > 0.0 && left + sample.width() + RIGHT > wide {
                (left, middle) = (0.0, middle + LEGEND);
            }
            svg += &format!(
                "<g transform=\"translate({left:.1} {middle})\">{}<text x=\"42\" y=\"4\">{}</text></g>\n",
                sample.strokes(25.0, 12.0),
                escape(sample.name)
            );
            left += sample.width();
        }
        (svg + "</g>\n", middle + 0.5 * HEAD)
    }
}

/// An entry of a legend.
pub(super) struct Sample<'a> {
    name: &'a str,
    look: Option<Look>,
    mark: Option<Shape>,
    /// It has a value at the cursor.
    has_value: bool,
}

impl Sample<'_> {
    /// Width of the entry with the room before it, CSS pixels.
    fn width(&self) -> f64 {
        48.0 + width(self.name, TEXT_PX)
    }

    /// The line of this length, or the mark at the place `left + length / 2`.
    fn strokes(&self, length: f64, left: f64) -> String {
        let Some(look) = self.look else { return String::new() };
        let Some(shape) = self.mark else {
            let class = if look == Look::Truth { " class=\"truth\"" } else { "" };
            return format!("<path{class} {} d=\"M{left} 0h{length}\"/>", look.stroke());
        };
        let middle = left + 0.5 * length;
        let strokes = shape.strokes(look.colour());
        let one =
            |(class, stroke)| format!("<path class=\"{class}\" {stroke} d=\"M{middle} 0h0\"/>");
        strokes.map(one).collect()
    }

    /// The entry as text of a page, with room for the value at the cursor.
    pub(super) fn html(&self) -> String {
        let (name, value) = (escape(self.name), if self.has_value { "<b></b>" } else { "" });
        let strokes = self.strokes(24.0, 1.0);
        let symbol = if strokes.is_empty() {
            strokes
        } else {
            format!(
                "<svg width=\"26\" height=\"16\" viewBox=\"0 -8 26 16\" aria-hidden=\"true\">{strokes}</svg>"
            )
        };
        format!("<span data-name=\"{name}\">{symbol}{name}{value}</span>")
    }
}
