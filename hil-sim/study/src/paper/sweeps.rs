//! Figures 20 to 23: gap, embedding depth and contact area against preload and speed at
//! the rig's loads, and the study's claims about them.

use anyhow::Result;
use rayon::prelude::*;

use super::case::{Case, Loads};
use super::experiment::{Experiment, Reading};
use super::means::{Means, bend};
use super::published::{AREA_SPREAD_MM2, DEPTH_SPREAD_MM, GAP_SPREAD_MM};
use super::simulation;
use super::theory::{self, Drive, Lift};
use crate::figure::{Chart, Claim, Figure, Mark, Series, Source};

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

    fn panel(&self, title: &str, y: &str, curves: &Curves) -> Chart {
        let pairs =
            |values: &[f64]| curves.at.iter().copied().zip(values.iter().copied()).collect();
        let mut series = vec![
            Series::new(Source::Theory, pairs(&curves.theory)),
            Series::new(Source::Simulation, pairs(&curves.simulation)),
        ];
        series.extend(curves.experiment.series());
        let title = format!("{title}, {}", self.variable.fixed());
        Chart::new(title, self.variable.axis(), y, series)
    }

    /// The means alone, about their middle, between two marks that are as far apart as the
    /// published means are at most.
    fn differences(&self, what: &str, unit: &str, published: f64, curves: &Curves) -> Chart {
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
        Chart::new(title, self.variable.axis(), &format!("off the mean, {unit}"), all)
    }
}

fn spread_mark(what: &str, unit: &'static str, published: f64, curves: &Curves) -> Mark {
    let what = format!("largest difference between the four means of the {what}");
    let ours = [(Source::Experiment, curves.experiment.spread())];
    Mark::new(what, unit, (published, false), &ours)
}

const SECTION: &str = "Analysis and discussion of test results";

/// Whether a spread is the published one within a factor of two.
fn alike(published: f64, ours: f64) -> bool {
    (0.5..=2.0).contains(&(ours / published))
}

fn ends(curves: &Curves, decimals: usize, unit: &str) -> String {
    let ends = |values: &[f64]| {
        format!("{:.decimals$} to {:.decimals$} {unit}", values[0], values[values.len() - 1])
    };
    format!(
        "Theory {}, simulation {}, virtual rig {}.",
        ends(&curves.theory),
        ends(&curves.simulation),
        ends(&curves.experiment.middle())
    )
}

/// Whether theory and simulation, and all four means, change with one sign throughout.
fn all_go(curves: &Curves, sense: f64) -> bool {
    let goes = |values: &[f64]| values.windows(2).all(|w| sense * (w[1] - w[0]) > 0.0);
    goes(&curves.theory) && goes(&curves.simulation) && curves.experiment.all_go(sense)
}

/// The bend over the rise of theory, simulation and the mean of means.
fn bends(curves: &Curves) -> [f64; 3] {
    [&curves.theory, &curves.simulation, &curves.experiment.middle()].map(|values| bend(values))
}

/// Whether theory, simulation and all four means bend to the same side of a straight line.
fn nonlinear(curves: &Curves) -> bool {
    let [theory, simulation, _] = bends(curves);
    let means = curves.experiment.bends();
    [theory, simulation].iter().chain(&means).all(|bend| bend * theory > 0.0)
}

fn bent(curves: &Curves) -> String {
    let [theory, simulation, experiment] = bends(curves).map(|bend| 100.0 * bend);
    format!(
        "Off the straight line between the ends by {theory:+.1} %, {simulation:+.1} % and \
         {experiment:+.1} % of the change (theory, simulation, virtual rig)."
    )
}

/// Unit of a length and of an area, with decimals.
const MM: (&str, usize) = ("mm", 3);
const MM2: (&str, usize) = ("mm²", 2);

/// A claim about the largest difference between the four means, which are `what`.
fn spread(
    of: Claim,
    what: &str,
    curves: &Curves,
    published: f64,
    (unit, decimals): (&str, usize),
) -> Claim {
    let ours = curves.experiment.spread();
    let claim = format!("The largest difference between the four {what} is {published} {unit}.");
    // The tolerances that would be needed for the published one.
    let narrower = format!(
        "Ours is {:.0} % of the published one: between means of ten, {published} {unit} takes \
         single runs {:.1} times as far apart as the tolerances of the virtual rig make them. \
         These are chosen, not published; wear within a series of runs, which the study \
         names as a source, is not modelled as a drift.",
        100.0 * ours / published,
        published / ours
    );
    of.explained(claim, alike(published, ours), format!("{ours:.decimals$} {unit}."), &narrower)
}

