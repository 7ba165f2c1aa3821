//! One plot: lines, marks, levels, shaded spans and cells of a map on one pair of axes, as SVG. What
//! is in the plot has its own units, in an inner picture that a page's script can move and stretch.

mod legend;
mod plot;
mod sheet;

use super::axis::{self, Scale};
use super::palette::{self, Colour};
use super::svg::escape;
use legend::Sample;

pub use sheet::sheet;
pub(super) use sheet::{WIDE, ZOOM};

/// What a line shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Look {
    /// No line: the area inside the points.
    Area(Colour),
    /// True state of the plant: dark and wide, below the others.
    Truth,
    /// Another true state of the plant, or one of several runs: with its width, CSS pixels.
    Other(Colour, f64),
    /// A sensor's reading or the controller's estimate: thin, above the truth.
    Measured(Colour),
    /// A reference: dashed.
    Wanted,
    /// A bound: dashed, red.
    Limit,
}

impl Look {
    /// Order of drawing, wide lines below thin ones; colour and width, CSS pixels.
    fn style(self) -> (u8, Colour, f64) {
        match self {
            Self::Area(colour) => (0, colour, 0.0),
            Self::Truth => (1, palette::TRUTH, 3.0),
            Self::Other(colour, width) => (2, colour, width),
            Self::Measured(colour) => (3, colour, 1.5),
            Self::Wanted => (4, palette::WANTED, 1.5),
            Self::Limit => (5, palette::LIMIT, 1.2),
        }
    }

    /// Its attributes in SVG.
    fn stroke(self) -> String {
        let (_, colour, width) = self.style();
        if width > 0.0 { stroke(colour, width) } else { format!("fill=\"{colour}\"") }
    }
}

/// Attributes of a stroke: dashed where the colour is one of dashed lines.
fn stroke(colour: Colour, width: f64) -> String {
    let dashes = match colour {
        palette::WANTED => " stroke-dasharray=\"5 3\"",
        palette::LIMIT => " stroke-dasharray=\"10 4\"",
        palette::TOUCH => " stroke-dasharray=\"2 3\"",
        palette::SIMULATED => " stroke-dasharray=\"8 4\"",
        _ => "",
    };
    format!("stroke=\"{colour}\" stroke-width=\"{width}\"{dashes}")
}

/// Points that are joined; what is not finite breaks them.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    /// Its name in the legend.
    pub name: String,
    pub look: Look,
    pub points: Vec<(f64, f64)>,
}

impl Line {
    /// Each point of the line as a dot.
    pub fn dots(&self) -> Marks {
        let Self { name, look, points } = self.clone();
        Marks { name, shape: Shape::Dot, colour: look.style().1, points }
    }
}

/// Shape of a mark. At one place a ring, a square above it and a dot above both can be seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    Dot,
    Ring,
    Square,
    /// A hollow square.
    Frame,
}

impl Shape {
    /// The strokes of a mark of this colour, from below: class and attributes.
    fn strokes(self, colour: Colour) -> impl Iterator<Item = (&'static str, String)> {
        // Cap and width, CSS pixels.
        let all: &[_] = match self {
            Self::Dot => &[("rim", "round", 7.0), ("mark", "round", 5.0)],
            Self::Ring => &[("mark", "round", 15.5), ("rim", "round", 12.5)],
            Self::Square => &[("mark", "square", 8.5)],
            Self::Frame => &[("mark", "square", 8.5), ("rim", "square", 5.5)],
        };
        all.iter().map(move |&(class, cap, width)| {
            let colour = if class == "rim" { "white" } else { colour };
            let width = format!("stroke-width=\"{width}\" stroke-linecap=\"{cap}\"");
            (class, format!("stroke=\"{colour}\" {width}"))
        })
    }
}

/// Points that are marked each.
#[derive(Clone, Debug, PartialEq)]
pub struct Marks {
    /// Their name in the legend.
    pub name: String,
    pub shape: Shape,
    pub colour: Colour,
    pub points: Vec<(f64, f64)>,
}

/// A cell of a map: a coloured rectangle.
#[derive(Clone, Debug, PartialEq)]
pub struct HeatCell {
    pub x: (f64, f64),
    pub y: (f64, f64),
    pub colour: Colour,
    /// What the colour means, in the legend.
    pub name: String,
    /// What is written into it.
    pub text: String,
}

