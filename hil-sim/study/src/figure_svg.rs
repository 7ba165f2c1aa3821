//! Figures as SVG: plots in rows below one legend, each source with the same look in
//! all of them.

use std::collections::BTreeSet;

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use crate::figure::{Figure, Panel, Series, Source};

use hil_sim::report::axis::{self, Scale, TEXT_PX, extent, label, padded, ticks};
use hil_sim::report::palette;
use hil_sim::report::svg::{Area, Drawn, SCALE, fixed, font, text_width};

const S: i32 = SCALE as i32;
/// Width of a figure, CSS pixels: its text can still be read at 400.
const WIDTH: u32 = 640;
/// Most plots side by side.
const COLUMNS: usize = 2;
/// Height of a row of plots.
const ROW: u32 = 240;
/// Height of a line of the legend.
const LINE: u32 = 26;
/// Height of a plot's title.
const TITLE: u32 = 26;
const TITLE_PX: f64 = 13.0;

/// Colour of the band over all runs.
const BAND: RGBColor = RGBColor(0xfb, 0xe9, 0xd2);
const EXPERIMENT: RGBColor = palette::PRELOAD;
const PUBLISHED: RGBColor = palette::GAP;
/// Colours of methods by number.
const METHODS: [RGBColor; 7] = [
    palette::TRUTH,
    palette::SPEED,
    palette::PRELOAD,
    palette::RADIUS,
    palette::GAP,
    palette::COMPRESSION,
    palette::SLIP,
];

pub fn svg(figure: &Figure) -> String {
    let columns = figure.columns.clamp(1, COLUMNS);
    let rows = figure.panels.len().div_ceil(columns) as u32;
    let entries = entries(figure);
    let places = places(&entries);
    let head = places.last().map_or(0, |place| place.1 + LINE as i32 * S / 2) as u32 / SCALE + 4;
    fixed((WIDTH, head + rows * ROW), |area| {
        let (head, body) = area.split_vertically(head * SCALE);
        for (entry, &place) in entries.iter().zip(&places) {
            legend(entry, place, &head)?;
        }
        let cells = body.split_evenly((rows as usize, columns));
        for (panel, cell) in figure.panels.iter().zip(&cells) {
            draw(panel, cell)?;
        }
        Ok(())
    })
}

/// Entries of the legend: each source with its name, and the band over all runs (none).
fn entries(figure: &Figure) -> Vec<(Option<Source>, &str)> {
    let series = || figure.panels.iter().flat_map(|panel| &panel.series);
    let sources: BTreeSet<(Source, &str)> = series().map(Series::legend).collect();
    let band =
        series().any(|one| !one.range.is_empty()).then_some((None, "range of all forty runs"));
    sources.into_iter().map(|(source, text)| (Some(source), text)).chain(band).collect()
}

/// Left end and middle of each entry, in lines that fit the width, drawing units.
fn places(entries: &[(Option<Source>, &str)]) -> Vec<(i32, i32)> {
    let (first, line) = (16 * S, LINE as i32 * S);
    let (mut left, mut middle) = (first, line / 2 + 2 * S);
    let place = |(_, text): &(Option<Source>, &str)| {
        let wide = 34 * S + text_width(text, TEXT_PX);
        if left > first && left + wide > WIDTH as i32 * S {
            (left, middle) = (first, middle + line);
        }
        let at = left;
        left += wide + 14 * S;
        (at, middle)
    };
    entries.iter().map(place).collect()
}

fn legend(
    &(source, text): &(Option<Source>, &str),
    (left, middle): (i32, i32),
    head: &Area,
) -> Drawn {
    let centre = (left + 14 * S, middle);
    match source {
        Some(source @ (Source::Published | Source::Fitted)) => {
            for part in diamond(centre, source) {
                head.draw(&part)?;
            }
        }
        Some(source) => {
            let ends = [(left, middle), (left + 28 * S, middle)];
            head.draw(&PathElement::new(ends, stroke(source)))?;
            if matches!(source, Source::Method(_)) {
                head.draw(&Circle::new(centre, 4 * S, stroke(source).filled()))?;
            }
        }
        None => {
            let corners = [(left, middle - 7 * S), (left + 28 * S, middle + 7 * S)];
            head.draw(&Rectangle::new(corners, BAND.filled()))?;
        }
    }
    let style = font(TEXT_PX, palette::TEXT, HPos::Left, VPos::Center);
    head.draw(&Text::new(text.to_owned(), (left + 34 * S, middle), style))
}

