//! The plots of a run, over time or over position.

use super::axis;
use super::palette::{self, Colour};
use super::panel::Look::{Limit, Measured, Truth, Wanted};
use super::panel::{Line, Look, Marks, Panel, Rule, Shape, sheet};
use super::verdict::GAP_TOLERANCE;
use crate::record::{Column, Columns, CrossingLine, Recording, Report, Row, TrueState};
use crate::scenario::Scenario;

/// What the horizontal axis shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Across {
    /// The recording's own time.
    Time,
    /// Time since this time, the first touch of a corner, s.
    Since(f64),
    /// True axial position; by odometry where there is no truth.
    Position,
}

impl Across {
    /// Name of the axis, with its unit.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Time => "time, s",
            Self::Since(_) => "time since the corner touched, s",
            Self::Position => "axial position, mm",
        }
    }

    /// The place of `row` on the axis.
    pub(super) fn of(self, row: &Row) -> f64 {
        match self {
            Self::Time => row.controller.t_s,
            Self::Since(start_s) => row.controller.t_s - start_s,
            Self::Position => row.position_mm(),
        }
    }

    /// The place of the time `t_s` on the axis.
    fn at(self, rows: &[Row], t_s: f64) -> f64 {
        let place =
            rows.partition_point(|row| row.controller.t_s < t_s).min(rows.len().saturating_sub(1));
        match self {
            Self::Time => t_s,
            Self::Since(start_s) => t_s - start_s,
            Self::Position => rows.get(place).map_or(f64::NAN, |row| self.of(row)),
        }
    }

    /// Range of the rows. Over time it begins at zero, the command, if they go beyond.
    pub(super) fn range(self, rows: &[Row]) -> (f64, f64) {
        let (low, high) = axis::extent(rows.iter().map(|row| self.of(row))).unwrap_or((0.0, 1.0));
        match self {
            Self::Time | Self::Since(_) => {
                let from = if high > 0.0 { low.max(0.0) } else { low };
                (from, high.max(from + 1e-3))
            }
            Self::Position => axis::padded((low, high), 0.01),
        }
    }
}

