//! Figures 20 to 23: gap, embedding depth and contact area against preload and speed at
//! the rig's loads, and the study's claims about them.

use anyhow::Result;
use rayon::prelude::*;

use super::case::{Case, Loads};
use super::claims::{FALLS, RISES, Verdict, fixed, goes, largest, percents, span};
use super::experiment::{Experiment, Reading};
use super::means::{Means, bend};
use super::published::{AREA_SPREAD_MM2, DEPTH_SPREAD_MM, GAP_SPREAD_MM};
use super::simulation;
use super::theory::{self, Drive, Lift};
use crate::figure::{Chart, Figure, Mark, Series, Source};

/// Preloads of the sweep, N: from the least to the most that the study names for its
/// rig.
pub(super) const PRELOADS_N: [f64; 5] = [33.3, 36.0, 40.0, 45.0, 50.0];
/// Speed of the preload sweep, mm/s.
pub(super) const SPEED_MM_S: f64 = 5.0;
/// Speeds of the sweep, mm/s: between the slowest and the fastest of the study.
pub(super) const SPEEDS_MM_S: [f64; 5] = [3.0, 4.0, 5.0, 6.5, 8.0];
/// Preload of the speed sweep, N.
pub(super) const PRELOAD_N: f64 = 40.0;

/// Points of a curve.
const GRID: usize = 11;

/// What is swept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Variable {
    /// Preload, at [`SPEED_MM_S`].
    Preload,
    /// Speed, at [`PRELOAD_N`].
    Speed,
}

impl Variable {
    pub(super) fn case(self, value: f64) -> Case {
        match self {
            Self::Preload => Case::new(Loads::Prototype, SPEED_MM_S, value),
            Self::Speed => Case::new(Loads::Prototype, value, PRELOAD_N),
        }
    }

    /// Cases of the experiment.
    pub(super) fn cases(self) -> Vec<Case> {
        [PRELOADS_N, SPEEDS_MM_S][self as usize].map(|value| self.case(value)).to_vec()
    }

    fn of(self, case: &Case) -> f64 {
        [case.preload_n, case.speed_mm_s][self as usize]
    }

    fn axis(self) -> &'static str {
        ["preload, N", "speed, mm/s"][self as usize]
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
pub(super) struct Curves {
    pub name: &'static str,
    pub unit: &'static str,
    /// Published largest difference between the four means.
    pub published: f64,
    /// The controller's model, at the places of the experiment's means.
    pub theory: Vec<f64>,
    /// The ring.
    pub simulation: Vec<f64>,
    /// The virtual rig.
    pub experiment: Means,
}

impl Curves {
    /// Theory, simulation and the mean of means.
    fn by_source(&self) -> [Vec<f64>; 3] {
        [self.theory.clone(), self.simulation.clone(), self.experiment.middle()]
    }

    /// Whether it holds of theory, simulation and all four means.
    fn all(&self, holds: impl Fn(&[f64]) -> bool) -> bool {
        let means = self.experiment.curves.iter();
        [&self.theory, &self.simulation].into_iter().chain(means).all(|curve| holds(curve))
    }

    /// Whether all of them change with one sign throughout.
    fn go(&self, sense: f64) -> bool {
        self.all(|curve| goes(curve, sense))
    }

    /// Whether all of them bend to the same side of a straight line.
    fn bend(&self) -> bool {
        self.all(|curve| bend(curve) * bend(&self.theory) > 0.0)
    }

    /// First and last values of each source, as texts.
    fn ends(&self, decimals: usize) -> Vec<String> {
        self.by_source().map(|values| span(&values, decimals, self.unit)).to_vec()
    }

    /// The same, and how far the curves bend off the straight line between their ends.
    fn ends_and_bends(&self) -> Vec<String> {
        let bends = percents(self.by_source().map(|values| bend(&values)), 1, " and ");
        [self.ends(3), vec![bends]].concat()
    }

