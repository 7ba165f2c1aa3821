//! One plot: lines, marks, levels and shaded spans on one pair of axes, with the
//! title and the legend above it, where they cover no data.

use std::borrow::Cow;

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use super::axis::{self, Scale};
use super::decimate::{decimate, inside};
use super::mesh::{self, TEXT_PX};
use super::palette;
use super::svg::{Area, Drawn, SCALE, font, text_width};

const S: i32 = SCALE as i32;
/// Height of the row with title and legend.
pub(super) const HEAD: i32 = 30 * S;
/// Left of everything.
const MARGIN: i32 = 4 * S;
/// Left of the plot: tick labels and the name of the axis.
pub(super) const LEFT: i32 = 72 * S;
/// Right of the plot: half a tick label.
pub(super) const RIGHT: i32 = 18 * S;
/// Height of the row of a legend below the title.
const LEGEND: i32 = 20 * S;
const TITLE_PX: f64 = 14.0;
/// Height of the row with the names of the rules.
const RULES: i32 = 16 * S;
const RULE_PX: f64 = 11.0;

/// What a line shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Look {
    /// A sensor's reading: thin, above the truth.
    Measured(RGBColor),
    /// True state of the plant: dark and wide, below the others.
    Truth,
    /// Another true state of the plant.
    Other(RGBColor),
    /// The controller's estimate: thin, above the truth.
    Estimate(RGBColor),
    /// A reference: dashed.
    Wanted,
    /// A bound: dashed, red.
    Limit,
}

impl Look {
    /// Order of drawing, wide lines below thin ones, and the stroke.
    fn style(self) -> (u8, ShapeStyle) {
        match self {
            Self::Truth => (0, palette::TRUTH.stroke_width(7)),
            Self::Other(colour) => (1, colour.stroke_width(4)),
            Self::Measured(colour) => (2, colour.stroke_width(3)),
            Self::Estimate(colour) => (3, colour.stroke_width(3)),
            Self::Wanted => (4, palette::WANTED.stroke_width(3)),
            Self::Limit => (5, palette::LIMIT.stroke_width(2)),
        }
    }
}

pub(crate) struct Line {
    /// Its name in the legend.
    pub(crate) name: Cow<'static, str>,
    pub(crate) look: Look,
    pub(crate) points: Vec<(f64, f64)>,
}

/// Shape of a mark.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Shape {
    Dot,
    Ring,
    Triangle,
}

