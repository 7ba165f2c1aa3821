//! Title and legend of plots: in their picture, or as text of a page.

use super::plot::RIGHT;
use super::{Look, Panel, Shape};
use crate::report::palette::{self, Colour};
use crate::report::svg::{TEXT_PX, escape, width};

/// Height of a line of titles and legends in a picture.
const LINE: f64 = 20.0;

/// An entry of a legend.
#[derive(Clone, Debug)]
pub(super) struct Sample<'a> {
    name: &'a str,
    look: Option<Look>,
    mark: Option<(Shape, Colour)>,
    /// It has a value at the cursor.
    has_value: bool,
}

impl Panel {
    /// Everything that the legend names, in its order: what has a point in the plot.
    pub(super) fn legend(&self) -> Vec<Sample<'_>> {
        let (x, y) = (self.x, self.y_range());
        let is_inside =
            |point: &&(f64, f64)| (x.0..=x.1).contains(&point.0) && (y.0..=y.1).contains(&point.1);
        let is_shown = |points: &[(f64, f64)]| points.iter().find(is_inside).is_some();
        let sample = |name, look, has_value| Sample { name, look, mark: None, has_value };
        let mark = |name, shape, colour| Sample {
            mark: Some((shape, colour)),
            ..sample(name, None, false)
        };
        let lines = self.lines.iter().filter(|line| is_shown(&line.points));
        let lines = lines.map(|line| match line.look {
            Look::Area(colour) => mark(&*line.name, Shape::Square, colour),
            look => sample(&line.name, Some(look), true),
        });
        let levels = self.levels.iter().filter(|level| (y.0..=y.1).contains(&level.2));
        let levels = levels.map(|&(name, look, _)| sample(name, Some(look), false));
        // The colours whose names are words.
        let mut key: Vec<_> = self.cells.iter().map(|one| (&*one.name, one.colour)).collect();
        key.retain(|one| one.0.parse::<u8>().is_err());
        key.sort_unstable();
        let key = key.into_iter().map(|(name, colour)| mark(name, Shape::Square, colour));
        let marks = self.marks.iter().filter(|marks| is_shown(&marks.points));
        let marks = marks.map(|marks| mark(&*marks.name, marks.shape, marks.colour));
        merged(lines.chain(levels).chain(key).chain(marks))
    }

    /// Title and `legend` and their height: the legend beside the title and in as many rows as it
    /// needs.
    pub(super) fn head(&self, wide: f64, legend: &[Sample<'_>]) -> (String, f64) {
        let mut lines = vec![String::new()];
        for word in self.title.split_inclusive(' ') {
            let last = lines.last_mut().expect("one or more");
            if last.is_empty() || 8.0 + width(last) + width(word.trim_end()) < wide {
                *last += word;
            } else {
                lines.push(word.to_owned());
            }
        }
        let (mut svg, down) = (String::new(), LINE * (lines.len() - 1) as f64);
        for (place, line) in lines.iter().enumerate() {
            svg += &format!(
                "<text x=\"8\" y=\"{}\" font-family=\"sans-serif\" font-size=\"{TEXT_PX}\" font-weight=\"bold\" \
fill=\"{}\">{}</text>\n",
                LINE * (place as f64 + 0.75),
                palette::TRUTH,
                escape(line.trim_end())
            );
        }
        let (legend, high) = flow(legend, width(lines.last().expect("one or more")), wide);
        (format!("{svg}<g transform=\"translate(0 {down})\">\n{legend}</g>\n"), down + high)
    }
}

/// `samples` with those of one name once, where some have a line and some a mark with both.
pub(super) fn merged<'a>(samples: impl Iterator<Item = Sample<'a>>) -> Vec<Sample<'a>> {
    let mut all: Vec<Sample<'_>> = Vec::new();
    for sample in samples {
        match all.iter_mut().find(|one| one.name == sample.name) {
            Some(one) => {
                (one.look, one.mark) = (one.look.or(sample.look), one.mark.or(sample.mark));
            }
            None => all.push(sample),
        }
    }
    all
}

/// A legend from `left` on in as many rows as this width needs, and its height.
pub(super) fn flow(legend: &[Sample<'_>], mut left: f64, wide: f64) -> (String, f64) {
    let mut middle = 0.5 * LINE;
    let mut svg = format!(
        "<g font-family=\"sans-serif\" font-size=\"{TEXT_PX}\" fill=\"{}\">\n",
        palette::TEXT
    );
    for sample in legend {
        let long = 48.0 + width(sample.name);
        if left > 0.0 && left + long + RIGHT > wide {
            (left, middle) = (0.0, middle + LINE);
        }
        svg += &format!(
            "<g transform=\"translate({left:.1} {middle})\">{}<text x=\"42\" y=\"4\">{}</text></g>\n",
            sample.strokes(25.0, 12.0),
            escape(sample.name)
        );
        left += long;
    }
    (svg + "</g>\n", middle + 0.5 * LINE)
}

impl<'a> Sample<'a> {
    /// That of a lane: its name and its value.
    pub(super) fn lane(name: &'a str) -> Self {
        Self { name, look: None, mark: None, has_value: true }
    }

    /// The line of this length, and the mark at the place `left + length / 2`.
    fn strokes(&self, length: f64, left: f64) -> String {
        let line = self.look.map(|look| {
            let class = if look == Look::Truth { " class=\"truth\"" } else { "" };
            format!("<path{class} {} d=\"M{left} 0h{length}\"/>", look.stroke())
        });
        let middle = left + 0.5 * length;
        let mark = self.mark.into_iter().flat_map(|(shape, colour)| shape.strokes(colour));
        let one =
            |(class, stroke)| format!("<path class=\"{class}\" {stroke} d=\"M{middle} 0h0\"/>");
        line.into_iter().chain(mark.map(one)).collect()
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
