//! Figures as SVG: charts in rows below one legend, each source with the same look in all of them.

use hil_sim::report::axis::{Scale, extent, padded};
use hil_sim::report::palette;
use hil_sim::report::panel::{Line, Look, Marks, Panel, Shape, sheet};

use crate::figure::{Chart, Figure, Series, Source};

/// Most charts side by side.
const COLUMNS: usize = 2;

pub fn svg(figure: &Figure) -> String {
    sheet(figure.panels.iter().map(panel).collect(), figure.columns.clamp(1, COLUMNS), true)
}

/// Line and mark of a source. Marks replace the line where x is no quantity.
fn look(source: Source) -> (Look, Shape) {
    match source {
        Source::Theory => (Look::Truth, Shape::Dot),
        Source::Simulation => (Look::Other(palette::SIMULATED, 2.0), Shape::Dot),
        Source::Experiment => (Look::Other(palette::PRELOAD, 1.5), Shape::Dot),
        Source::FiniteElements | Source::Published => (Look::Measured(palette::GAP), Shape::Square),
        Source::Fitted => (Look::Measured(palette::GAP), Shape::Frame),
        Source::Method(number) => {
            (Look::Measured(palette::SERIES[number % palette::SERIES.len()]), Shape::Dot)
        }
    }
}

/// Where the marks of one source are in a category, of its width.
fn beside(source: Source) -> f64 {
    match source {
        Source::Theory => -0.3,
        Source::Simulation => -0.1,
        Source::Experiment => 0.1,
        Source::Published | Source::Fitted => 0.3,
        Source::FiniteElements | Source::Method(_) => 0.0,
    }
}

fn panel(chart: &Chart) -> Panel {
    let is_named = !chart.categories.is_empty();
    let (mut lines, mut marks) = (Vec::new(), Vec::new());
    let mut all: Vec<&Series> = chart.series.iter().collect();
    // Its dashes are above the lines of its width.
    all.sort_by_key(|one| one.source == Source::Simulation);
    for one in all {
        let ((look, shape), name) = (look(one.source), one.legend().1);
        let shift = if is_named { beside(one.source) } else { 0.0 };
        let mut points: Vec<_> = one.points.iter().map(|&(x, y)| (x + shift, y)).collect();
        if chart.logarithmic {
            points.retain(|&(x, y)| x > 0.0 && y > 0.0 && (x * y).is_finite());
            points.iter_mut().for_each(|p| *p = (p.0.log10(), p.1.log10()));
        }
        let mut area = |points| {
            let name = "range of all forty runs".to_owned();
            lines.push(Line { name, look: Look::Area(palette::RANGE), points });
        };
        if is_named {
            for &(x, low, high) in &one.range {
                let (a, b) = (x + shift - 0.06, x + shift + 0.06);
                area(vec![(a, low), (a, high), (b, high), (b, low)]);
            }
        } else {
            let top = one.range.iter().map(|&(x, _, high)| (x, high));
            area(top.chain(one.range.iter().rev().map(|&(x, low, _)| (x, low))).collect());
        }
        let is_marked = is_named || matches!(one.source, Source::Published | Source::Fitted);
        let mut line = Line { name: name.to_owned(), look, points };
        if is_named && one.source == Source::Theory {
            let dash = |&(x, y): &(f64, f64)| [(x - 0.1, y), (x + 0.1, y), (x, f64::NAN)];
            line.points = line.points.iter().flat_map(dash).collect();
        } else if is_marked || matches!(one.source, Source::Method(_)) {
            marks.push(Marks { shape, ..line.dots() });
            line.points.retain(|_| !is_marked);
        }
        lines.push(line);
    }
    lines.retain(|line| !line.points.is_empty());
    let xs = lines.iter().flat_map(|line| &line.points);
    let xs = xs.chain(marks.iter().flat_map(|one| &one.points)).map(|point| point.0);
    let (low, high) = extent(xs).unwrap_or((0.0, 1.0));
    let wide = padded((low, high), 0.03);
    let from_zero = low == 0.0 && !chart.logarithmic;
    let scale = if chart.logarithmic { Scale::Log } else { Scale::Linear };
    let named = chart.categories.iter().enumerate().map(|(n, name)| (n as f64, name.clone()));
    Panel {
        title: chart.title.clone(),
        x_name: chart.x.clone(),
        y_name: chart.y.clone(),
        x_axis: if is_named { Scale::Named(named.collect()) } else { scale.clone() },
        y_axis: scale,
        x: if is_named {
            (-0.5, chart.categories.len() as f64 - 0.5)
        } else {
            (if from_zero { 0.0 } else { wide.0 }, wide.1)
        },
        reach: chart.least_y.into_iter().flat_map(|(low, high)| [low, high]).collect(),
        lines,
        marks,
        ..Panel::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_simulation_is_dashed_over_a_quantity_and_marked_in_its_category() {
        let series = |source| Series {
            range: vec![(0.0, 1.0, 3.0)],
            ..Series::new(source, vec![(0.0, 2.0), (1.0, 2.5)])
        };
        let all = || [Source::Theory, Source::Simulation].map(series).to_vec();
        let drawn = |chart| svg(&Figure::new("x", "", String::new(), 1, vec![chart]));
        let lines = drawn(Chart::new("t", "x", "y", all()));
        assert!(lines.contains("stroke-dasharray=\"8 4\"") && !lines.contains("h0M"));
        let names = ("x", vec!["first".to_owned(), "second".to_owned()]);
        let marks = drawn(Chart::of_categories("t", names, "y", all()));
        assert!(marks.contains(">second<") && marks.contains("d=\"M90.9 78h0M318.1 112.82h0\""));
        // The legend has no line where there is none.
        assert!(!marks.contains("stroke-dasharray"), "{marks}");
        assert_eq!(marks.matches(palette::RANGE).count(), 2 + 1, "a range each, and their sample");
        let points = vec![(0.1, 1e-3), (1.0, 0.0), (10.0, 0.1)];
        let chart = Chart::new("t", "x", "y", vec![Series::method(0, "a", points)]).logarithmic();
        assert!(drawn(chart).contains("d=\"M12.5 8.36 427.5 147.64\""));
    }
}
