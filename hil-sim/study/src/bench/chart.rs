//! Work-precision diagrams: error against cost, both logarithmic, as SVG.

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use hil_sim::report::axis::extent;
use hil_sim::report::svg::{self, Area, Drawn, SCALE, font, size, text_width};

const S: i32 = SCALE as i32;
const SIZE: (u32, u32) = (820, 460);
const TEXT_PX: f64 = 12.0;
const TITLE_PX: f64 = 14.0;
const INK: RGBColor = RGBColor(0x1f, 0x29, 0x37);
const TEXT: RGBColor = RGBColor(0x37, 0x41, 0x51);
const GRID: RGBColor = RGBColor(0xe5, 0xe7, 0xeb);
const AXIS: RGBColor = RGBColor(0x9c, 0xa3, 0xaf);

/// Colours of the series, in their order; told apart by those who see few, too.
const COLOURS: [RGBColor; 8] = [
    RGBColor(0x1f, 0x29, 0x37),
    RGBColor(0x1d, 0x7f, 0xe0),
    RGBColor(0xe0, 0x7b, 0x12),
    RGBColor(0x0f, 0x97, 0x97),
    RGBColor(0xd0, 0x2f, 0x6b),
    RGBColor(0x80, 0x5a, 0xd5),
    RGBColor(0x35, 0xa1, 0x4a),
    RGBColor(0x8b, 0x5e, 0x34),
];

/// Points of one method, in the order of its settings.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Its name in the legend.
    pub name: String,
    /// Cost and error.
    pub points: Vec<(f64, f64)>,
}

