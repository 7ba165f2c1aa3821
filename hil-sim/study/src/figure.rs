//! A figure as data: what is drawn, what is printed as JSON, and what the study's claims
//! are judged by.

use hil_sim::report::axis::{Scale, extent, padded};
use hil_sim::report::palette;
use hil_sim::report::panel::{Line, Look, Marks, Panel, Shape, sheet};
use serde::Serialize;

/// Most charts side by side.
const COLUMNS: usize = 2;

/// Where the values of a series come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Source {
    /// The controller's model.
    Theory,
    /// The reference models.
    Simulation,
    /// Means of ten runs of the virtual rig.
    #[serde(rename = "virtual rig")]
    Experiment,
    /// Finite elements: in tables alone.
    #[serde(rename = "continuum")]
    FiniteElements,
    /// Printed in the study.
    Published,
    /// Printed in the study, and what the tread's parameters are fitted to.
    Fitted,
}

impl Source {
    /// Name in the legend.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Theory => "theory",
            Self::Simulation => "simulation",
            Self::Experiment => "virtual rig, four means of ten",
            Self::FiniteElements => "continuum",
            Self::Published => "published",
            Self::Fitted => "published (fitted)",
        }
    }

    /// Line and mark, and where the marks are in a category, of its width.
    const fn style(self) -> (Look, Shape, f64) {
        match self {
            Self::Theory => (Look::Truth, Shape::Dot, -0.3),
            Self::Simulation => (Look::Measured(palette::SIMULATED), Shape::Dot, -0.1),
            Self::Experiment => (Look::Other(palette::PRELOAD, 1.5), Shape::Dot, 0.1),
            Self::FiniteElements | Self::Published => {
                (Look::Measured(palette::GAP), Shape::Square, 0.3)
            }
            Self::Fitted => (Look::Measured(palette::GAP), Shape::Frame, 0.3),
        }
    }
}

/// The three sources that every figure compares.
pub(crate) const SOURCES: [Source; 3] = [Source::Theory, Source::Simulation, Source::Experiment];

/// Values of one source.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Series {
    pub source: Source,
    /// Which of several; empty if there is one.
    pub name: String,
    pub points: Vec<(f64, f64)>,
    /// Range over all runs: x, least and largest; empty if there is none.
    pub range: Vec<(f64, f64, f64)>,
}

impl Series {
    /// A series without name and range.
    pub(crate) fn new(source: Source, points: Vec<(f64, f64)>) -> Self {
        Self { source, name: String::new(), points, range: Vec::new() }
    }

    /// The means of the experiment, numbered.
    pub(crate) fn means(
        means: impl Iterator<Item = Vec<(f64, f64)>>,
    ) -> impl Iterator<Item = Self> {
        means.enumerate().map(|(index, points)| Self {
            name: format!("mean {}", index + 1),
            ..Self::new(Source::Experiment, points)
        })
    }
}

/// One plot as data.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Chart {
    pub title: String,
    /// Name and unit of the horizontal axis.
    pub x: String,
    /// Name and unit of the vertical axis.
    pub y: String,
    /// Names of x = 0, 1, ... where x is no quantity; the series are marks then.
    pub categories: Vec<String>,
    /// Smallest vertical axis.
    pub least_y: Option<(f64, f64)>,
    pub series: Vec<Series>,
}

impl Chart {
    /// A plot with these names and units of its axes.
    pub(crate) fn new(title: impl Into<String>, x: &str, y: &str, series: Vec<Series>) -> Self {
        let (title, x, y) = (title.into(), x.into(), y.into());
        Self { title, x, y, categories: Vec::new(), least_y: None, series }
    }

    /// A plot of marks at x = 0, 1, ... with these names.
    pub(crate) fn of_categories(
        title: &str,
        (x, categories): (&str, Vec<String>),
        y: &str,
        series: Vec<Series>,
    ) -> Self {
        Self { categories, ..Self::new(title, x, y, series) }
    }

