//! Figures 13 to 16: collision force, impact stress and vibration amplitude of the three
//! finite-element cases. The study's vibration amplitude is its contact gap.

use anyhow::Result;

use super::case::Case;
use super::claims::{
    BySource, FALLS, RISES, Verdict, all_go, change, fixed, largest, percents, spans, within,
};
use super::experiment::{Experiment, Run, marks as mark_runs};
use super::finite_elements::{self, Crossing};
use super::histories::{Histories, stage_ends_mm};
use super::history::{Instant, Quantity};
use super::published::{AMPLITUDE_MM, CASES, COLLISION_N, STRESS};
use super::simulation;
use super::theory::{self, Drive, Lift};
use super::transitions::at;
use crate::figure::{Chart, Figure, Mark, SOURCES, Series, Source};
use crate::reference::{ReferenceCase, Rubber};

/// Largest deviation of one curve from another that closely resembles it, relative.
const CLOSE: f64 = 0.03;

/// Change of the contact area that counts as minimal, relative.
const MINIMAL: f64 = 0.03;

/// One case from all sources, in the first transition.
#[derive(Clone, Debug)]
struct Three {
    theory: Lift,
    simulation: Lift,
    /// All runs.
    experiment: Vec<Lift>,
}

impl Three {
    /// A figure from a source; of the experiment its mean over all runs.
    fn value(&self, source: Source, pick: &impl Fn(&Lift) -> f64) -> f64 {
        match source {
            Source::Theory => pick(&self.theory),
            Source::Simulation => pick(&self.simulation),
            _ => self.experiment.iter().map(pick).sum::<f64>() / self.experiment.len() as f64,
        }
    }
}

#[derive(Clone, Debug)]
pub(super) struct Amplitudes {
    cases: Vec<Three>,
    /// Stress jump of the wave that the touch of the corner launches in the first case,
    /// Pa: impedance times closing speed.
    touch_pa: f64,
}

impl Amplitudes {
    /// Theory and simulation without friction, to which the tread is fitted, and the
    /// first transition of the experiments, in the order of the study's cases.
    pub(super) fn new(experiments: &[&Experiment]) -> Result<Self> {
        let of = |experiment: &&Experiment| {
            let case = experiment.case;
            Ok(Three {
                theory: theory::lift(&case, Drive::Pushed, 0)?,
                simulation: simulation::lift(&case, Drive::Pushed, 0)?,
                experiment: experiment.runs.iter().filter_map(|run| first(&case, run)).collect(),
            })
        };
        let cases = experiments[..3].iter().map(of).collect::<Result<_>>()?;
        let first = ReferenceCase::first();
        let touch_pa = Rubber::of(&first).impedance() * first.closing_speed_mm_s() * 1e-3;
        Ok(Self { cases, touch_pa })
    }

    fn values(&self, source: Source, pick: impl Fn(&Lift) -> f64) -> [f64; 3] {
        std::array::from_fn(|index| self.cases[index].value(source, &pick))
    }

    /// A figure of the case at this place from each source.
    fn lift(&self, case: usize, pick: fn(&Lift) -> f64) -> BySource {
        SOURCES.map(|source| self.cases[case].value(source, &pick))
    }

    /// A figure of all cases, in units of `unit`, as a series; of the experiment its four means and
    /// the range of all runs.
    fn series(&self, source: Source, unit: f64, pick: impl Fn(&Lift) -> f64) -> Series {
        let pick = |lift: &Lift| pick(lift) / unit;
        if source != Source::Experiment {
            return Series::new(source, numbered(self.values(source, pick)));
        }
        let mut series = Series::new(source, Vec::new());
        for (x, three) in self.cases.iter().enumerate() {
            let all: Vec<f64> = three.experiment.iter().map(pick).collect();
            mark_runs(x as f64, &all, &mut series);
        }
        series
    }

