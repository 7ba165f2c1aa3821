//! One plot: lines, marks, levels, shaded spans and bands on one pair of axes, as SVG. What is in
//! the plot has its own units, in an inner picture that the page's script can move and stretch.

mod legend;

use std::borrow::Cow;

use plotters::style::RGBColor;

use super::axis;
use super::axis::TEXT_PX;
use super::decimate::decimate;
use super::palette;
use super::svg::{escape, hex, width};
use legend::Sample;

/// Left of the plot: tick labels and the name of the axis, CSS pixels.
const LEFT: f64 = 66.0;
/// Right of the plot: half a tick label.
const RIGHT: f64 = 18.0;
/// Above the plot: the names of the rules.
const RULES: f64 = 16.0;
const RULE_PX: f64 = 11.0;
/// Below the plot: labels of the ticks and the name of the axis.
const BELOW: f64 = 38.0;

/// What a line shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Look {
    /// A sensor's reading or the controller's estimate: thin, above the truth.
    Measured(RGBColor),
    /// True state of the plant: dark and wide, below the others.
    Truth,
    /// Another true state of the plant, or one of several runs: with its width, CSS pixels.
    Other(RGBColor, f64),
    /// A reference: dashed.
    Wanted,
    /// A bound: dashed, red.
    Limit,
}

impl Look {
    /// Order of drawing, wide lines below thin ones; colour and width, CSS pixels.
    fn style(self) -> (u8, RGBColor, f64) {
        match self {
            Self::Truth => (0, palette::TRUTH, 3.0),
            Self::Other(colour, width) => (1, colour, width),
            Self::Measured(colour) => (2, colour, 1.5),
            Self::Wanted => (3, palette::WANTED, 1.5),
            Self::Limit => (4, palette::LIMIT, 1.2),
        }
    }

    pub(crate) fn colour(self) -> RGBColor {
        self.style().1
    }

    /// Attributes of a stroke.
    fn stroke(self) -> String {
        let (_, colour, width) = self.style();
        stroke(colour, width)
    }
}

/// Attributes of a stroke: dashed where the colour is one of dashed lines, else with a class that
/// gives the page's script and style the colour.
fn stroke(colour: RGBColor, width: f64) -> String {
    let dashes = match colour {
        palette::WANTED => " stroke-dasharray=\"5 3\"",
        palette::LIMIT => " stroke-dasharray=\"10 4\"",
        palette::TOUCH => " stroke-dasharray=\"2 3\"",
        _ => "",
    };
    format!("stroke=\"{}\" stroke-width=\"{width}\"{dashes}", hex(colour))
}

pub(crate) struct Line {
    /// Its name in the legend.
    pub(crate) name: Cow<'static, str>,
    pub(crate) look: Look,
    pub(crate) points: Vec<(f64, f64)>,
}

/// Shape of a mark. At one place a ring, a square above it and a dot above both can be seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Shape {
    Dot,
    Ring,
    Square,
}

impl Shape {
    /// The strokes of a mark of this colour, from below: class and attributes.
    fn strokes(self, colour: RGBColor) -> impl Iterator<Item = (&'static str, String)> {
        // Cap and width, CSS pixels.
        let all: &[_] = match self {
            Self::Dot => &[("rim", "round", 7.0), ("mark", "round", 5.0)],
            Self::Ring => &[("mark", "round", 15.5), ("rim", "round", 12.5)],
            Self::Square => &[("mark", "square", 8.5)],
        };
        all.iter().map(move |&(class, cap, width)| {
            let colour = if class == "rim" { "white".to_owned() } else { hex(colour) };
            let width = format!("stroke-width=\"{width}\" stroke-linecap=\"{cap}\"");
            (class, format!("stroke=\"{colour}\" {width}"))
        })
    }
}

pub(crate) struct Marks {
    pub(crate) name: Cow<'static, str>,
    pub(crate) shape: Shape,
    pub(crate) colour: RGBColor,
    pub(crate) points: Vec<(f64, f64)>,
}

