//! Figures 20 to 23: gap, embedding depth and contact area against preload and speed at
//! the rig's loads.

mod claims;

use rayon::prelude::*;

use super::case::{Case, Loads};
use super::experiment::{Experiment, Reading};
use super::means::Means;
use super::published::{AREA_SPREAD_MM2, DEPTH_SPREAD_MM, GAP_SPREAD_MM};
use super::simulation;
use super::theory::{self, Drive, Lift};
use crate::figure::{Figure, Mark, Panel, Series, Source};
use anyhow::Result;

pub use claims::{preload_claims, speed_claims};

/// Preloads of the sweep, N: from the least to the most that the study names for its
/// rig.
pub const PRELOADS_N: [f64; 5] = [33.3, 36.0, 40.0, 45.0, 50.0];
/// Speed of the preload sweep, mm/s.
pub const SPEED_MM_S: f64 = 5.0;
/// Speeds of the sweep, mm/s: between the slowest and the fastest of the study.
pub const SPEEDS_MM_S: [f64; 5] = [3.0, 4.0, 5.0, 6.5, 8.0];
/// Preload of the speed sweep, N.
pub const PRELOAD_N: f64 = 40.0;

/// Points of a curve.
const GRID: usize = 11;

/// What is swept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Variable {
    /// Preload, at [`SPEED_MM_S`].
    Preload,
    /// Speed, at [`PRELOAD_N`].
    Speed,
}

impl Variable {
    pub fn case(self, value: f64) -> Case {
        match self {
            Self::Preload => Case::new(Loads::Prototype, SPEED_MM_S, value),
            Self::Speed => Case::new(Loads::Prototype, value, PRELOAD_N),
        }
    }

    /// Cases of the experiment.
    pub fn cases(self) -> Vec<Case> {
        let values = match self {
            Self::Preload => PRELOADS_N,
            Self::Speed => SPEEDS_MM_S,
        };
        values.map(|value| self.case(value)).to_vec()
    }

    fn of(self, case: &Case) -> f64 {
        match self {
            Self::Preload => case.preload_n,
            Self::Speed => case.speed_mm_s,
        }
    }

    fn axis(self) -> &'static str {
        match self {
            Self::Preload => "preload, N",
            Self::Speed => "speed, mm/s",
        }
    }

    fn fixed(self) -> String {
        match self {
            Self::Preload => format!("at {SPEED_MM_S} mm/s"),
            Self::Speed => format!("at {PRELOAD_N} N"),
        }
    }
}

/// One quantity over a sweep from all three sources.
#[derive(Clone, Debug)]
pub struct Curves {
    /// Where theory and simulation are given.
    pub at: Vec<f64>,
    /// The controller's model.
    pub theory: Vec<f64>,
    /// The ring.
    pub simulation: Vec<f64>,
    /// The virtual rig.
    pub experiment: Means,
}

#[derive(Clone, Debug)]
pub struct Sweep {
    /// What is swept.
    pub variable: Variable,
    /// Gap, mm.
    pub gap: Curves,
    /// True gap of the plant instead of the measured one, mm.
    pub true_gap: Means,
    /// Embedding depth, mm.
    pub depth: Curves,
    /// Contact area, mm^2.
    pub area: Curves,
    /// Largest gross slip of a run, mm.
    pub slip_mm: f64,
}

impl Sweep {
    /// Theory, simulation, and what the experiments on [`Variable::cases`] gave.
    pub fn new(variable: Variable, experiments: &[&Experiment]) -> Result<Self> {
        let cases = variable.cases();
        let (from, to) = (variable.of(&cases[0]), variable.of(&cases[cases.len() - 1]));
        let at: Vec<f64> =
            (0..GRID).map(|i| from + (to - from) * i as f64 / (GRID - 1) as f64).collect();
        let lifts: Vec<(Lift, Lift)> = at
            .par_iter()
            .map(|&value| {
                let case = variable.case(value);
                // The middle stage represents the mean of the three: the arm's thrust is
                // nearly linear over them.
                let simulated = simulation::lift(&case, Drive::Driven, 1)?;
                Ok((theory::mean_lift(&case, Drive::Driven)?, simulated))
            })
            .collect::<Result<_>>()?;
        let means = |reading: fn(&Reading) -> f64| {
            Means::of(experiments, |e| variable.of(&e.case), reading, GRID)
        };
        let curves = |lift: fn(&Lift) -> f64, reading: fn(&Reading) -> f64| Curves {
            at: at.clone(),
            theory: lifts.iter().map(|pair| lift(&pair.0)).collect(),
            simulation: lifts.iter().map(|pair| lift(&pair.1)).collect(),
            experiment: means(reading),
        };
        Ok(Self {
            variable,
            gap: curves(|l| l.gap_mm, |r| r.gap_mm),
            true_gap: means(|r| r.true_gap_mm),
            depth: curves(|l| l.depth_mm, |r| r.depth_mm),
            area: curves(|l| l.area_mm2, |r| r.area_mm2),
            slip_mm: experiments
                .iter()
                .flat_map(|e| &e.runs)
                .map(|run| run.slip_mm)
                .fold(0.0, f64::max),
        })
    }