    /// Whether the largest difference between the four means is the published one, and what
    /// it would take.
    fn spread(&self, id: &'static str, decimals: usize) -> Verdict {
        let (ours, published, unit) = (self.experiment.spread(), self.published, self.unit);
        // The tolerances that would be needed for the published one.
        let narrower = format!(
            "Ours is {:.0} % of the published one: between means of ten, {published} {unit} takes \
             single runs {:.1} times as far apart as the tolerances of the virtual rig make them. \
             These are chosen, not published; wear within a series of runs, which the study \
             names as a source, is not modelled as a drift.",
            100.0 * ours / published,
            published / ours
        );
        (id, alike(published, ours), vec![format!("{ours:.decimals$}"), narrower])
    }
}

#[derive(Clone, Debug)]
pub(super) struct Sweep {
    pub variable: Variable,
    /// Gap, mm.
    pub gap: Curves,
    /// True gap of the plant instead of the measured one, mm.
    pub true_gap: Means,
    /// Embedding depth, mm.
    pub depth: Curves,
    /// Contact area, mm^2.
    pub area: Curves,
}

impl Sweep {
    /// Theory, simulation, and what the experiments on [`Variable::cases`] gave.
    pub(super) fn new(variable: Variable, experiments: &[&Experiment]) -> Result<Self> {
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
            Means::of(experiments, |e| variable.of(&e.case), reading, &at)
        };
        type Pick = (fn(&Lift) -> f64, fn(&Reading) -> f64);
        let curves = |name, unit, published: [f64; 2], (lift, reading): Pick| Curves {
            name,
            unit,
            published: published[variable as usize],
            theory: lifts.iter().map(|pair| lift(&pair.0)).collect(),
            simulation: lifts.iter().map(|pair| lift(&pair.1)).collect(),
            experiment: means(reading),
        };
        Ok(Self {
            variable,
            gap: curves("gap", "mm", GAP_SPREAD_MM, (|l| l.gap_mm, |r| r.gap_mm)),
            true_gap: means(|r| r.true_gap_mm),
            depth: curves("depth", "mm", DEPTH_SPREAD_MM, (|l| l.depth_mm, |r| r.depth_mm)),
            area: curves("area", "mm²", AREA_SPREAD_MM2, (|l| l.area_mm2, |r| r.area_mm2)),
        })
    }

    pub(super) fn gap_figure(&self) -> Figure {
        let (id, title) = match self.variable {
            Variable::Preload => ("fig20", "Contact gap against preload"),
            Variable::Speed => ("fig21", "Contact gap against speed"),
        };
        let panels = vec![self.panel("Contact gap", &self.gap), self.differences(&self.gap)];
        self.figure(id, title, panels, vec![spread_mark("gap", &self.gap)])
    }

    pub(super) fn depth_figure(&self) -> Figure {
        let (id, title) = match self.variable {
            Variable::Preload => ("fig22", "Embedding depth and contact area against preload"),
            Variable::Speed => ("fig23", "Embedding depth and contact area against speed"),
        };
        let panels = vec![
            self.panel("(a) Embedding depth", &self.depth),
            self.panel("(b) Contact area", &self.area),
            self.differences(&self.depth),
            self.differences(&self.area),
        ];
        let marks = vec![
            spread_mark("embedding depth", &self.depth),
            spread_mark("contact area", &self.area),
        ];
        self.figure(id, title, panels, marks)
    }

