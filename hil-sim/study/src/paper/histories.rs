//! The histories of a case from all three sources.

use anyhow::Result;

use super::case::{Arms, Case};
use super::experiment::{Experiment, STAGES, groups};
use super::history::{History, Points, Quantity};
use super::{simulation, theory};
use crate::figure::{Panel, SOURCES, Series, Source};

/// One of this many points of theory and simulation is shown.
const SHOWN_OF: usize = 8;

/// Travel over which the contact patch leaves an edge, mm.
const LEAVES_MM: f64 = 8.0;

/// Travel of a deployment before the first corner is touched, mm.
const BEFORE_MM: f64 = 3.0;

/// Travel behind a step within which the wheel has left its edge, mm.
const LEFT_MM: f64 = 2.0;

/// The histories of one case.
#[derive(Clone, Debug)]
pub struct Histories {
    /// The case.
    pub case: Case,
    /// The reduced model.
    theory: History,
    /// The ring.
    simulation: History,
    /// Four means of the virtual rig.
    means: Vec<History>,
    /// When the first step has been passed, s.
    pub first_passed_s: f64,
}

impl Histories {
    /// Theory and simulation of the experiment's case, and its four means.
    ///
    /// # Errors
    /// If a crossing cannot be computed.
    pub fn new(experiment: &Experiment) -> Result<Self> {
        let case = experiment.case;
        let arms = Arms::of(&case)?;
        // All means are as long as the shortest log of all runs.
        let lines = experiment.runs.iter().map(|run| run.log.collision.len()).min().unwrap_or(0);
        let mean = |group: &Vec<usize>| {
            let logs: Vec<&History> = group.iter().map(|&rig| &experiment.runs[rig].log).collect();
            History::mean(&logs, lines)
        };
        Ok(Self {
            case,
            theory: theory::deployment(&case, &arms)?,
            simulation: simulation::deployment(&case, &arms)?,
            means: groups().iter().map(mean).collect(),
            first_passed_s: case.loads.rig().rig.step_positions_mm[0] / case.speed_mm_s,
        })
    }

    /// Values of a quantity from a source; of the experiment the mean of its means.
    #[must_use]
    pub fn points(&self, quantity: Quantity, source: Source) -> Points {
        match source {
            Source::Theory => quantity.of(&self.theory).clone(),
            Source::Simulation => quantity.of(&self.simulation).clone(),
            _ => {
                let means: Vec<&Points> = self.means.iter().map(|m| quantity.of(m)).collect();
                let count = means.len() as f64;
                let sum = |i: usize| means.iter().map(|mean| mean[i].1).sum::<f64>();
                (0..means[0].len()).map(|i| (means[0][i].0, sum(i) / count)).collect()
            }
        }
    }

    /// Largest value in each of the three transitions, and when it is reached.
    #[must_use]
    pub fn peaks(&self, quantity: Quantity, source: Source) -> [(f64, f64); STAGES] {
        let points = self.points(quantity, source);
        let ends = stage_ends_s(&self.case);
        std::array::from_fn(|stage| {
            let from = if stage == 0 { 0.0 } else { ends[stage - 1] };
            let within = points.iter().filter(|p| p.0 >= from && p.0 < ends[stage]);
            within.copied().fold((from, 0.0), |most, p| if p.1 > most.1 { p } else { most })
        })
    }

    /// The largest value of a stage from each source.
    #[must_use]
    pub fn stage(&self, quantity: Quantity, stage: usize) -> [f64; 3] {
        SOURCES.map(|source| self.peaks(quantity, source)[stage].1)
    }