pub(crate) struct Marks {
    pub(crate) name: Cow<'static, str>,
    pub(crate) shape: Shape,
    pub(crate) colour: RGBColor,
    /// Shift to the right, drawing units, so that marks of one place are side by side.
    pub(crate) shift: i32,
    pub(crate) points: Vec<(f64, f64)>,
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
    pub(crate) lines: Vec<Line>,
    pub(crate) marks: Vec<Marks>,
    /// Horizontal lines with their names.
    pub(crate) levels: Vec<(&'static str, Look, f64)>,
    /// Spans of x that are shaded.
    pub(crate) shades: Vec<(f64, f64)>,
    /// Vertical lines with their names.
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

/// More height for the last of stacked plots, which has the axis, CSS pixels.
const AXIS_HEIGHT: u32 = 36;

/// Plots over one axis, one below the other, as an SVG of this size, CSS pixels.
pub(crate) fn stacked(size: (u32, u32), panels: &mut [Panel]) -> String {
    let Some((last, above)) = panels.split_last_mut() else { return String::new() };
    let height = SCALE * (size.1 - AXIS_HEIGHT) / (above.len() as u32 + 1);
    super::svg::fixed(size, |area| {
        let mut rest = area.clone();
        for panel in above {
            panel.x_name = None;
            let (top, below) = rest.split_vertically(height);
            panel.draw(&top)?;
            rest = below;
        }
        last.draw(&rest)
    })
}

impl Panel {
    /// Where the plot is in a picture of `size` CSS pixels: left, right, top and bottom, in
    /// drawing units.
    pub(crate) fn frame(&self, size: (u32, u32)) -> [i32; 4] {
        let (wide, high) = ((size.0 * SCALE) as i32, (size.1 * SCALE) as i32);
        let top = self.head_height(wide) + self.top();
        [LEFT, wide - RIGHT, top, high - self.bottom()]
    }

    /// Height above the plot: the names of the rules.
    fn top(&self) -> i32 {
        if self.rules.is_empty() { 2 * S } else { RULES }
    }

    /// Height below the plot.
    fn bottom(&self) -> i32 {
        if self.x_name.is_some() { 40 * S } else { 6 * S }
    }

    /// Draws it into `area`.
    pub(crate) fn draw(&self, area: &Area) -> Drawn {
        let (head, body) = area.split_vertically(self.head_height(area.dim_in_pixel().0 as i32));
        self.draw_head(&head)?;
        let y = self.y_range();
        let (wide, high) = body.dim_in_pixel();
        let most_x = (wide as i32 / (75 * S)).max(2) as usize;
        let most_y = (high as i32 / (27 * S)).clamp(2, 7) as usize;
        let (x_ticks, x_decimals) = axis::ticks(self.x, most_x);
        let (y_ticks, y_decimals) = axis::ticks(y, most_y);
        let mut chart = ChartBuilder::on(&body)
            .margin_left(MARGIN)
            .margin_right(RIGHT)
            .margin_top(self.top())
            .x_label_area_size(self.bottom())
            .y_label_area_size(LEFT - MARGIN)
            .build_cartesian_2d(Scale::new(self.x, x_ticks), Scale::new(y, y_ticks))?;
        for &(from, to) in &self.shades {
            let (from, to) = (from.max(self.x.0), to.min(self.x.1));
            if from < to {
                let span = Rectangle::new([(from, y.0), (to, y.1)], palette::SHADE.filled());
                chart.draw_series([span])?;
            }
        }
        mesh::plain(&mut chart.configure_mesh())
            .x_label_formatter(&|x| match self.x_name {
                Some(_) => axis::label(*x, x_decimals),
                None => String::new(),
            })
            .y_label_formatter(&|y| axis::label(*y, y_decimals))
            .x_desc(self.x_name.unwrap_or_default())
            .y_desc(self.y_name)
            .draw()?;
        for &(_, look, level) in self.levels.iter().filter(|level| (y.0..=y.1).contains(&level.2)) {
            let ends = [(self.x.0, level), (self.x.1, level)];
            chart.draw_series([PathElement::new(ends, look.style().1)])?;
        }
        let rules = self.rules.iter().filter(|rule| (self.x.0..=self.x.1).contains(&rule.x));
        for rule in rules.clone() {
            let ends = [(rule.x, y.0), (rule.x, y.1)];
            chart.draw_series([PathElement::new(ends, rule.colour.stroke_width(3))])?;
        }
        // Two CSS pixels: the lowest and highest values of a column stay.
        let columns = (wide as i32 - LEFT - RIGHT).max(1) as usize / 4;
        let mut lines: Vec<&Line> = self.lines.iter().collect();
        lines.sort_by_key(|line| line.look.style().0);
        for line in lines {
            for piece in decimate(&line.points, self.x, y, columns) {
                chart.draw_series([PathElement::new(piece, line.look.style().1)])?;
            }
        }
        for marks in &self.marks {
            let shown = marks.points.iter().filter(|point| inside(**point, self.x, y));
            for &point in shown {
                let [rim, body] = mark(marks, (marks.shift, 0));
                chart.draw_series([EmptyElement::at(point) + rim + body])?;
            }
        }
        let to_pixel = |x: f64| {
            let part = (x - self.x.0) / (self.x.1 - self.x.0);
            LEFT + (part * f64::from(wide as i32 - LEFT - RIGHT)).round() as i32
        };
        // Touches before faces; a name that would be on another one is left out.
        let mut taken: Vec<(i32, i32)> = Vec::new();
        let is_touch = |rule: &&Rule| rule.colour == palette::TOUCH;
        let (touches, faces): (Vec<&Rule>, Vec<&Rule>) = rules.partition(is_touch);
        for rule in touches.into_iter().chain(faces) {
            let (x, width) = (to_pixel(rule.x), text_width(&rule.name, RULE_PX));
            let is_left = is_touch(&rule) || x + width > wide as i32;
            let (at, side) = if is_left { (x - 4, HPos::Right) } else { (x + 4, HPos::Left) };
            let from = if is_left { at - width } else { at };
            if taken.iter().all(|other| from >= other.1 || from + width <= other.0) {
                let style = font(RULE_PX, rule.colour, side, VPos::Center);
                body.draw(&Text::new(&*rule.name, (at, RULES / 2), style))?;
                taken.push((from, from + width));
            }
        }
        Ok(())
    }

    /// Vertical range of all that is shown.
    fn y_range(&self) -> (f64, f64) {
        if let Some(range) = self.y {
            return range;
        }
        let points = self.lines.iter().flat_map(|line| &line.points);
        let marks = self.marks.iter().flat_map(|marks| &marks.points);
        let shown = points.chain(marks).filter(|point| point.0 >= self.x.0 && point.0 <= self.x.1);
        let levels = self.levels.iter().map(|level| level.2);
        let range = axis::extent(shown.map(|point| point.1).chain(levels)).unwrap_or((0.0, 1.0));
        let missing = (0.5 * (self.least_span - (range.1 - range.0))).max(0.0);
        axis::padded((range.0 - missing, range.1 + missing), 0.06)
    }

    /// Whether something is drawn.
    pub(crate) fn has_data(&self) -> bool {
        let points = self.lines.iter().flat_map(|line| &line.points);
        let marks = self.marks.iter().flat_map(|marks| &marks.points);
        points.chain(marks).any(|point| point.1.is_finite())
    }

    /// Everything that the legend names, in its order: what has a point in the plot.
    fn legend(&self) -> Vec<(&str, Sample<'_>)> {
        let y = self.y_range();
        let has_points =
            |points: &[(f64, f64)]| points.iter().any(|point| inside(*point, self.x, y));
        let lines = self.lines.iter().filter(|line| has_points(&line.points));
        let lines = lines.map(|line| (&*line.name, Sample::Line(line.look)));
        let levels = self.levels.iter().filter(|level| (y.0..=y.1).contains(&level.2));
        let levels = levels.map(|&(name, look, _)| (name, Sample::Line(look)));
        let marks = self.marks.iter().filter(|marks| has_points(&marks.points));
        let marks = marks.map(|marks| (&*marks.name, Sample::Mark(marks)));
        lines.chain(levels).chain(marks).collect()
    }

    /// One row, or two where title and legend do not fit side by side.
    fn head_height(&self, wide: i32) -> i32 {
        let legend: i32 = self.legend().iter().map(Sample::width).sum();
        let title = text_width(&self.title, TITLE_PX);
        let fits = title + legend + RIGHT + 24 * S <= wide;
        if fits { HEAD } else { HEAD + LEGEND }
    }

    /// Title on the left, legend behind it or below: a narrow screen shows the left end first.
    fn draw_head(&self, head: &Area) -> Drawn {
        let high = head.dim_in_pixel().1;
        let style = font(TITLE_PX, palette::TRUTH, HPos::Left, VPos::Center);
        head.draw(&Text::new(self.title.clone(), (8 * S, HEAD / 2), style))?;
        let middle = if high as i32 > HEAD { HEAD - 4 * S + LEGEND / 2 } else { HEAD / 2 };
        let legend = self.legend();
        let behind = if high as i32 > HEAD { 0 } else { text_width(&self.title, TITLE_PX) };
        let mut right = 8 * S + behind + legend.iter().map(Sample::width).sum::<i32>();
        for entry in legend.iter().rev() {
            let (name, sample) = entry;
            let style = font(TEXT_PX, palette::TEXT, HPos::Left, VPos::Center);
            let text = right - text_width(name, TEXT_PX);
            head.draw(&Text::new(*name, (text, middle), style))?;
            match sample {
                Sample::Line(look) => {
                    let ends = [(text - 32 * S, middle), (text - 6 * S, middle)];
                    head.draw(&PathElement::new(ends, look.style().1))?;
                }
                Sample::Mark(marks) => {
                    for part in mark(marks, (text - 13 * S, middle)) {
                        head.draw(&part)?;
                    }
                }
            }
            right -= Sample::width(entry);
        }
        Ok(())
    }
}

/// What is before a name in the legend.
enum Sample<'a> {
    Line(Look),
    Mark(&'a Marks),
}

impl Sample<'_> {
    /// Width of an entry of the legend with the room before it, in drawing units.
    fn width((name, sample): &(&str, Self)) -> i32 {
        let room = match sample {
            Self::Line(_) => 44 * S,
            Self::Mark(_) => 34 * S,
        };
        room + text_width(name, TEXT_PX)
    }
}

/// One mark with a white rim at `at`.
fn mark<'a>(marks: &Marks, at: (i32, i32)) -> [DynElement<'static, SVGBackend<'a>, (i32, i32)>; 2] {
    const R: i32 = 5 * S;
    match marks.shape {
        Shape::Dot => [
            Circle::new(at, R + 2, WHITE.filled()).into_dyn(),
            Circle::new(at, R, marks.colour.filled()).into_dyn(),
        ],
        Shape::Ring => [
            Circle::new(at, R - 1, WHITE.filled()).into_dyn(),
            Circle::new(at, R - 1, marks.colour.stroke_width(4)).into_dyn(),
        ],
        Shape::Triangle => [
            TriangleMarker::new(at, R + 4, WHITE.filled()).into_dyn(),
            TriangleMarker::new(at, R + 1, marks.colour.filled()).into_dyn(),
        ],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::svg;

    #[test]
    fn the_frame_is_where_the_plot_is() {
        let x = (10.0, 20.0);
        let corners = vec![(10.0, 1.0), (20.0, 5.0)];
        for rules in
            [vec![], vec![Rule { x: 12.0, name: "step 1".to_owned(), colour: palette::FACE }]]
        {
            let panel = Panel {
                title: "t".to_owned(),
                y_name: "y, mm",
                x_name: Some("x, s"),
                x,
                y: Some((1.0, 5.0)),
                least_span: 0.0,
                lines: vec![Line { name: "a".into(), look: Look::Truth, points: corners.clone() }],
                marks: Vec::new(),
                levels: Vec::new(),
                shades: Vec::new(),
                rules,
            };
            let [left, right, top, bottom] = panel.frame((540, 250));
            let svg = svg::fluid((540, 250), "", |area| panel.draw(area));
            let line =
                svg.rsplit("<polyline").find(|line| line.contains("stroke=\"#1F2937\"")).unwrap();
            let points = line.split("points=\"").nth(1).unwrap().split('"').next().unwrap();
            let mut ends = points.split_whitespace().map(|point| {
                let (x, y) = point.split_once(',').unwrap();
                (x.parse::<i32>().unwrap(), y.parse::<i32>().unwrap())
            });
            let (first, last) = (ends.next().unwrap(), ends.next_back().unwrap());
            let near = |a: i32, b: i32| (a - b).abs() <= 3;
            assert!(near(first.0, left) && near(first.1, bottom), "{first:?} {left} {bottom}");
            assert!(near(last.0, right) && near(last.1, top), "{last:?} {right} {top}");
        }
    }
}