#[derive(Clone, Debug, Default, PartialEq)]
pub struct Panel {
    pub title: String,
    /// Name of the vertical axis, with its unit.
    pub y_name: String,
    /// Name of the horizontal axis, with its unit; empty hides the axis.
    pub x_name: String,
    pub x_axis: Scale,
    pub y_axis: Scale,
    pub x: (f64, f64),
    /// Vertical range, where the data are not to decide.
    pub y: Option<(f64, f64)>,
    /// Values that the vertical axis shows at least.
    pub reach: Vec<f64>,
    /// Least vertical span, so that noise is not blown up.
    pub least_span: f64,
    /// What one of the vertical axis is besides, and in which unit.
    pub also: Option<(f64, &'static str)>,
    pub lines: Vec<Line>,
    pub marks: Vec<Marks>,
    pub cells: Vec<HeatCell>,
    /// Horizontal lines with their names.
    pub levels: Vec<(&'static str, Look, f64)>,
    /// Spans of x that are shaded, with their names.
    pub shades: Vec<(f64, f64, String)>,
    /// Vertical lines with their names, if they have any.
    pub rules: Vec<Rule>,
}

/// A vertical line of a plot.
#[derive(Clone, Debug, PartialEq)]
pub struct Rule {
    pub x: f64,
    pub name: String,
    /// That of a touch of a corner, a face, a fault or a limit.
    pub colour: Colour,
}

impl Rule {
    fn is_fault(&self) -> bool {
        self.colour == palette::LIMIT
    }
}

impl Panel {
    /// The plot as a figure of a page, `attributes` and its `name` for screen readers with it. Title and
    /// legend are text, so that they wrap, and have room for the values at the cursor.
    pub(crate) fn figure(&self, attributes: &str, (wide, high): (u32, u32), name: &str) -> String {
        let ((from, to), (low, high_y), least) = (self.x, self.y_range(), self.least_span);
        let also = self.also.map(|(factor, unit)| format!(" data-also=\"{factor} {unit}\""));
        // The names of lanes have the values at the cursor.
        let lanes = if let Scale::Named(lanes) = &self.y_axis { &lanes[..] } else { &[] };
        let legend = lanes.iter().map(|lane| Sample::lane(&lane.1)).chain(self.legend());
        let legend: String = legend.map(|sample| sample.html()).collect();
        format!(
            "<figure {attributes} data-of=\"{}\" data-x=\"{from} {to}\" data-y=\"{low} {high_y}\" \
data-least=\"{least}\"{}>\n<figcaption><b>{}</b><output></output>{legend}</figcaption>\n\
<svg class=\"plot\" viewBox=\"0 0 {wide} {high}\" role=\"img\" aria-label=\"{}\">\n{}</svg></figure>\n",
            escape(&self.y_name),
            also.unwrap_or_default(),
            escape(&self.title),
            escape(name),
            self.plot((f64::from(wide), f64::from(high)), plot::LEFT, true),
        )
    }

    /// Vertical range of all that is shown. It begins at zero where that hides nothing.
    pub(super) fn y_range(&self) -> (f64, f64) {
        if let Some(range) = self.y {
            return range;
        }
        let shown = self.points().filter(|point| point.0 >= self.x.0 && point.0 <= self.x.1);
        let reach = self.levels.iter().map(|level| level.2).chain(self.reach.iter().copied());
        let range = axis::extent(shown.map(|point| point.1).chain(reach)).unwrap_or((0.0, 1.0));
        let missing = (0.5 * (self.least_span - (range.1 - range.0))).max(0.0);
        let (low, high) = axis::padded((range.0 - missing, range.1 + missing), 0.06);
        let near_zero = (-0.02 * range.1..=0.3 * range.1).contains(&range.0);
        (if near_zero && self.y_axis != Scale::Log { 0.0 } else { low }, high)
    }

    fn points(&self) -> impl Iterator<Item = &(f64, f64)> {
        let lines = self.lines.iter().flat_map(|line| &line.points);
        lines.chain(self.marks.iter().flat_map(|marks| &marks.points))
    }

    /// Whether something is drawn.
    pub(crate) fn has_data(&self) -> bool {
        !self.cells.is_empty() || self.points().any(|point| point.1.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_data_of_a_plot_are_in_its_units_and_its_picture_shows_their_range() {
        let panel = Panel {
            title: "t".to_owned(),
            y_name: "y, mm".into(),
            x_name: "x, s".into(),
            x: (10.0, 20.0),
            y: Some((1.0, 5.0)),
            lines: vec![Line {
                name: "a".into(),
                look: Look::Truth,
                points: vec![(10.0, 1.0), (15.0, f64::NAN), (20.0, 5.00004)],
            }],
            ..Panel::default()
        };
        let html = panel.figure("", (540, 250), "name");
        assert!(html.contains("viewBox=\"10 -5 10 4\""), "{html}");
        assert!(html.contains("d=\"M10 1M20 5\""), "{html}");
        // Upwards is more: the inner picture is turned over, as its range is.
        assert!(html.contains("<g transform=\"scale(1 -1)\""), "{html}");
        assert!(html.contains("data-x=\"10 20\" data-y=\"1 5\""), "{html}");
        assert!(sheet(vec![panel], 1, false).contains("d=\"M0 0M468.8 156\""));
    }

    #[test]
    fn what_is_written_into_a_cell_stands_in_its_middle() {
        let (x, y) = ((0.0, 10.0), (0.0, 4.0));
        let cell = HeatCell { x, y, colour: palette::GAP, name: "n".into(), text: "in".into() };
        let panel = Panel { x, y: Some(y), cells: vec![cell], ..Panel::default() };
        let html = panel.figure("", (540, 250), "name");
        let inner = |name: &str| -> f64 {
            let (_, rest) = html.split_once(" class=\"data\"").expect("an inner picture");
            let (_, value) = rest.split_once(&format!(" {name}=\"")).expect("an attribute");
            value.split('"').next().and_then(|text| text.parse().ok()).expect("a number")
        };
        let at = inner("x") + 0.5 * inner("width");
        assert!(html.contains(&format!("<text x=\"{at:.1}\"")) && html.contains(">in<"), "{html}");
    }

    #[test]
    fn an_axis_begins_at_zero_where_that_hides_nothing() {
        let range = |points: [(f64, f64); 2]| {
            let line = Line { name: "a".into(), look: Look::Truth, points: points.to_vec() };
            Panel { x: (0.0, 1.0), lines: vec![line], ..Panel::default() }.y_range()
        };
        assert_eq!(range([(0.0, -0.01), (1.0, 30.0)]).0, 0.0);
        assert_eq!(range([(0.0, 8.0), (1.0, 30.0)]).0, 0.0);
        assert!(range([(0.0, 20.0), (1.0, 30.0)]).0 > 19.0);
        assert!(range([(0.0, -5.0), (1.0, 30.0)]).0 < -5.0);
        assert_eq!(range([(0.0, 0.0), (1.0, 0.0)]).0, 0.0);
    }
}