    fn figure(
        &self,
        id: &'static str,
        title: &'static str,
        panels: Vec<Chart>,
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

    fn panel(&self, title: &str, curves: &Curves) -> Chart {
        let pairs = |values: &[f64]| {
            curves.experiment.at.iter().copied().zip(values.iter().copied()).collect()
        };
        let mut series = vec![
            Series::new(Source::Theory, pairs(&curves.theory)),
            Series::new(Source::Simulation, pairs(&curves.simulation)),
        ];
        series.extend(curves.experiment.series());
        let title = format!("{title}, {}", self.variable.fixed());
        let y = format!("{}, {}", curves.name, curves.unit);
        Chart::new(title, self.variable.axis(), &y, series)
    }

    /// The means alone, about their middle, between two marks that are as far apart as the
    /// published means are at most.
    fn differences(&self, curves: &Curves) -> Chart {
        let middle = curves.experiment.middle();
        let mut all = curves.experiment.series();
        for series in &mut all {
            series.points.iter_mut().zip(&middle).for_each(|(point, middle)| point.1 -= middle);
            series.range.clear();
        }
        let x = 0.5 * (curves.experiment.at[0] + curves.experiment.at[GRID - 1]);
        let half = 0.5 * curves.published;
        all.push(Series::new(Source::Published, vec![(x, -half), (x, half)]));
        let title = format!("Differences between the means of the {}", curves.name);
        Chart::new(title, self.variable.axis(), &format!("off the mean, {}", curves.unit), all)
    }
}

fn spread_mark(what: &str, curves: &Curves) -> Mark {
    let what = format!("largest difference between the four means of the {what}");
    let ours = [(Source::Experiment, curves.experiment.spread())];
    Mark::new(what, curves.unit, (curves.published, false), &ours)
}

/// Whether a spread is the published one within a factor of two.
fn alike(published: f64, ours: f64) -> bool {
    (0.5..=2.0).contains(&(ours / published))
}

/// Whether a published spread of the area is what geometry makes of that of the depth.
fn spreads_agree(id: &'static str, sweep: &Sweep) -> Verdict {
    let rise = |curves: &Curves| curves.theory[GRID - 1] - curves.theory[0];
    let (depth_mm, area_mm2) = (sweep.depth.published, sweep.area.published);
    let expected = rise(&sweep.area) / rise(&sweep.depth) * depth_mm;
    let found = vec![depth_mm.to_string(), format!("{expected:.1}"), area_mm2.to_string()];
    (id, alike(expected, area_mm2), found)
}

/// The verdicts on both sweeps: figures 20 and 22, then 21 and 23.
pub(super) fn verdicts(preload: &Sweep, speed: &Sweep, experiments: &[Experiment]) -> Vec<Verdict> {
    let Sweep { gap, true_gap, depth, area, .. } = preload;
    let middle = gap.experiment.middle();
    let fall = middle[0] - middle[GRID - 1];
    let [by_preload, by_speed] = [preload, speed].map(|sweep| sweep.gap.experiment.spread());
    let off = |(measured, is): (&f64, f64)| (measured - is).abs();
    let measured_off = largest(middle.iter().zip(true_gap.middle()).map(off));
    let trend = fixed(3, [fall, by_preload, measured_off]);
    let over_preload = [
        ("gap-falls-with-preload", gap.go(FALLS), gap.ends(3)),
        gap.spread("gap-spread-preload", 3),
        ("errors-do-not-hide-the-trend", fall > by_preload, trend),
        ("depth-grows-with-preload", depth.go(RISES) && depth.bend(), depth.ends_and_bends()),
        ("area-grows-with-depth-preload", area.go(RISES), area.ends(1)),
        depth.spread("depth-spread-preload", 3),
        area.spread("area-spread-preload", 2),
        spreads_agree("depth-and-area-spreads-agree-preload", preload),
    ];
    let Sweep { gap, depth, area, .. } = speed;
    let over_speed = experiments.iter().filter(|e| Variable::Speed.cases().contains(&e.case));
    let slip_mm = largest(over_speed.flat_map(|e| &e.runs).map(|run| run.slip_mm));
    let wider = fixed(3, [by_speed, by_preload, slip_mm]);
    let are_alike = [RISES, FALLS].into_iter().all(|sense| area.go(sense) == depth.go(sense));
    let over_speed = [
        ("gap-grows-with-speed", gap.go(RISES) && gap.bend(), gap.ends_and_bends()),
        gap.spread("gap-spread-speed", 3),
        ("speed-spreads-more", by_speed > 1.1 * by_preload, wider),
        ("depth-grows-with-speed", depth.go(RISES), depth.ends(3)),
        ("area-grows-with-depth-speed", area.go(RISES), area.ends(1)),
        ("area-follows-depth", are_alike, Vec::new()),
        depth.spread("depth-spread-speed", 3),
        area.spread("area-spread-speed", 2),
        spreads_agree("depth-and-area-spreads-agree-speed", speed),
    ];
    over_preload.into_iter().chain(over_speed).collect()
}