fn stroke(source: Source) -> ShapeStyle {
    match source {
        Source::Theory => palette::TRUTH.stroke_width(4),
        Source::Simulation => palette::SIMULATED.stroke_width(4),
        Source::Experiment => EXPERIMENT.stroke_width(3),
        Source::FiniteElements | Source::Published | Source::Fitted => PUBLISHED.stroke_width(3),
        Source::Method(number) => METHODS[number % METHODS.len()].stroke_width(3),
    }
}

/// Order of drawing: what is wide stays below what is thin.
fn layer(source: Source) -> u8 {
    match source {
        Source::Experiment => 0,
        Source::Theory => 1,
        Source::Simulation => 2,
        Source::FiniteElements | Source::Published | Source::Fitted | Source::Method(_) => 3,
    }
}

fn draw(panel: &Panel, cell: &Area) -> Drawn {
    if !panel.logarithmic {
        return draw_scaled(panel, cell);
    }
    // Decimal logarithms; what is not above 0 is left out.
    let mut scaled = panel.clone();
    for series in &mut scaled.series {
        series.points.retain(|&(x, y)| x > 0.0 && y > 0.0 && (x * y).is_finite());
        series.points.iter_mut().for_each(|p| *p = (p.0.log10(), p.1.log10()));
    }
    draw_scaled(&scaled, cell)
}

/// Ticks of a logarithmic axis: decades, or 1, 2 and 5 where these are few.
fn decades((low, high): (f64, f64)) -> Vec<f64> {
    let within: &[f64] = if high - low < 2.5 { &[1.0, 2.0, 5.0] } else { &[1.0] };
    let all = (low.floor() as i32..=high.ceil() as i32)
        .flat_map(|decade| within.iter().map(move |part| part.log10() + f64::from(decade)));
    all.filter(|tick| (low..=high).contains(tick)).collect()
}

/// A power of ten with as many digits as it takes.
fn power(exponent: f64) -> String {
    let value = 10_f64.powf(exponent);
    if (1e-3..1e5).contains(&value) {
        format!("{value:.3}").trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        format!("{value:.0e}")
    }
}

fn draw_scaled(panel: &Panel, cell: &Area) -> Drawn {
    let (head, body) = cell.split_vertically(TITLE * SCALE);
    let style = font(TITLE_PX, palette::TRUTH, HPos::Left, VPos::Center);
    head.draw(&Text::new(panel.title.clone(), (16 * S, (TITLE * SCALE) as i32 / 2), style))?;
    let (x, y) = ranges(panel);
    let (wide, high) = body.dim_in_pixel();
    let (mut x_ticks, x_decimals) = ticks(x, (wide as i32 / (62 * S)).max(2) as usize);
    if !panel.categories.is_empty() {
        x_ticks = (0..panel.categories.len()).map(|i| i as f64).collect();
    }
    let (mut y_ticks, y_decimals) = ticks(y, (high as i32 / (30 * S)).clamp(2, 7) as usize);
    if panel.logarithmic {
        (x_ticks, y_ticks) = (decades(x), decades(y));
    }
    let shown = |value: f64, decimals| {
        if panel.logarithmic { power(value) } else { label(value, decimals) }
    };
    let widest = y_ticks.iter().map(|&y| text_width(&shown(y, y_decimals), TEXT_PX)).max();
    let mut chart = ChartBuilder::on(&body)
        .margin_left(6 * S)
        .margin_right(16 * S)
        .margin_top(4 * S)
        .x_label_area_size(38 * S)
        .y_label_area_size(widest.unwrap_or(0) + 26 * S)
        .build_cartesian_2d(Scale::new(x, x_ticks), Scale::new(y, y_ticks))?;
    axis::plain(&mut chart.configure_mesh())
        .x_label_formatter(&|x| match panel.categories.get(x.round() as usize) {
            Some(name) => name.clone(),
            None if panel.categories.is_empty() => shown(*x, x_decimals),
            None => String::new(),
        })
        .y_label_formatter(&|y| shown(*y, y_decimals))
        .x_desc(panel.x.as_str())
        .y_desc(panel.y.as_str())
        .draw()?;
    let mut series: Vec<&Series> = panel.series.iter().collect();
    series.sort_by_key(|series| layer(series.source));
    for one in series.iter().filter(|one| panel.categories.is_empty() && !one.range.is_empty()) {
        let top = one.range.iter().map(|&(x, _, high)| (x, high));
        let bottom = one.range.iter().rev().map(|&(x, low, _)| (x, low));
        let band: Vec<(f64, f64)> = top.chain(bottom).collect();
        chart.draw_series([Polygon::new(band, BAND.filled())])?;
    }
    for one in series {
        let published = matches!(one.source, Source::Published | Source::Fitted);
        if !published && panel.categories.is_empty() {
            chart.draw_series([PathElement::new(one.points.clone(), stroke(one.source))])?;
            if matches!(one.source, Source::Method(_)) {
                let dot = |&point| Circle::new(point, 4 * S, stroke(one.source).filled());
                chart.draw_series(one.points.iter().map(dot))?;
            }
            continue;
        }
        let shift = if panel.categories.is_empty() { 0 } else { beside(one.source) };
        for &(x, low, high) in &one.range {
            let [a, b] = [low, high].map(|y| chart.backend_coord(&(x, y)));
            let corners = [(shift - 5 * S, 0), (shift + 5 * S, b.1 - a.1)];
            let bar = EmptyElement::at((x, low)) + Rectangle::new(corners, BAND.filled());
            chart.plotting_area().draw(&bar)?;
        }
        for &point in &one.points {
            let [rim, body] = mark((shift, 0), one.source);
            chart.draw_series([EmptyElement::at(point) + rim + body])?;
        }
    }
    Ok(())
}