    /// The plot: lines over a quantity, marks side by side in a category.
    fn panel(&self) -> Panel {
        let is_named = !self.categories.is_empty();
        let (mut lines, mut marks) = (Vec::new(), Vec::new());
        for Series { source, points, range, .. } in &self.series {
            let (look, shape, beside) = source.style();
            let (many, beside, half) =
                if is_named { (1, beside, 0.06) } else { (range.len().max(1), 0.0, 0.0) };
            lines.extend(range.chunks(many).map(|some| {
                let ends = |x, y| [(x + beside - half, y), (x + beside + half, y)];
                let above = some.iter().flat_map(|&(x, _, high)| ends(x, high));
                let below = some.iter().flat_map(|&(x, low, _)| ends(x, low)).rev();
                let (name, look) = ("range of all forty runs".into(), Look::Area(palette::RANGE));
                Line { name, look, points: above.chain(below).collect() }
            }));
            let points = points.iter().map(|&(x, y)| (x + beside, y)).collect();
            let line = Line { name: source.name().to_owned(), look, points };
            if is_named || matches!(source, Source::Published | Source::Fitted) {
                marks.push(Marks { shape, ..line.dots() });
            } else {
                lines.push(line);
            }
        }
        let all = lines.iter().map(|line| &line.points).chain(marks.iter().map(|one| &one.points));
        let (low, high) = extent(all.flatten().map(|point| point.0)).unwrap_or((0.0, 1.0));
        let (from, to) = padded((low, high), 0.03);
        let named = self.categories.iter().enumerate().map(|(n, name)| (n as f64, name.clone()));
        Panel {
            title: self.title.clone(),
            x_name: self.x.clone(),
            y_name: self.y.clone(),
            x_axis: if is_named { Scale::Named(named.collect()) } else { Scale::Linear },
            x: if is_named {
                (-0.5, self.categories.len() as f64 - 0.5)
            } else {
                (if low == 0.0 { 0.0 } else { from }, to)
            },
            reach: self.least_y.into_iter().flat_map(|(low, high)| [low, high]).collect(),
            lines,
            marks,
            ..Panel::default()
        }
    }
}

/// A published number beside ours.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Mark {
    pub what: String,
    /// Its unit; empty for ratios.
    pub unit: &'static str,
    /// As printed in the study.
    pub published: f64,
    /// Whether a parameter of ours is fitted to it.
    pub fitted: bool,
    /// Ours by source.
    pub ours: Vec<Ours>,
}

/// One of ours beside a published number.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct Ours {
    pub source: Source,
    /// Ours.
    pub value: f64,
    /// Deviation from the published number, relative.
    pub deviation: f64,
}

impl Mark {
    /// A published number, and ours by source.
    pub(crate) fn new(
        what: String,
        unit: &'static str,
        (published, fitted): (f64, bool),
        ours: &[(Source, f64)],
    ) -> Self {
        let mut mark = Self { what, unit, published, fitted, ours: Vec::new() };
        for &(source, value) in ours {
            mark.add(source, value);
        }
        mark
    }

    pub(crate) fn add(&mut self, source: Source, value: f64) {
        self.ours.push(Ours { source, value, deviation: value / self.published - 1.0 });
    }
}

/// A figure of the study.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Figure {
    /// Number in the study, as `fig20`.
    pub id: &'static str,
    pub file: String,
    pub title: &'static str,
    /// What is shown and how it was got.
    pub caption: String,
    /// Plots in a row.
    pub columns: usize,
    /// The plots, row by row.
    pub panels: Vec<Chart>,
    /// Published numbers beside ours.
    pub published: Vec<Mark>,
}

impl Figure {
    /// A figure without published numbers, in the file of its name.
    pub(crate) fn new(
        id: &'static str,
        title: &'static str,
        caption: String,
        columns: usize,
        panels: Vec<Chart>,
    ) -> Self {
        let (file, published) = (format!("{id}.svg"), Vec::new());
        Self { id, file, title, caption, columns, panels, published }
    }

    /// The figure as SVG: its plots in rows below one legend.
    pub(crate) fn svg(&self) -> String {
        let panels = self.panels.iter().map(Chart::panel).collect();
        sheet(panels, self.columns.clamp(1, COLUMNS), true)
    }
}

/// A statement of the study, judged by our data.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Claim {
    /// Stable name.
    pub id: String,
    /// The figure below which it is printed.
    pub figure: String,
    /// Where the study makes it.
    pub section: String,
    /// What it says.
    pub claim: String,
    /// Whether it holds in ours.
    pub holds: bool,
    /// Whether a parameter of ours is fitted to just this, so that holding proves nothing.
    pub fitted: bool,
    /// What was found, and if it does not hold, why.
    pub why: String,
}

impl Claim {
    /// The verdict, as the page has it.
    pub(crate) const fn verdict(&self) -> &'static str {
        match (self.holds, self.fitted) {
            (true, false) => "holds",
            (true, true) => "holds (fitted)",
            (false, _) => "**does not hold**",
        }
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
        let drawn = |chart| Figure::new("x", "", String::new(), 1, vec![chart]).svg();
        let lines = drawn(Chart::new("t", "x", "y", all()));
        assert!(lines.contains("stroke-dasharray=\"8 4\"") && !lines.contains("h0M"));
        let names = ("x", vec!["first".to_owned(), "second".to_owned()]);
        let marks = drawn(Chart::of_categories("t", names, "y", all()));
        assert!(marks.contains(">second<") && marks.contains("d=\"M90.9 78h0M318.1 112.82h0\""));
        // The legend has no line where there is none.
        assert!(!marks.contains("stroke-dasharray"), "{marks}");
        assert_eq!(marks.matches(palette::RANGE).count(), 2 + 1, "a range each, and their sample");
    }
}
