//! Axes, names and data of a plot.

use super::{HeatCell, Line, Marks, Panel, Rule, stroke};
use crate::report::axis::Scale;
use crate::report::decimate::decimate;
use crate::report::palette::{self, Colour};
use crate::report::svg::{TEXT_PX, escape, width};

/// Left of the plot, where nothing else decides: tick labels and the name of the axis, user units.
pub(super) const LEFT: f64 = 66.0;
/// Right of the plot: half a tick label.
pub(super) const RIGHT: f64 = 12.0;
/// Above the plot: the names of the rules, or half a tick label.
const RULES: f64 = 16.0;
const ABOVE: f64 = 6.0;
/// Below the plot: labels of the ticks and the name of the axis.
const BELOW: f64 = 38.0;

/// Of a rule's name: anchor, distance from the line, and the part of the name that is left of that.
type Anchor = (&'static str, f64, f64);

/// `value` with no more digits than a `part` of 10^4 of `range` needs.
fn digits(value: f64, range: (f64, f64)) -> f64 {
    let scale = 10_f64.powf((3.5 - (range.1 - range.0).log10()).ceil());
    (value * scale).round() / scale + 0.0
}

fn text((x, y): (f64, f64), anchor: &str, more: &str, text: &str) -> String {
    let text = escape(text);
    format!("<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\"{more}>{text}</text>\n")
}

impl Panel {
    /// Height above the plot, user units.
    pub(super) fn above(&self) -> f64 {
        if self.shades.is_empty() && self.rules.is_empty() { ABOVE } else { RULES }
    }

    /// Height below the plot, user units.
    pub(super) fn below(&self) -> f64 {
        if self.x_name.is_empty() { 6.0 } else { BELOW }
    }

    fn y_ticks(&self, high: f64) -> Vec<(f64, String)> {
        self.y_axis.ticks(self.y_range(), (high / 27.0).clamp(2.0, 7.0) as usize)
    }

    /// Room left of a plot of this height for the labels that it has, user units.
    pub(super) fn left(&self, high: f64) -> f64 {
        24.0 + self.y_ticks(high).iter().map(|tick| width(&tick.1)).fold(0.0, f64::max)
    }

    /// Axes, names and data in a picture of this size with so much `left` of the plot, user units.
    pub(super) fn plot(&self, (wide, high): (f64, f64), left: f64, own_units: bool) -> String {
        let (x, y) = (self.x, self.y_range());
        let (top, bottom, end) = (self.above(), high - self.below(), wide - RIGHT);
        let (across, down) = (end - left, bottom - top);
        let x_at = |value: f64| left + (value - x.0) / (x.1 - x.0) * across;
        let y_at = |value: f64| bottom - (value - y.0) / (y.1 - y.0) * down;
        let grid =
            |d: String| format!("<path class=\"grid\" stroke=\"{}\" d=\"{d}\"/>\n", palette::GRID);
        let (mut axes, mut names) = (String::new(), String::new());
        for (tick, label) in self.x_axis.ticks(x, (across / 45.0).clamp(2.0, 10.0) as usize) {
            let at = x_at(tick);
            axes += &grid(format!("M{at:.1} {top}V{bottom:.1}"));
            if !self.x_name.is_empty() {
                axes += &text((at, bottom + 16.0), "middle", "", &label);
            }
        }
        for (tick, label) in self.y_ticks(high) {
            let at = y_at(tick);
            let label = text((left - 6.0, at + 4.0), "end", "", &label);
            // The page's script draws the axes again, but not the names of lanes.
            if let Scale::Named(_) = self.y_axis {
                names += &label;
            } else {
                axes += &(grid(format!("M{left} {at:.1}H{end}")) + &label);
            }
        }
        // The page's script moves data that are in their own units.
        let to = if own_units { [x, y] } else { [(0.0, across), (0.0, down)] };
        let (middle, centre) = (left + 0.5 * across, top + 0.5 * down);
        if !self.x_name.is_empty() {
            names += &text((middle, bottom + 33.0), "middle", " class=\"across\"", &self.x_name);
        }
        let turned = format!(" transform=\"rotate(-90 14 {centre:.1})\"");
        names += &text((14.0, centre), "middle", &turned, &self.y_name);
        let mut labels = String::new();
        for (at, anchor, name, colour) in self.names(x_at, wide) {
            labels += &text((at, 0.75 * RULES), anchor, &format!(" fill=\"{colour}\""), name);
        }
        for HeatCell { x, y, text: inside, .. } in self.cells.iter().filter(|c| !c.text.is_empty())
        {
            let at = (x_at(0.5 * (x.0 + x.1)), y_at(0.5 * (y.0 + y.1)) + 4.0);
            labels += &text(at, "middle", "", inside);
        }
        format!(
            "<g class=\"text\" font-family=\"sans-serif\" font-size=\"{TEXT_PX}\" fill=\"{}\">\n\
<g class=\"axes\">\n{axes}</g>\n{names}<svg class=\"data\" x=\"{left}\" y=\"{top}\" width=\"{across}\" \
height=\"{down}\" viewBox=\"{} {} {} {}\" preserveAspectRatio=\"none\">\n\
<g transform=\"scale(1 -1)\" fill=\"none\">\n{}</g></svg>\n\
<path class=\"axis\" fill=\"none\" stroke=\"{}\" d=\"M{left} {top}V{bottom:.1}H{end:.1}\"/>\n\
<g class=\"labels\">\n{labels}</g></g>\n",
            palette::TEXT,
            to[0].0,
            -to[1].1,
            to[0].1 - to[0].0,
            to[1].1 - to[1].0,
            self.data(across, to),
            palette::AXIS,
        )
    }

    /// Places, anchors, names and colours for rules and shaded spans. Faults choose first, then spans. A
    /// name without room to the right of its rule is to the left, else left out unless a fault's.
    fn names<'a>(
        &'a self,
        x_at: impl Fn(f64) -> f64,
        wide: f64,
    ) -> Vec<(f64, &'static str, &'a str, Colour)> {
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
            let long = width(name);
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

    /// Everything with a place on both axes, `to` these ends, for a plot `across` user units wide.
    fn data(&self, across: f64, to: [(f64, f64); 2]) -> String {
        let (x, y) = (self.x, self.y_range());
        let x_at = |v: f64| digits(to[0].0 + (v - x.0) / (x.1 - x.0) * (to[0].1 - to[0].0), to[0]);
        let y_at = |v: f64| digits(to[1].0 + (v - y.0) / (y.1 - y.0) * (to[1].1 - to[1].0), to[1]);
        // Beyond both ends, so that it reaches them after every zoom.
        let (tall, long) = (10.0 * (y.1 - y.0), 10.0 * (x.1 - x.0));
        let path = |class: &str, name: &str, stroke: &str, d: &str| {
            let name = escape(name);
            format!("<path class=\"{class}\" data-name=\"{name}\" {stroke} d=\"{d}\"/>\n")
        };
        let mut svg = String::new();
        let mut rect = |class, fill, span: (f64, f64), (low, high): (f64, f64), name: &str| {
            let (from, wide) = (x_at(span.0), digits(x_at(span.1) - x_at(span.0), to[0]).max(0.0));
            let (name, low) = (escape(name), y_at(low));
            let high = digits(y_at(high) - low, to[1]);
            svg += &format!(
                "<rect class=\"{class}\" data-name=\"{name}\" fill=\"{fill}\" x=\"{from}\" \
y=\"{low}\" width=\"{wide}\" height=\"{high}\"/>\n"
            );
        };
        for (from, to, name) in &self.shades {
            rect("shade", palette::SHADE, (*from, *to), (y.0 - tall, y.1 + tall), name);
        }
        for HeatCell { x, y, colour, name, .. } in &self.cells {
            rect("band", *colour, *x, *y, name);
        }
        for &(name, look, level) in &self.levels {
            let d = format!("M{} {}H{}", x_at(x.0 - long), y_at(level), x_at(x.1 + long));
            svg += &path("level", name, &look.stroke(), &d);
        }
        for rule in &self.rules {
            let d = format!("M{} {}V{}", x_at(rule.x), y_at(y.0 - tall), y_at(y.1 + tall));
            let class = if rule.is_fault() { "rule fault" } else { "rule" };
            svg += &path(class, &rule.name, &stroke(rule.colour, 1.5), &d);
        }
        let point = |&(a, b): &(f64, f64)| format!("{} {}", x_at(a), y_at(b));
        let mut lines: Vec<&Line> = self.lines.iter().collect();
        lines.sort_by_key(|line| line.look.style().0);
        for Line { name, look, points } in lines {
            // Two units: the lowest and highest values of a column stay.
            let pieces = decimate(points, x, (across / 2.0).max(1.0) as usize);
            let piece = |piece: Vec<(f64, f64)>| {
                // Of a level stretch both ends.
                let level = |i: usize| piece.get(i).map(|point| y_at(point.1));
                let inside = |i: usize| level(i - 1) == level(i) && level(i) == level(i + 1);
                let kept = |i: &usize| *i == 0 || !inside(*i);
                let kept = (0..piece.len()).filter(kept).map(|i| point(&piece[i]));
                format!("M{}", kept.collect::<Vec<_>>().join(" "))
            };
            let d: String = pieces.into_iter().map(piece).collect();
            let class = if *look == super::Look::Truth { "line truth" } else { "line" };
            svg += &path(class, name, &look.stroke(), &d);
        }
        for Marks { name, shape, colour, points } in &self.marks {
            let points = points.iter().filter(|point| point.0.is_finite() && point.1.is_finite());
            let d: String = points.map(|at| format!("M{}h0", point(at))).collect();
            for (class, stroke) in shape.strokes(colour) {
                svg += &path(class, name, &stroke, &d);
            }
        }
        svg
    }
}