/// Claims about the sweep over the preload: figures 20 and 22.
pub fn preload_claims(sweep: &Sweep) -> Vec<Claim> {
    let [gaps, depths] = ["fig20", "fig22"].map(|figure| move |id| Claim::of(figure, SECTION, id));
    let (gap, depth, area) = (&sweep.gap, &sweep.depth, &sweep.area);
    let gap_spread = gap.experiment.spread();
    let fall = -gap.experiment.rise();
    vec![
        gaps("gap-falls-with-preload").judged(
            "At constant speed, more preload in the transition leaves a smaller contact gap; all \
             four mean curves show the same trend.",
            all_go(gap, -1.0),
            ends(gap, 3, "mm"),
        ),
        spread(gaps("gap-spread-preload"), "mean curves of the gap", gap, GAP_SPREAD_MM.0, MM),
        gaps("errors-do-not-hide-the-trend").judged(
            "Wear, delayed preload and part tolerances do not hide how the gap depends on the \
             conditions.",
            fall > gap_spread,
            format!(
                "The gap changes by {fall:.3} mm over the sweep, the means differ by {gap_spread:.3} mm \
                 at most; measured and true gap differ by {:.3} mm at most.",
                measured_off(sweep)
            ),
        ),
        depths("depth-grows-with-preload").explained(
            "At constant speed the embedding depth grows with the preload, nonlinearly.",
            all_go(depth, 1.0) && nonlinear(depth),
            format!("{} {}", ends(depth, 3, "mm"), bent(depth)),
            "It grows, but not all six curves bend to the same side.",
        ),
        depths("area-grows-with-depth-preload").judged(
            "As the embedding depth grows with the preload, so does the contact area.",
            all_go(area, 1.0),
            ends(area, 1, "mm²"),
        ),
        spread(depths("depth-spread-preload"), "means of the depth", depth, DEPTH_SPREAD_MM.0, MM),
        spread(depths("area-spread-preload"), "means of the area", area, AREA_SPREAD_MM2.0, MM2),
        spreads_agree(
            depths("depth-and-area-spreads-agree-preload"),
            sweep,
            (DEPTH_SPREAD_MM.0, AREA_SPREAD_MM2.0),
        ),
    ]
}

/// Claims about the sweep over the speed: figures 21 and 23.
pub fn speed_claims(sweep: &Sweep, preload: &Sweep) -> Vec<Claim> {
    let [gaps, depths] = ["fig21", "fig23"].map(|figure| move |id| Claim::of(figure, SECTION, id));
    let (gap, depth, area) = (&sweep.gap, &sweep.depth, &sweep.area);
    let gap_spread = gap.experiment.spread();
    let other = preload.gap.experiment.spread();
    vec![
        gaps("gap-grows-with-speed").judged(
            "At constant preload the contact gap grows with the speed, nonlinearly.",
            all_go(gap, 1.0) && nonlinear(gap),
            format!("{} {}", ends(gap, 3, "mm"), bent(gap)),
        ),
        spread(gaps("gap-spread-speed"), "mean curves of the gap", gap, GAP_SPREAD_MM.1, MM),
        gaps("speed-spreads-more").explained(
            "The means differ more over the speed (0.32 mm) than over the preload (0.24 mm), \
             because of wear and momentary slip.",
            gap_spread > 1.1 * other,
            format!(
                "{gap_spread:.3} mm over the speed, {other:.3} mm over the preload; gross slip of a run \
                 at most {:.3} mm.",
                sweep.slip_mm
            ),
            "The same forty rigs make both sweeps, and their tolerances move the entire curve.",
        ),
        depths("depth-grows-with-speed").explained(
            "At constant preload the embedding depth grows with the speed.",
            all_go(depth, 1.0),
            ends(depth, 3, "mm"),
            "It falls. Rubber stiffens with speed, so that the wheel sinks in less: that is why its \
             gap grows. A wheel that sank in deeper would be lower over the root of the step \
             and leave a smaller gap, against figure 21.",
        ),
        depths("area-grows-with-depth-speed").explained(
            "The contact area grows with the speed, as the depth does.",
            all_go(area, 1.0),
            ends(area, 1, "mm²"),
            "It falls with the depth, for the same reason.",
        ),
        depths("area-follows-depth").judged(
            "Contact area and embedding depth change alike.",
            all_go(area, 1.0) == all_go(depth, 1.0) && all_go(area, -1.0) == all_go(depth, -1.0),
            "Both change with the same sign in theory, simulation and all four means.".into(),
        ),
        spread(depths("depth-spread-speed"), "means of the depth", depth, DEPTH_SPREAD_MM.1, MM),
        spread(depths("area-spread-speed"), "means of the area", area, AREA_SPREAD_MM2.1, MM2),
        spreads_agree(
            depths("depth-and-area-spreads-agree-speed"),
            sweep,
            (DEPTH_SPREAD_MM.1, AREA_SPREAD_MM2.1),
        ),
    ]
}

/// Whether a published spread of the area is what geometry makes of that of the depth.
fn spreads_agree(of: Claim, sweep: &Sweep, (depth_mm, area_mm2): (f64, f64)) -> Claim {
    let rise = |curves: &Curves| curves.theory[GRID - 1] - curves.theory[0];
    let per_depth = rise(&sweep.area) / rise(&sweep.depth);
    let expected = per_depth * depth_mm;
    of.explained(
        "The published spreads of depth and area belong to one wheel of 25 mm by 28 mm.",
        alike(expected, area_mm2),
        format!(
            "A tread that is {depth_mm} mm deeper touches {expected:.1} mm² more at lift-off; \
             published are {area_mm2} mm²."
        ),
        "The two do not belong together: the study does not say how it made areas of its sensors.",
    )
}

/// Largest difference of the measured from the true mean of means, mm.
fn measured_off(sweep: &Sweep) -> f64 {
    let pairs = sweep.gap.experiment.middle().into_iter().zip(sweep.true_gap.middle());
    pairs.map(|(measured, is)| (measured - is).abs()).fold(0.0, f64::max)
}