    pub fn gap_figure(&self) -> Figure {
        let (id, title, published) = match self.variable {
            Variable::Preload => ("fig20", "Contact gap against preload", GAP_SPREAD_MM.0),
            Variable::Speed => ("fig21", "Contact gap against speed", GAP_SPREAD_MM.1),
        };
        let panels = vec![
            self.panel("Contact gap", "gap, mm", &self.gap),
            self.differences("gap", "mm", published, &self.gap),
        ];
        self.figure(id, title, panels, vec![spread_mark("gap", "mm", published, &self.gap)])
    }

    pub fn depth_figure(&self) -> Figure {
        let (preload, speed) = (
            ("fig22", "Embedding depth and contact area against preload"),
            ("fig23", "Embedding depth and contact area against speed"),
        );
        let ((id, title), depth, area) = match self.variable {
            Variable::Preload => (preload, DEPTH_SPREAD_MM.0, AREA_SPREAD_MM2.0),
            Variable::Speed => (speed, DEPTH_SPREAD_MM.1, AREA_SPREAD_MM2.1),
        };
        let panels = vec![
            self.panel("(a) Embedding depth", "depth, mm", &self.depth),
            self.panel("(b) Contact area", "area, mm²", &self.area),
            self.differences("depth", "mm", depth, &self.depth),
            self.differences("area", "mm²", area, &self.area),
        ];
        let marks = vec![
            spread_mark("embedding depth", "mm", depth, &self.depth),
            spread_mark("contact area", "mm²", area, &self.area),
        ];
        self.figure(id, title, panels, marks)
    }

    fn figure(
        &self,
        id: &'static str,
        title: &'static str,
        panels: Vec<Panel>,
        published: Vec<Mark>,
    ) -> Figure {
        let fixed = self.variable.fixed();
        let caption = if id == "fig20" {
            format!(
                "At rig loads, {fixed}. The wheel drives itself against a third of the 20 N on top, \
                 and the arm presses it into the wall. Theory: the tread rolled out in fixed point. \
                 Simulation: the converged ring with memory. Virtual rig: forty rigs within their \
                 tolerances, values as the sensors give them, mean of the three transitions of a \
                 deployment, a parabola for each rig, four means of ten. The two marks are apart \
                 by the largest difference between the study's means, the only value that it \
                 prints of these curves."
            )
        } else {
            format!("As figure 20, {fixed}.")
        };
        Figure { published, ..Figure::new(id, title, caption, 2, panels) }
    }

    fn panel(&self, title: &str, y: &str, curves: &Curves) -> Panel {
        let pairs =
            |values: &[f64]| curves.at.iter().copied().zip(values.iter().copied()).collect();
        let mut series = vec![
            Series::new(Source::Theory, pairs(&curves.theory)),
            Series::new(Source::Simulation, pairs(&curves.simulation)),
        ];
        series.extend(curves.experiment.series());
        let title = format!("{title}, {}", self.variable.fixed());
        Panel::new(title, self.variable.axis(), y, series)
    }

    /// The means alone, about their middle, between two marks that are as far apart as the
    /// published means are at most.
    fn differences(&self, what: &str, unit: &str, published: f64, curves: &Curves) -> Panel {
        let middle = curves.experiment.middle();
        let mut all = curves.experiment.series();
        for series in &mut all {
            series.points.iter_mut().zip(&middle).for_each(|(point, middle)| point.1 -= middle);
            series.range.clear();
        }
        let x = 0.5 * (curves.at[0] + curves.at[GRID - 1]);
        let half = 0.5 * published;
        all.push(Series::new(Source::Published, vec![(x, -half), (x, half)]));
        let title = format!("Differences between the means of the {what}");
        Panel::new(title, self.variable.axis(), &format!("off the mean, {unit}"), all)
    }
}

fn spread_mark(what: &str, unit: &'static str, published: f64, curves: &Curves) -> Mark {
    let what = format!("largest difference between the four means of the {what}");
    let ours = [(Source::Experiment, curves.experiment.spread())];
    Mark::new(what, unit, (published, false), &ours)
}