    /// Figures 13 and 14: collision force and impact stress.
    pub(super) fn loads_figure(&self) -> Figure {
        let unit = |source| self.values(source, |lift| lift.impact_kpa)[0];
        let ratios = |source| self.values(source, |lift| lift.impact_kpa / unit(source));
        let stress = STRESS.map(|value| value / STRESS[0]);
        let force = |source| self.series(source, 1.0, |lift| lift.collision_n);
        let impact = |source| self.series(source, unit(source), |lift| lift.impact_kpa);
        let published_by = |values| Series::new(Source::Published, numbered(values));
        let force = SOURCES.map(force).into_iter().chain([published_by(COLLISION_N)]);
        let impact = SOURCES.map(impact).into_iter().chain([published_by(stress)]);
        let mut force = categories("Collision force (Fig. 13)", "force, N", force);
        force.least_y = Some((40.0, 65.0));
        let title = "Impact stress, ratio to the first (Fig. 14)";
        let impact = categories(title, "ratio", impact);
        let mut published = marks("collision force", "N", COLLISION_N, false, |source, i| {
            self.values(source, |lift| lift.collision_n)[i]
        });
        beside(&mut published, |crossing| crossing.collision_n);
        published.extend(
            marks("impact stress, ratio", "", stress, false, |source, i| ratios(source)[i])
                .into_iter()
                .skip(1),
        );
        let caption = format!(
            "First transition. Theory and simulation: pushed over a frictionless wall; theory at \
             the instant at which the lower wall stops carrying, simulation the largest of the \
             crossing. Virtual rig: at the study's loads, torque-driven, largest \
             value of its 0.1 s log. Continuum: the largest force until the lower wall is \
             released. The unit of the published stress is doubtful, so ratios are given; ours \
             are of hundreds of kPa, and the wave that the touch launches at 5 mm/s has {:.0} Pa. \
             Nothing in this figure is fitted.",
            self.touch_pa
        );
        let title = "Collision force and impact stress of the finite-element cases";
        Figure { published, ..Figure::new("fig13-14", title, caption, 2, vec![force, impact]) }
    }

    /// Figures 15 and 16: the vibration amplitude, which is the gap.
    pub(super) fn gap_figure(&self, all: &[Histories]) -> Figure {
        let gap = SOURCES.map(|source| self.series(source, 1.0, |lift| lift.gap_mm)).into_iter();
        let gap = gap.chain([Series::new(Source::Fitted, numbered(AMPLITUDE_MM))]);
        let mut panels =
            vec![categories("Vibration amplitude = contact gap (Fig. 15)", "gap, mm", gap)];
        panels.extend(all[..3].iter().map(Histories::clearance_panel));
        let mut published =
            marks("vibration amplitude = gap", "mm", AMPLITUDE_MM, true, |source, i| {
                self.values(source, |lift| lift.gap_mm)[i]
            });
        beside(&mut published, |crossing| crossing.gap_mm);
        let [slow, fast] = [5.0, 8.0].map(|speed| finite_elements::gap_range_mm(speed, 100.0));
        let caption = format!(
            "The tread is fitted to the three published amplitudes with the frictionless ring, \
             which is theory and simulation of the first plot: their agreement there is no \
             validation. On the virtual rig and in the other plots the wheel drives itself against \
             a third of the 60 N, which opens the gap by some per cent. These plots show the \
             clearance between the root of the first step and the undeformed wheel; the gap is \
             its value when the lower wall stops carrying. Continuum: for treads of 5 to 12 mm \
             the gap is {:.3} to {:.3} mm at 5 mm/s and {:.3} to {:.3} mm at 8 mm/s, 100 N.",
            slow.0, slow.1, fast.0, fast.1
        );
        let title = "Vibration amplitude of the finite-element cases";
        Figure { published, ..Figure::new("fig15-16", title, caption, 2, panels) }
    }
}