/// Shift of the marks of one source in a category, drawing units.
fn beside(source: Source) -> i32 {
    match source {
        Source::Theory => -27 * S,
        Source::Simulation => -9 * S,
        Source::Experiment => 9 * S,
        Source::Published | Source::Fitted => 27 * S,
        Source::FiniteElements | Source::Method(_) => 0,
    }
}

/// Ranges of the axes over everything that is shown.
fn ranges(panel: &Panel) -> ((f64, f64), (f64, f64)) {
    let points = || panel.series.iter().flat_map(|series| &series.points);
    let bands = || panel.series.iter().flat_map(|series| &series.range);
    let x = if panel.categories.is_empty() {
        let all = points().map(|p| p.0).chain(bands().map(|b| b.0));
        let (low, high) = extent(all).unwrap_or((0.0, 1.0));
        let room = 0.03 * (high - low);
        let keeps_zero = low == 0.0 && !panel.logarithmic;
        (if keeps_zero { 0.0 } else { low - room }, high + room)
    } else {
        (-0.5, panel.categories.len() as f64 - 0.5)
    };
    let values = points().map(|p| p.1).chain(bands().flat_map(|b| [b.1, b.2]));
    let least = panel.least_y.into_iter().flat_map(|(low, high)| [low, high]);
    let y = extent(values.chain(least)).unwrap_or((0.0, 1.0));
    let wide = padded(y, 0.07);
    // What begins at zero keeps its zero line.
    (x, if y.0 == 0.0 && !panel.logarithmic { (0.0, wide.1) } else { wide })
}

type Drawable<'a> = DynElement<'static, SVGBackend<'a>, (i32, i32)>;

/// A mark with a white rim at `at`.
fn mark<'a>(at: (i32, i32), source: Source) -> [Drawable<'a>; 2] {
    const R: i32 = 5 * S;
    match source {
        Source::Theory => {
            let ends = |wide| [(at.0 - wide, at.1), (at.0 + wide, at.1)];
            [
                PathElement::new(ends(8 * S + 2), WHITE.stroke_width(9)).into_dyn(),
                PathElement::new(ends(8 * S), palette::TRUTH.stroke_width(5)).into_dyn(),
            ]
        }
        Source::Simulation => [
            Circle::new(at, R, WHITE.filled()).into_dyn(),
            // Undashed: a mark is too small for dashes.
            Circle::new(at, R, palette::SPEED.stroke_width(4)).into_dyn(),
        ],
        Source::Experiment | Source::FiniteElements | Source::Method(_) => [
            Circle::new(at, R - 1, WHITE.filled()).into_dyn(),
            Circle::new(at, R - 3, stroke(source).filled()).into_dyn(),
        ],
        Source::Published | Source::Fitted => diamond(at, source),
    }
}

/// A diamond, hollow where it is fitted.
fn diamond<'a>((x, y): (i32, i32), source: Source) -> [Drawable<'a>; 2] {
    let corners = |r: i32| vec![(x, y - r), (x + r, y), (x, y + r), (x - r, y)];
    let closed = |r: i32| vec![(x, y - r), (x + r, y), (x, y + r), (x - r, y), (x, y - r)];
    match source {
        Source::Fitted => [
            Polygon::new(corners(6 * S), WHITE.filled()).into_dyn(),
            PathElement::new(closed(6 * S), PUBLISHED.stroke_width(4)).into_dyn(),
        ],
        _ => [
            Polygon::new(corners(7 * S), WHITE.filled()).into_dyn(),
            Polygon::new(corners(6 * S), PUBLISHED.filled()).into_dyn(),
        ],
    }
}