/// A field of the rows, as a line with its name and look.
type Field = (&'static str, Look, fn(&Row) -> f64);

/// The run as the plots need it.
pub(super) struct View<'a> {
    pub(super) recording: &'a Recording,
    pub(super) rows: &'a [Row],
    pub(super) across: Across,
    pub(super) x: (f64, f64),
    pub(super) shades: Vec<(f64, f64, String)>,
    /// First touches, faces, faults and limits.
    pub(super) rules: Vec<Rule>,
    /// Level of the largest preload, N, if the parameters have it.
    pub(super) limit: Option<(&'static str, Look, f64)>,
}

impl<'a> View<'a> {
    pub(super) fn new(recording: &'a Recording, across: Across) -> Self {
        let rows = &recording.rows[..];
        let parameters = Scenario::parse("parameters", &recording.parameters, &[]);
        let span = |c: &CrossingLine| {
            let (from, to) = (across.at(rows, c.touch_s), across.at(rows, c.lift_s));
            (from.min(to), from.max(to), format!("step {}", c.index))
        };
        Self {
            recording,
            rows,
            across,
            x: across.range(rows),
            shades: recording.summary.crossings.iter().map(span).collect(),
            rules: recording
                .summary
                .crossings
                .iter()
                .flat_map(|c| rules(rows, across, c))
                .chain(reports(recording, across))
                .collect(),
            limit: parameters.ok().map(|p| ("preload limit", Limit, p.rig.preload.limit_n)),
        }
    }

    /// An empty plot.
    pub(super) fn panel(&self, title: &str, y_name: &str) -> Panel {
        Panel {
            title: title.to_owned(),
            y_name: y_name.to_owned(),
            x_name: self.across.name().to_owned(),
            x: self.x,
            shades: self.shades.clone(),
            rules: self.rules.clone(),
            ..Panel::default()
        }
    }

    /// A line of one field.
    pub(super) fn line(
        &self,
        name: impl Into<String>,
        look: Look,
        of: impl Fn(&Row) -> f64,
    ) -> Line {
        let points = self.rows.iter().map(|row| (self.across.of(row), of(row))).collect();
        Line { name: name.into(), look, points }
    }

    pub(super) fn lines<const N: usize>(&self, fields: [Field; N]) -> Vec<Line> {
        fields.map(|(name, look, of)| self.line(name, look, of)).into()
    }

    /// The controller's curves of a plot, references first, and what is true.
    fn curves(&self, plot: &str, colour: Colour, truth: fn(&TrueState) -> f64) -> Vec<Line> {
        let of_plot = |column: &Column| {
            let (_, name) = column.curve.filter(|curve| curve.0 == plot)?;
            let look = if name == "reference" { Wanted } else { Measured(colour) };
            Some(self.line(name, look, |row| (column.of)(&row.controller)))
        };
        let mut lines: Vec<Line> = Columns::QUANTITIES.iter().filter_map(of_plot).collect();
        lines.sort_by_key(|line| line.look != Wanted);
        lines.push(self.line("true", Truth, |row| row.of_truth(truth)));
        lines
    }

    /// Marks at lift-off of the crossings that have the value.
    fn marks(
        &self,
        name: &'static str,
        (shape, colour): (Shape, Colour),
        of: impl Fn(&CrossingLine) -> Option<f64>,
    ) -> Marks {
        let crossings = &self.recording.summary.crossings;
        let at = |c: &CrossingLine| Some((self.across.at(self.rows, c.lift_s), of(c)?));
        Marks {
            name: name.into(),
            shape,
            colour,
            points: crossings.iter().filter_map(at).collect(),
        }
    }

    /// Every plot of the run but the bands, in the order of the page.
    pub(super) fn all(&self) -> Vec<Panel> {
        vec![
            self.speed(),
            self.preload(),
            self.gap(),
            self.radius(),
            self.slip_margin(),
            self.compression(),
            self.duty(),
        ]
    }

    pub(super) fn speed(&self) -> Panel {
        let lines = self.curves("speed", palette::SPEED, |t| t.speed_true_mm_s);
        Panel { least_span: 2.0, lines, ..self.panel("Speed", "speed, mm/s") }
    }

    pub(super) fn preload(&self) -> Panel {
        let lines = self.curves("preload", palette::PRELOAD, |t| t.preload_true_n);
        let levels = self.limit.into_iter().collect();
        Panel { least_span: 4.0, lines, levels, ..self.panel("Preload", "preload, N") }
    }

    /// The clearance as a part of the reference gap; in mm where there is none.
    pub(super) fn gap(&self) -> Panel {
        let summary = &self.recording.summary;
        let reference_mm = Some(summary.gap_ref_mm).filter(|gap| *gap > 0.0);
        let (one, y_name) = match reference_mm {
            Some(gap) => (gap / 100.0, "clearance, % of reference"),
            None => (1.0, "clearance, mm"),
        };
        let mut panel = self.panel("Clearance at the step root, and the gap", y_name);
        panel.also = reference_mm.map(|_| (one, "mm"));
        panel.lines =
            vec![self.line("clearance", Truth, |row| row.of_truth(|t| t.root_clearance_mm) / one)];
        panel.marks = vec![
            self.marks("gap, measured", (Shape::Ring, palette::GAP), |c| {
                Some(c.gap_measured_mm? / one)
            }),
            self.marks("gap, predicted", (Shape::Square, palette::FLOOR), |c| {
                Some(c.gap_predicted_mm? / one)
            }),
            self.marks("gap, true", (Shape::Dot, palette::TRUTH), |c| Some(c.gap_mm / one)),
        ];
        let most = 100.0 * (1.0 + GAP_TOLERANCE);
        if reference_mm.is_some() {
            panel.levels = vec![("reference gap", Wanted, 100.0), ("tolerance", Limit, most)];
        }
        // The clearance before touch and after the climb is unrelated to the gap.
        let gaps = panel.marks.iter().flat_map(|marks| &marks.points).map(|point| point.1);
        let shown = gaps.chain(reference_mm.map(|_| most)).filter(|&gap| gap > 0.0);
        let range = axis::extent(shown);
        panel.y = range.map(|(low, high)| {
            let room = (0.15 * (high - low)).max(0.01 * high);
            (low - room, high + 1.5 * room)
        });
        panel
    }

    pub(super) fn radius(&self) -> Panel {
        let lines = self.curves("radius", palette::RADIUS, |t| t.radius_true_mm);
        Panel { lines, ..self.panel("Radial position of the wheel centre", "radius, mm") }
    }

    pub(super) fn slip_margin(&self) -> Panel {
        let mut panel = self.panel("Slip margin", "friction left, µ - used");
        panel.least_span = 0.2;
        panel.lines = self.curves("slip margin", palette::SLIP, |t| t.slip_margin_true);
        panel.levels = vec![("slip", Limit, 0.0)];
        panel.reach = vec![-0.1];
        panel
    }

    pub(super) fn compression(&self) -> Panel {
        let lines = self.curves("compression", palette::COMPRESSION, |t| t.compression_true_mm);
        Panel { least_span: 0.1, lines, ..self.panel("Tread compression", "compression, mm") }
    }

    /// What the motors are told.
    fn duty(&self) -> Panel {
        let lines = self.lines([
            ("drive", Measured(palette::SPEED), |row| row.controller.drive_duty),
            ("pre-tightener", Measured(palette::PRELOAD), |row| row.controller.pretightener_duty),
        ]);
        Panel { least_span: 0.1, lines, ..self.panel("Duty of the motors", "duty, of full") }
    }
}

/// Where the corner first touched and where the axle passed the face.
fn rules(rows: &[Row], across: Across, line: &CrossingLine) -> Vec<Rule> {
    let from = rows.partition_point(|row| row.controller.t_s < line.touch_s.min(line.lift_s));
    let ahead = |row: &Row| row.position_mm() < line.step_mm;
    let side = rows.get(from).map(ahead);
    let passed = rows[from..].iter().find(|row| Some(ahead(row)) != side);
    let face_x = match across {
        Across::Position => Some(line.step_mm),
        _ => passed.map(|row| across.of(row)),
    };
    let touch = (across.at(rows, line.touch_s), palette::TOUCH);
    let face = face_x.map(|x| (x, palette::FACE));
    let rule = |(x, colour)| Rule { x, name: String::new(), colour };
    [touch].into_iter().chain(face).map(rule).collect()
}

/// Faults and limits by their codes, those at one place together.
fn reports(recording: &Recording, across: Across) -> Vec<Rule> {
    let Recording { summary, rows, .. } = recording;
    let faults = summary.faults.iter().map(|report| (report, palette::LIMIT));
    let limits = summary.limits.iter().map(|report| (report, palette::WARNING));
    let mut rules: Vec<Rule> = Vec::new();
    for (Report { t_s, code, .. }, colour) in faults.chain(limits) {
        // What ended the run is reported behind its last row.
        let x = across.at(rows, *t_s).min(across.range(rows).1);
        match rules.iter_mut().find(|rule| (rule.x - x).abs() < 1e-9) {
            Some(rule) => rule.name += &format!(", {code}"),
            None => rules.push(Rule { x, name: code.to_string(), colour }),
        }
    }
    rules
}

/// Speed, preload, gap and radius of a run over time from the command on, as an SVG.
pub(crate) fn overview_svg(recording: &Recording) -> String {
    let recording = &recording.since_command();
    let view = View::new(recording, Across::Time);
    sheet(vec![view.speed(), view.preload(), view.gap(), view.radius()], 1, false)
}

/// A plot, with what the script needs to place its cursor: axis, and time at its zero.
pub(super) fn figure(panel: &Panel, across: Across, size: (u32, u32), name: &str) -> String {
    let (axis, zero_s) = match across {
        Across::Position => ("position", 0.0),
        Across::Time => ("time", 0.0),
        Across::Since(start_s) => ("time", start_s),
    };
    panel.figure(&format!("data-across=\"{axis}\" data-since=\"{zero_s}\""), size, name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::example;

    #[test]
    fn crossings_are_shaded_on_both_axes() {
        let recording = example::deploy();
        let time = View::new(&recording, Across::Time);
        let position = View::new(&recording, Across::Position);
        let crossings = &recording.summary.crossings;
        for ((line, time), position) in crossings.iter().zip(&time.shades).zip(&position.shades) {
            assert_eq!(*time, (line.touch_s, line.lift_s, format!("step {}", line.index)));
            assert!(position.0 < position.1 && position.1 < line.step_mm);
        }
    }
}