/// A stretch of a band.
pub(crate) struct Stretch {
    pub(crate) from: f64,
    pub(crate) to: f64,
    pub(crate) name: String,
    pub(crate) colour: RGBColor,
}

/// One plot.
#[derive(Default)]
pub(crate) struct Panel {
    pub(crate) title: String,
    /// Name of the vertical axis, with its unit.
    pub(crate) y_name: &'static str,
    /// Name of the horizontal axis, with its unit; none hides the axis.
    pub(crate) x_name: Option<&'static str>,
    pub(crate) x: (f64, f64),
    /// Vertical range, where the data are not to decide.
    pub(crate) y: Option<(f64, f64)>,
    /// Least vertical span, so that noise is not blown up.
    pub(crate) least_span: f64,
    /// What one of the vertical axis is besides, and in which unit.
    pub(crate) also: Option<(f64, &'static str)>,
    pub(crate) lines: Vec<Line>,
    pub(crate) marks: Vec<Marks>,
    /// Bands with their names, in place of lines.
    pub(crate) bands: Vec<(&'static str, Vec<Stretch>)>,
    /// Horizontal lines with their names.
    pub(crate) levels: Vec<(&'static str, Look, f64)>,
    /// Spans of x that are shaded, with their names.
    pub(crate) shades: Vec<(f64, f64, String)>,
    /// Vertical lines with their names, if they have any.
    pub(crate) rules: Vec<Rule>,
}

/// A vertical line of a plot.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Rule {
    pub(crate) x: f64,
    pub(crate) name: String,
    /// That of a touch of a corner, a face, a fault or a limit.
    pub(crate) colour: RGBColor,
}

impl Rule {
    fn is_fault(&self) -> bool {
        self.colour == palette::LIMIT
    }
}

/// Of a rule's name: anchor, distance from the line, and the part of the name that is left of that.
type Anchor = (&'static str, f64, f64);

/// Plots over one axis, one below the other, as an SVG of this size on white, CSS pixels.
pub(crate) fn stacked((wide, high): (u32, u32), panels: &mut [Panel]) -> String {
    let each = (f64::from(high) - BELOW) / panels.len().max(1) as f64;
    let last = panels.len().saturating_sub(1);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{wide}\" height=\"{high}\" \
viewBox=\"0 0 {wide} {high}\">\n<style>.data path {{ vector-effect: non-scaling-stroke; }}</style>\n<rect width=\"{wide}\" height=\"{high}\" fill=\"white\"/>\n"
    );
    for (place, panel) in panels.iter_mut().enumerate() {
        panel.x_name = panel.x_name.filter(|_| place == last);
        let high = if place == last { each + BELOW } else { each };
        let (plot, _) = panel.small((f64::from(wide), high));
        let down = place as f64 * each;
        svg += &format!("<g transform=\"translate(0 {down:.1})\">\n{plot}</g>\n");
    }
    svg + "</svg>\n"
}

/// `value` with no more digits than a `part` of 10^4 of `range` needs.
fn digits(value: f64, range: (f64, f64)) -> f64 {
    let scale = 10_f64.powf((3.5 - (range.1 - range.0).log10()).ceil());
    (value * scale).round() / scale + 0.0
}

impl Panel {
    /// The plot as a figure of a page, `attributes` and its `name` for screen readers with it. Title and
    /// legend are text, so that they wrap, and have room for the values at the cursor.
    pub(crate) fn figure(&self, attributes: &str, (wide, high): (u32, u32), name: &str) -> String {
        let ((from, to), (low, high_y), least) = (self.x, self.y_range(), self.least_span);
        let also = self.also.map(|(factor, unit)| format!(" data-also=\"{factor} {unit}\""));
        let legend: String = self.legend().iter().map(Sample::html).collect();
        format!(
            "<figure {attributes} data-of=\"{}\" data-x=\"{from} {to}\" data-y=\"{low} {high_y}\" \
data-least=\"{least}\"{}>\n<figcaption><b>{}</b><output></output>{legend}</figcaption>\n\
<svg class=\"plot\" viewBox=\"0 0 {wide} {high}\" role=\"img\" aria-label=\"{}\">\n{}</svg></figure>\n",
            escape(self.y_name),
            also.unwrap_or_default(),
            escape(&self.title),
            escape(name),
            self.plot((f64::from(wide), f64::from(high))),
        )
    }

    /// Title and plot in a picture of this size, and where the plot is: left, right, top, bottom; CSS
    /// pixels.
    pub(super) fn small(&self, (wide, high): (f64, f64)) -> (String, [f64; 4]) {
        let (head, taken) = self.head(wide);
        let plot = self.plot((wide, high - taken));
        let svg = format!("{head}<g transform=\"translate(0 {taken})\">\n{plot}</g>\n");
        (svg, [LEFT, wide - RIGHT, taken + RULES, high - self.below()])
    }

    /// Height below the plot, CSS pixels.
    fn below(&self) -> f64 {
        if self.x_name.is_some() { BELOW } else { 6.0 }
    }

    /// Axes, names and data in a picture of this size, CSS pixels.
    fn plot(&self, (wide, high): (f64, f64)) -> String {
        let (x, y) = (self.x, self.y_range());
        let bottom = high - self.below();
        let (across, down) = (wide - LEFT - RIGHT, bottom - RULES);
        let x_at = |value: f64| LEFT + (value - x.0) / (x.1 - x.0) * across;
        let y_at = |value: f64| bottom - (value - y.0) / (y.1 - y.0) * down;
        let text = |(x, y): (f64, f64), anchor: &str, more: &str, text: &str| {
            let text = escape(text);
            format!(
                "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\"{more}>{text}</text>\n"
            )
        };
        let grid = |d: String| {
            format!("<path class=\"grid\" stroke=\"{}\" d=\"{d}\"/>\n", hex(palette::GRID))
        };
        let mut axes = String::new();
        let (ticks, decimals) = axis::ticks(x, (wide / 75.0).max(2.0) as usize);
        for tick in ticks {
            let at = x_at(tick);
            axes += &grid(format!("M{at:.1} {RULES}V{bottom:.1}"));
            if self.x_name.is_some() {
                axes += &text((at, bottom + 16.0), "middle", "", &axis::label(tick, decimals));
            }
        }
        let (ticks, decimals) = axis::ticks(y, (high / 27.0).clamp(2.0, 7.0) as usize);
        for tick in ticks.into_iter().filter(|_| self.bands.is_empty()) {
            let at = y_at(tick);
            axes += &grid(format!("M{LEFT} {at:.1}H{}", wide - RIGHT));
            axes += &text((LEFT - 6.0, at + 4.0), "end", "", &axis::label(tick, decimals));
        }
        let mut names = String::new();
        let middle = LEFT + 0.5 * across;
        if let Some(name) = self.x_name {
            names += &text((middle, bottom + 33.0), "middle", " class=\"across\"", name);
        }
        let turned = format!(" transform=\"rotate(-90 14 {0:.1})\"", RULES + 0.5 * down);
        names += &text((14.0, RULES + 0.5 * down), "middle", &turned, self.y_name);
        for (place, (name, _)) in self.bands.iter().enumerate() {
            names += &text((LEFT - 6.0, y_at(-0.5 - place as f64) + 4.0), "end", "", name);
        }
        let size = format!(" font-size=\"{RULE_PX}\"");
        let mut labels = String::new();
        for (at, anchor, name, colour) in self.names(x_at, wide) {
            let more = format!("{size} fill=\"{}\"", hex(colour));
            labels += &text((at, 0.75 * RULES), anchor, &more, name);
        }
        format!(
            "<g class=\"text\" font-family=\"sans-serif\" font-size=\"{TEXT_PX}\" fill=\"#374151\">\n\
<g class=\"axes\">\n{axes}</g>\n{names}</g>\n<svg class=\"data\" x=\"{LEFT}\" y=\"{RULES}\" width=\"{across}\" \
height=\"{down}\" viewBox=\"{} {} {} {}\" preserveAspectRatio=\"none\">\n\
<g transform=\"scale(1 -1)\" fill=\"none\">\n{}</g></svg>\n\
<path class=\"axis\" fill=\"none\" stroke=\"#9ca3af\" d=\"M{LEFT} {RULES}V{bottom:.1}H{:.1}\"/>\n\
<g class=\"labels\" font-family=\"sans-serif\">\n{labels}</g>\n",
            x.0,
            -y.1,
            x.1 - x.0,
            y.1 - y.0,
            self.data(across),
            wide - RIGHT,
        )
    }

    /// Places, anchors, names and colours for rules and shaded spans. Faults choose first, then spans. A
    /// name without room to the right of its rule is to the left, else left out unless a fault's.
    fn names<'a>(
        &'a self,
        x_at: impl Fn(f64) -> f64,
        wide: f64,
    ) -> Vec<(f64, &'static str, &'a str, RGBColor)> {
        let shown = |rule: &&Rule| (self.x.0..=self.x.1).contains(&rule.x) && !rule.name.is_empty();
        let (faults, limits): (Vec<&Rule>, Vec<&Rule>) =
            self.rules.iter().filter(shown).partition(|rule| rule.is_fault());
        let beside: [Anchor; 2] = [("start", 2.0, 0.0), ("end", -2.0, 1.0)];
        let rule = |rule: &Rule| (x_at(rule.x), &beside[..], rule.colour);
        let rules = |rules: Vec<&'a Rule>| rules.into_iter().map(|one| (rule(one), &*one.name));
        let spans = self.shades.iter().filter_map(|(from, to, name)| {
            let (from, to) = (from.max(self.x.0), to.min(self.x.1));
            let at = (x_at(0.5 * (from + to)), &[("middle", 0.0, 0.5)][..], palette::FACE);
            (from < to).then_some((at, &**name))
        });
        let mut taken: Vec<(f64, f64)> = Vec::new();
        let place = |((at, anchors, colour), name): ((f64, &[Anchor], _), _)| {
            let long = width(name, RULE_PX);
            let from = |anchor: &Anchor| at + anchor.1 - anchor.2 * long;
            let within = |anchor: &&Anchor| from(anchor) >= 0.0 && from(anchor) + long <= wide;
            let is_free = |anchor: &&Anchor| {
                taken.iter().all(|other| from(anchor) >= other.1 || from(anchor) + long <= other.0)
            };
            let mut places = anchors.iter().filter(within);
            let forced = places.clone().next_back().filter(|_| colour == palette::LIMIT);
            let anchor = places.find(is_free).or(forced)?;
            taken.push((from(anchor) - 2.0, from(anchor) + long + 2.0));
            Some((at + anchor.1, anchor.0, name, colour))
        };
        rules(faults).chain(spans).chain(rules(limits)).filter_map(place).collect()
    }

    /// Everything with a place on both axes, in their units, for a plot that is `across` CSS pixels wide.
    fn data(&self, across: f64) -> String {
        let (x, y) = (self.x, self.y_range());
        // Beyond both ends, so that it reaches them after every zoom.
        let (tall, long) = (10.0 * (y.1 - y.0), 10.0 * (x.1 - x.0));
        let path = |class: &str, name: &str, stroke: &str, d: &str| {
            let name = escape(name);
            format!("<path class=\"{class}\" data-name=\"{name}\" {stroke} d=\"{d}\"/>\n")
        };
        let mut svg = String::new();
        let rect = |class: &str, colour, span: (f64, f64), (low, high): (f64, f64), name: &str| {
            let (from, wide) = (digits(span.0, x), digits(span.1 - span.0, x).max(0.0));
            let (fill, name, high) = (hex(colour), escape(name), high - low);
            format!(
                "<rect class=\"{class}\" data-name=\"{name}\" fill=\"{fill}\" x=\"{from}\" \
y=\"{low}\" width=\"{wide}\" height=\"{high}\"/>\n"
            )
        };
        for (from, to, name) in &self.shades {
            let all = (y.0 - tall, y.1 + tall);
            svg += &rect("shade", palette::SHADE, (*from, *to), all, name);
        }
        for (place, (_, stretches)) in self.bands.iter().enumerate() {
            let low = -0.92 - place as f64;
            for Stretch { from, to, name, colour } in stretches {
                svg += &rect("band", *colour, (*from, *to), (low, low + 0.84), name);
            }
        }
        for &(name, look, level) in &self.levels {
            let d = format!("M{} {level}H{}", x.0 - long, x.1 + long);
            svg += &path("level", name, &look.stroke(), &d);
        }
        for rule in &self.rules {
            let d = format!("M{} {}V{}", digits(rule.x, x), y.0 - tall, y.1 + tall);
            let class = if rule.is_fault() { "rule fault" } else { "rule" };
            svg += &path(class, &rule.name, &stroke(rule.colour, 1.5), &d);
        }
        let point = |&(a, b): &(f64, f64)| format!("{} {}", digits(a, x), digits(b, y));
        let mut lines: Vec<&Line> = self.lines.iter().collect();
        lines.sort_by_key(|line| line.look.style().0);
        for Line { name, look, points } in lines {
            // Two CSS pixels: the lowest and highest values of a column stay.
            let pieces = decimate(points, x, (across / 2.0).max(1.0) as usize);
            let piece = |piece: Vec<(f64, f64)>| {
                // Of a level stretch both ends.
                let same = |a: usize, b: usize| {
                    piece
                        .get(a)
                        .zip(piece.get(b))
                        .is_some_and(|(a, b)| digits(a.1, y) == digits(b.1, y))
                };
                let kept = |i: &usize| *i == 0 || !(same(i - 1, *i) && same(*i, i + 1));
                let kept = (0..piece.len()).filter(kept).map(|i| point(&piece[i]));
                format!("M{}", kept.collect::<Vec<_>>().join(" "))
            };
            let d: String = pieces.into_iter().map(piece).collect();
            let class = if *look == Look::Truth { "line truth" } else { "line" };
            svg += &path(class, name, &look.stroke(), &d);
        }
        for Marks { name, shape, colour, points } in &self.marks {
            let points = points.iter().filter(|point| point.0.is_finite() && point.1.is_finite());
            let d: String = points.map(|at| format!("M{}h0", point(at))).collect();
            for (class, stroke) in shape.strokes(*colour) {
                svg += &path(class, name, &stroke, &d);
            }
        }
        svg
    }

    /// Vertical range of all that is shown. It begins at zero where that hides nothing.
    pub(super) fn y_range(&self) -> (f64, f64) {
        if let Some(range) = self.y {
            return range;
        }
        if !self.bands.is_empty() {
            return (-(self.bands.len() as f64), 0.0);
        }
        let shown = self.points().filter(|point| point.0 >= self.x.0 && point.0 <= self.x.1);
        let levels = self.levels.iter().map(|level| level.2);
        let range = axis::extent(shown.map(|point| point.1).chain(levels)).unwrap_or((0.0, 1.0));
        let missing = (0.5 * (self.least_span - (range.1 - range.0))).max(0.0);
        let (low, high) = axis::padded((range.0 - missing, range.1 + missing), 0.06);
        let near_zero = (-0.02 * range.1..=0.3 * range.1).contains(&range.0);
        (if near_zero { 0.0 } else { low }, high)
    }

    fn points(&self) -> impl Iterator<Item = &(f64, f64)> {
        let lines = self.lines.iter().flat_map(|line| &line.points);
        lines.chain(self.marks.iter().flat_map(|marks| &marks.points))
    }

    /// Whether something is drawn.
    pub(crate) fn has_data(&self) -> bool {
        !self.bands.is_empty() || self.points().any(|point| point.1.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_data_of_a_plot_are_in_its_units_and_its_picture_shows_their_range() {
        let panel = Panel {
            title: "t".to_owned(),
            y_name: "y, mm",
            x_name: Some("x, s"),
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
        assert!(html.contains("data-x=\"10 20\" data-y=\"1 5\""), "{html}");
        assert!(stacked((540, 250), &mut [panel]).contains("d=\"M10 1M20 5\""));
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