/// A diagram.
#[derive(Clone, Debug, PartialEq)]
pub struct Chart {
    /// Above it.
    pub title: String,
    /// Cost with its unit.
    pub x_name: &'static str,
    /// Error with its unit.
    pub y_name: &'static str,
    /// The methods.
    pub series: Vec<Series>,
    /// A point that is ringed, and what it is.
    pub ringed: Option<(&'static str, (f64, f64))>,
    /// A bound on the error, and what it is.
    pub bound: Option<(&'static str, f64)>,
}

impl Chart {
    /// The diagram as SVG; points that are no positive numbers are left out.
    #[must_use]
    pub fn svg(&self) -> String {
        svg::fixed(SIZE, |area| self.draw(area))
    }

    fn shown(&self) -> impl Iterator<Item = (f64, f64)> {
        let all = self.series.iter().flat_map(|series| series.points.iter().copied());
        all.chain(self.ringed.map(|ringed| ringed.1)).filter(|&point| drawable(point))
    }

    fn draw(&self, area: &Area) -> Drawn {
        let x = decades(extent(self.shown().map(|p| p.0)));
        let bound = self.bound.map(|bound| bound.1);
        let y = decades(extent(self.shown().map(|p| p.1).chain(bound)));
        let (head, body) = area.split_vertically(30 * S);
        let style = font(TITLE_PX, INK, HPos::Left, VPos::Center);
        head.draw(&Text::new(self.title.clone(), (8 * S, 16 * S), style))?;
        let widest = self.names().map(|name| text_width(name, TEXT_PX)).max().unwrap_or(0);
        let (wide, _) = body.dim_in_pixel();
        let (plot, legend) = body.split_horizontally(wide as i32 - widest - 40 * S);
        let mut chart = ChartBuilder::on(&plot)
            .margin_left(4 * S)
            .margin_right(18 * S)
            .margin_top(6 * S)
            .x_label_area_size(42 * S)
            .y_label_area_size(72 * S)
            .build_cartesian_2d((x.0..x.1).log_scale(), (y.0..y.1).log_scale())?;
        chart
            .configure_mesh()
            .light_line_style(GRID.mix(0.6))
            .bold_line_style(GRID.stroke_width(2))
            .axis_style(AXIS.stroke_width(2))
            .x_label_style(("sans-serif", size(TEXT_PX), &TEXT))
            .y_label_style(("sans-serif", size(TEXT_PX), &TEXT))
            .axis_desc_style(("sans-serif", size(TEXT_PX), &TEXT))
            .x_label_formatter(&|value| round_number(*value))
            .y_label_formatter(&|value| round_number(*value))
            .x_desc(self.x_name)
            .y_desc(self.y_name)
            .draw()?;
        if let Some((_, level)) = self.bound {
            let ends = [(x.0, level), (x.1, level)];
            chart.draw_series([PathElement::new(ends, bound_style())])?;
        }
        for (series, colour) in self.series.iter().zip(COLOURS.iter().cycle()) {
            let points: Vec<_> = series.points.iter().copied().filter(|&p| drawable(p)).collect();
            chart.draw_series([PathElement::new(points.clone(), colour.stroke_width(3))])?;
            chart.draw_series(points.iter().map(|&p| Circle::new(p, 5 * S, colour.filled())))?;
        }
        if let Some((_, point)) = self.ringed.filter(|ringed| drawable(ringed.1)) {
            chart.draw_series([Circle::new(point, 9 * S, INK.stroke_width(4))])?;
        }
        self.draw_legend(&legend)
    }

    fn names(&self) -> impl Iterator<Item = &str> {
        let series = self.series.iter().map(|series| series.name.as_str());
        series.chain(self.ringed.map(|r| r.0)).chain(self.bound.map(|b| b.0))
    }

    fn draw_legend(&self, legend: &Area) -> Drawn {
        let row = |index: usize| (20 + 20 * index as i32) * S;
        let text = |index: usize, name: &str| -> Drawn {
            let style = font(TEXT_PX, TEXT, HPos::Left, VPos::Center);
            legend.draw(&Text::new(name.to_owned(), (28 * S, row(index)), style))
        };
        for (index, (series, colour)) in self.series.iter().zip(COLOURS.iter().cycle()).enumerate()
        {
            let ends = [(0, row(index)), (22 * S, row(index))];
            legend.draw(&PathElement::new(ends, colour.stroke_width(3)))?;
            legend.draw(&Circle::new((11 * S, row(index)), 5 * S, colour.filled()))?;
            text(index, &series.name)?;
        }
        let mut next = self.series.len();
        if let Some((name, _)) = self.ringed {
            legend.draw(&Circle::new((11 * S, row(next)), 8 * S, INK.stroke_width(4)))?;
            text(next, name)?;
            next += 1;
        }
        if let Some((name, _)) = self.bound {
            let ends = [(0, row(next)), (22 * S, row(next))];
            legend.draw(&PathElement::new(ends, bound_style()))?;
            text(next, name)?;
        }
        Ok(())
    }
}

/// A share of several kinds, one bar a row.
#[derive(Clone, Debug, PartialEq)]
pub struct Bars {
    /// Above them.
    pub title: String,
    /// Unit of the lengths.
    pub x_name: &'static str,
    /// Names of the kinds, in the order of the parts.
    pub kinds: Vec<String>,
    /// Name of a row and the length of each kind's part.
    pub rows: Vec<(String, Vec<f64>)>,
}

impl Bars {
    /// The bars as SVG.
    #[must_use]
    pub fn svg(&self) -> String {
        let height = 110 + 30 * self.rows.len().max(self.kinds.len() * 2 / 3) as u32;
        svg::fixed((SIZE.0, height), |area| self.draw(area))
    }

    fn draw(&self, area: &Area) -> Drawn {
        let (head, body) = area.split_vertically(30 * S);
        let style = font(TITLE_PX, INK, HPos::Left, VPos::Center);
        head.draw(&Text::new(self.title.clone(), (8 * S, 16 * S), style))?;
        let most = self.rows.iter().map(|row| row.1.iter().sum::<f64>()).fold(0.0, f64::max);
        let labels = self.rows.iter().map(|row| text_width(&row.0, TEXT_PX)).max().unwrap_or(0);
        let kinds = self.kinds.iter().map(|kind| text_width(kind, TEXT_PX)).max().unwrap_or(0);
        let (wide, _) = body.dim_in_pixel();
        let (plot, legend) = body.split_horizontally(wide as i32 - kinds - 40 * S);
        let rows = self.rows.len() as f64;
        let mut chart = ChartBuilder::on(&plot)
            .margin_left(4 * S)
            .margin_right(18 * S)
            .x_label_area_size(42 * S)
            .y_label_area_size(labels + 8 * S)
            .build_cartesian_2d(0.0..1.04 * most.max(1e-9), 0.0..rows)?;
        chart
            .configure_mesh()
            .disable_y_mesh()
            .disable_y_axis()
            .light_line_style(TRANSPARENT)
            .bold_line_style(GRID.stroke_width(2))
            .axis_style(AXIS.stroke_width(2))
            .x_label_style(("sans-serif", size(TEXT_PX), &TEXT))
            .axis_desc_style(("sans-serif", size(TEXT_PX), &TEXT))
            .x_label_formatter(&|value| number(*value))
            .x_desc(self.x_name)
            .draw()?;
        for (index, (name, parts)) in self.rows.iter().enumerate() {
            let middle = rows - index as f64 - 0.5;
            let mut from = 0.0;
            for (part, colour) in parts.iter().zip(COLOURS.iter().cycle().skip(1)) {
                let bar = [(from, middle - 0.32), (from + part, middle + 0.32)];
                chart.draw_series([Rectangle::new(bar, colour.filled())])?;
                from += part;
            }
            let (_, at) = chart.backend_coord(&(0.0, middle));
            let style = font(TEXT_PX, TEXT, HPos::Right, VPos::Center);
            let top = 30 * S;
            plot.draw(&Text::new(name.clone(), (labels + 6 * S, at - top), style))?;
        }
        for (index, (kind, colour)) in
            self.kinds.iter().zip(COLOURS.iter().cycle().skip(1)).enumerate()
        {
            let row = (14 + 20 * index as i32) * S;
            let square = [(4 * S, row - 6 * S), (16 * S, row + 6 * S)];
            legend.draw(&Rectangle::new(square, colour.filled()))?;
            let style = font(TEXT_PX, TEXT, HPos::Left, VPos::Center);
            legend.draw(&Text::new(kind.clone(), (24 * S, row), style))?;
        }
        Ok(())
    }
}

fn bound_style() -> ShapeStyle {
    RGBColor(0xb9, 0x1c, 0x1c).stroke_width(3)
}

fn drawable((x, y): (f64, f64)) -> bool {
    x.is_finite() && y.is_finite() && x > 0.0 && y > 0.0
}

/// A range with room at both ends.
fn decades(range: Option<(f64, f64)>) -> (f64, f64) {
    let (low, high) = range.unwrap_or((0.1, 10.0));
    (low / 1.6, high * 1.6)
}

/// A mark of a logarithmic axis: 1, 2 or 5 in its decade, or nothing.
fn round_number(value: f64) -> String {
    let first = value / 10_f64.powf(value.abs().log10().floor());
    let round = [1.0, 2.0, 5.0, 10.0].iter().any(|mark| (first / mark - 1.0).abs() < 1e-6);
    if round { number(value) } else { String::new() }
}

/// A short number: plain where that is short, otherwise a power of ten.
fn number(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let digits = value.abs().log10().floor();
    if (-3.0..5.0).contains(&digits) {
        let decimals = (-digits).max(0.0) as usize + usize::from(digits < 1.0);
        let text = format!("{value:.decimals$}");
        if text.contains('.') {
            text.trim_end_matches('0').trim_end_matches('.').to_owned()
        } else {
            text
        }
    } else {
        format!("{value:.0e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        for (value, text) in [
            (0.001, "0.001"),
            (0.05, "0.05"),
            (1.0, "1"),
            (1.5, "1.5"),
            (20.0, "20"),
            (1e4, "10000"),
            (1e-5, "1e-5"),
            (1e6, "1e6"),
        ] {
            assert_eq!(number(value), text);
        }
    }

    #[test]
    fn a_logarithmic_axis_has_few_marks() {
        let marks: Vec<String> = (1..=10).map(|n| round_number(0.01 * f64::from(n))).collect();
        assert_eq!(marks, ["0.01", "0.02", "", "", "0.05", "", "", "", "", "0.1"]);
    }

    #[test]
    fn a_chart_shows_its_series_and_leaves_out_what_has_no_place() {
        let chart = Chart {
            title: "title".into(),
            x_name: "ms",
            y_name: "%",
            series: vec![Series {
                name: "some method".into(),
                points: vec![(1.0, 0.5), (2.0, 0.0), (4.0, f64::INFINITY), (8.0, 0.1)],
            }],
            ringed: Some(("default", (1.0, 0.5))),
            bound: Some(("allowed", 0.5)),
        };
        let svg = chart.svg();
        for text in ["some method", "default", "allowed", "title"] {
            assert!(svg.contains(text), "{text}");
        }
        // Two points, one sign each in the legend, the ring.
        assert_eq!(svg.matches("<circle").count(), 5);
        assert!(!svg.contains("NaN") && !svg.contains("inf"));
    }

    #[test]
    fn bars_are_drawn_for_every_part() {
        let bars = Bars {
            title: "cycles".into(),
            x_name: "cycles",
            kinds: vec!["a".into(), "b".into()],
            rows: vec![("one".into(), vec![1.0, 2.0]), ("two".into(), vec![3.0, 0.5])],
        };
        // The ground, four parts and two signs.
        assert_eq!(bars.svg().matches("<rect").count(), 7);
    }
}
