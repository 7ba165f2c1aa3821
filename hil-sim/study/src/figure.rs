//! A figure as data: what is drawn, what is printed as JSON, and what the study's claims
//! are judged by.

use std::borrow::Cow;

use serde::Serialize;

/// Where the values of a series come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Source {
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
    /// One of several methods, by the number of its colour; the series has its name.
    Method(usize),
}

impl Source {
    /// Name in the legend.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Theory => "theory",
            Self::Simulation => "simulation",
            Self::Experiment => "virtual rig, four means of ten",
            Self::FiniteElements => "continuum",
            Self::Published => "published",
            Self::Fitted => "published (fitted)",
            Self::Method(_) => "",
        }
    }
}

/// The three sources that every figure compares.
pub const SOURCES: [Source; 3] = [Source::Theory, Source::Simulation, Source::Experiment];

/// Values of one source.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Series {
    pub source: Source,
    /// Which of several; empty if there is one.
    pub name: String,
    pub points: Vec<(f64, f64)>,
    /// Range over all runs: x, least and largest; empty if there is none.
    pub range: Vec<(f64, f64, f64)>,
}

impl Series {
    /// A series without name and range.
    pub fn new(source: Source, points: Vec<(f64, f64)>) -> Self {
        Self { source, name: String::new(), points, range: Vec::new() }
    }

    pub fn method(number: usize, name: &str, points: Vec<(f64, f64)>) -> Self {
        Self { name: name.to_owned(), ..Self::new(Source::Method(number), points) }
    }

    /// The means of the experiment, numbered.
    pub fn means(means: impl Iterator<Item = Vec<(f64, f64)>>) -> impl Iterator<Item = Self> {
        means.enumerate().map(|(index, points)| Self {
            name: format!("mean {}", index + 1),
            ..Self::new(Source::Experiment, points)
        })
    }

    /// Its entry in the legend.
    pub fn legend(&self) -> (Source, &str) {
        let method = matches!(self.source, Source::Method(_));
        (self.source, if method { &self.name } else { self.source.name() })
    }
}

/// One plot as data.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Chart {
    pub title: String,
    /// Name and unit of the horizontal axis.
    pub x: String,
    /// Name and unit of the vertical axis.
    pub y: String,
    /// Names of x = 0, 1, ... where x is no quantity; the series are marks then.
    pub categories: Vec<String>,
    /// Whether both axes are logarithmic.
    #[serde(skip)]
    pub logarithmic: bool,
    /// Smallest vertical axis.
    pub least_y: Option<(f64, f64)>,
    pub series: Vec<Series>,
}

impl Chart {
    /// A plot with these names and units of its axes.
    pub fn new(title: impl Into<String>, x: &str, y: &str, series: Vec<Series>) -> Self {
        let (title, x, y) = (title.into(), x.into(), y.into());
        let (categories, logarithmic, least_y) = (Vec::new(), false, None);
        Self { title, x, y, categories, logarithmic, least_y, series }
    }

    /// The same with logarithmic axes.
    pub fn logarithmic(self) -> Self {
        Self { logarithmic: true, ..self }
    }

    /// A plot of marks at x = 0, 1, ... with these names.
    pub fn of_categories(
        title: &str,
        (x, categories): (&str, Vec<String>),
        y: &str,
        series: Vec<Series>,
    ) -> Self {
        Self { categories, ..Self::new(title, x, y, series) }
    }
}

/// A published number beside ours.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Mark {
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
pub struct Ours {
    pub source: Source,
    /// Ours.
    pub value: f64,
    /// Deviation from the published number, relative.
    pub deviation: f64,
}

impl Mark {
    /// A published number, and ours by source.
    pub fn new(
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

    pub fn add(&mut self, source: Source, value: f64) {
        self.ours.push(Ours { source, value, deviation: value / self.published - 1.0 });
    }
}

/// A figure of the study.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Figure {
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
    pub fn new(
        id: &'static str,
        title: &'static str,
        caption: String,
        columns: usize,
        panels: Vec<Chart>,
    ) -> Self {
        let (file, published) = (format!("{id}.svg"), Vec::new());
        Self { id, file, title, caption, columns, panels, published }
    }
}

/// A statement of the study, judged by our data.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Claim {
    /// Stable name.
    pub id: &'static str,
    /// The figure below which it is printed.
    pub figure: &'static str,
    /// Where the study makes it.
    pub section: &'static str,
    /// What it says.
    pub claim: Cow<'static, str>,
    /// Whether it holds in ours.
    pub holds: bool,
    /// Whether a parameter of ours is fitted to just this, so that holding proves nothing.
    pub fitted: bool,
    /// What was found, and if it does not hold, why.
    pub why: String,
}

impl Claim {
    /// The verdict, as the page has it.
    pub const fn verdict(&self) -> &'static str {
        match (self.holds, self.fitted) {
            (true, false) => "holds",
            (true, true) => "holds (fitted)",
            (false, _) => "**does not hold**",
        }
    }

    /// The same, with a parameter of ours fitted to it.
    pub fn fitted(self) -> Self {
        Self { fitted: true, ..self }
    }
}