    /// Largest value after the third transition, beyond the largest before the first, over
    /// the largest of all.
    #[must_use]
    pub fn left_over(&self, quantity: Quantity, source: Source) -> f64 {
        let points = self.points(quantity, source);
        let speed = self.case.speed_mm_s;
        // The wheel's patch behind the last edge, and the arm's ring-down.
        let after = stage_ends_s(&self.case)[STAGES - 1] + LEAVES_MM / speed + 0.2;
        let before = BEFORE_MM / speed;
        let most = |from: f64, to: f64| {
            let within = points.iter().filter(|p| (from..=to).contains(&p.0));
            within.map(|p| p.1.abs()).fold(0.0, f64::max)
        };
        (most(after, f64::INFINITY) - most(0.0, before)).max(0.0) / most(0.0, f64::INFINITY)
    }

    /// The quantity as a plot.
    #[must_use]
    pub fn panel(&self, quantity: Quantity) -> Panel {
        let title = format!("{} {}", ["(a)", "(b)", "(c)"][quantity as usize], self.case.name());
        let means = self.means.iter().map(|mean| quantity.of(mean).clone());
        let theory = Series::new(Source::Theory, thin(quantity.of(&self.theory)));
        let simulation = Series::new(Source::Simulation, thin(quantity.of(&self.simulation)));
        let series = [theory, simulation].into_iter().chain(Series::means(means)).collect();
        Panel::new(title, "time, s", quantity.axis(), series)
    }

    /// Clearance from the root of the first step until the centre passes it, theory and
    /// simulation.
    #[must_use]
    pub fn clearance(&self) -> [Points; 2] {
        [&self.theory, &self.simulation].map(|history| history.clearance_until(f64::INFINITY))
    }

    /// The clearance at the first step as a plot.
    #[must_use]
    pub fn clearance_panel(&self) -> Panel {
        let title = format!("Clearance at the first step (Fig. 16): {}", self.case.name());
        let [theory, simulation] =
            self.clearance().map(|points| points.into_iter().step_by(SHOWN_OF).collect());
        let means = self.means.iter().map(|m| m.clearance_until(self.first_passed_s - 0.2));
        let series = [(Source::Theory, theory), (Source::Simulation, simulation)]
            .map(|(source, points)| Series::new(source, points));
        let series = series.into_iter().chain(Series::means(means)).collect();
        Panel::new(title, "time, s", "root clearance, mm", series)
    }
}

/// All quantities of all cases as plots.
#[must_use]
pub fn panels(all: &[Histories]) -> Vec<Panel> {
    let row = |quantity| all.iter().map(move |one| one.panel(quantity));
    Quantity::ALL.into_iter().flat_map(row).collect()
}

/// The largest of every few points, so that no peak is lost, without those that lie
/// between equal ones.
fn thin(points: &[(f64, f64)]) -> Points {
    let largest = |some: &[(f64, f64)]| {
        some.iter().copied().reduce(|most, p| if p.1 > most.1 { p } else { most })
    };
    let shown: Points = points.chunks(SHOWN_OF).filter_map(largest).collect();
    let last = shown.len().saturating_sub(1);
    let flat = |i: usize| {
        i > 0 && i < last && shown[i - 1].1 == shown[i].1 && shown[i].1 == shown[i + 1].1
    };
    (0..shown.len()).filter(|&i| !flat(i)).map(|i| shown[i]).collect()
}

/// When the wheel has left each of the steps behind, s.
#[must_use]
pub fn stage_ends_s(case: &Case) -> [f64; STAGES] {
    let steps = case.loads.rig().rig.step_positions_mm;
    std::array::from_fn(|stage| (steps[stage] + LEFT_MM) / case.speed_mm_s)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinned_points_keep_peaks_and_the_ends_of_what_is_flat() {
        let value =
            |i: usize| if (40..60).contains(&i) { 10.0 - (i as f64 - 50.0).abs() } else { 0.0 };
        let points: Points = (0..100).map(|i| (i as f64, value(i))).collect();
        let shown = thin(&points);
        assert!(shown.contains(&(50.0, 10.0)) && shown.len() < 14, "{shown:?}");
        assert_eq!((shown[0].1, shown[shown.len() - 1].1), (0.0, 0.0));
        assert!(shown.windows(2).all(|pair| pair[1].0 > pair[0].0));
    }
}