pub(super) fn verdicts(amplitudes: &Amplitudes, all: &[Histories]) -> Vec<Verdict> {
    let [slow, pressed, fast] = [0, 1, 2];
    let goes = |id, pick: fn(&Lift) -> f64, to, sense, (decimals, unit)| -> Verdict {
        let ends = [slow, to].map(|case| amplitudes.lift(case, pick));
        (id, all_go(ends, sense), vec![spans(ends, decimals, unit)])
    };
    let [force, depth, stress, gap]: [fn(&Lift) -> f64; 4] =
        [|l| l.collision_n, |l| l.depth_mm, |l| l.impact_kpa, |l| l.gap_mm];
    let simulated = |pick| amplitudes.values(Source::Simulation, pick);
    let force_off = change(COLLISION_N, simulated(force));
    let gap_off = change(AMPLITUDE_MM, simulated(gap));
    let off = |parts, decimals| vec![percents(parts, decimals, " and ")];
    let embedding = (3, "mm of embedding");
    let alike = change(amplitudes.values(Source::Theory, gap), simulated(gap));
    let [area, more_area] = [slow, pressed].map(|case| amplitudes.lift(case, |l| l.area_mm2));
    let area = change(area, more_area);
    let apart = largest(all[..3].iter().map(resemblance));
    let arm_over_gap = largest([slow, pressed, fast].into_iter().map(|case| {
        let [_, _, arm_um] = all[case].peak(Quantity::Vibration, 0);
        arm_um * 1e-3 / amplitudes.lift(case, gap)[2]
    }));
    vec![
        goes("fe-collision-falls-with-preload", force, pressed, FALLS, (1, "N")),
        goes("fe-collision-grows-with-speed", force, fast, RISES, (1, "N")),
        ("fe-collision-values", within(force_off, 0.10), off(force_off, 1)),
        goes("displacement-falls-with-preload", depth, pressed, FALLS, embedding),
        goes("displacement-grows-with-speed", depth, fast, RISES, embedding),
        goes("stress-falls-with-preload", stress, pressed, FALLS, (0, "kPa")),
        goes("stress-grows-with-speed", stress, fast, RISES, (0, "kPa")),
        goes("amplitude-falls-with-preload", gap, pressed, FALLS, (3, "mm")),
        goes("amplitude-grows-with-speed", gap, fast, RISES, (3, "mm")),
        ("amplitude-values", within(gap_off, 0.03), off(gap_off, 1)),
        ("simulated-amplitudes-resemble-theory", within(alike, CLOSE), off(alike, 2)),
        ("simulated-curves-resemble-theory", apart < CLOSE, fixed(1, [100.0 * apart])),
        ("area-hardly-changes", within(area, MINIMAL), off(area, 1)),
        ("vibration-makes-the-gap", arm_over_gap > 0.5, fixed(2, [arm_over_gap])),
    ]
}

/// Largest difference of the simulated clearance from the theoretical one behind its
/// least value, relative.
fn resemblance(one: &Histories) -> f64 {
    let [theory, simulation, _] = SOURCES.map(|source| one.clearance(source));
    let least = theory.iter().enumerate().min_by(|a, b| a.1.1.total_cmp(&b.1.1));
    let from = least.map_or(0, |(index, _)| index);
    let apart = |&(t, y): &(f64, f64)| Some((at(&simulation, t)? / y - 1.0).abs());
    largest(theory[from..].iter().filter_map(apart))
}

/// The first transition of a run; none if it was not completed.
fn first(case: &Case, run: &Run) -> Option<Lift> {
    let reading = run.crossings.first()?;
    let passed_mm = stage_ends_mm(case)[0];
    let before = run.log.instants.iter().take_while(|now| now.position_mm < passed_mm);
    let most = |of: fn(&Instant) -> f64| before.clone().map(of).fold(0.0, f64::max);
    Some(Lift {
        gap_mm: reading.gap_mm,
        depth_mm: reading.depth_mm,
        area_mm2: reading.area_mm2,
        collision_n: most(|now| now.collision_n),
        impact_kpa: most(|now| now.impact_kpa),
    })
}

/// Adds the finite elements to the marks of the cases, in their order, where they have one.
fn beside(marks: &mut [Mark], pick: impl Fn(Crossing) -> f64) {
    for (mark, (speed, preload)) in marks.iter_mut().zip(CASES) {
        if let Some(crossing) = finite_elements::crossing(speed, preload) {
            mark.add(Source::FiniteElements, pick(crossing));
        }
    }
}

fn categories(title: &str, y: &str, series: impl Iterator<Item = Series>) -> Chart {
    let names = CASES[..3].iter().map(|(v, p)| format!("{v}, {p} N")).collect();
    Chart::of_categories(title, ("speed in mm/s, preload", names), y, series.collect())
}

fn numbered(values: [f64; 3]) -> Vec<(f64, f64)> {
    values.into_iter().enumerate().map(|(index, value)| (index as f64, value)).collect()
}

fn marks(
    what: &str,
    unit: &'static str,
    published: [f64; 3],
    fitted: bool,
    ours: impl Fn(Source, usize) -> f64,
) -> Vec<Mark> {
    let mark = |(index, &published): (usize, &f64)| {
        let what = format!("{what} at {} mm/s, {} N", CASES[index].0, CASES[index].1);
        let ours = SOURCES.map(|source| (source, ours(source, index)));
        Mark::new(what, unit, (published, fitted), &ours)
    };
    published.iter().enumerate().map(mark).collect()
}
