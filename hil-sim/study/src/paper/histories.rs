//! The histories of a case from all three sources.

use anyhow::Result;

use super::case::{Arms, Case};
use super::experiment::{Experiment, STAGES, groups};
use super::history::{History, Instant, Points, Quantity};
use super::measure::LEAVES_MM;
use super::{simulation, theory};
use crate::figure::{Chart, SOURCES, Series, Source};

/// What has a curve of its own, beside the means.
const MODELS: [Source; 2] = [Source::Theory, Source::Simulation];

/// One of this many points of theory and simulation is shown.
const SHOWN_OF: usize = 8;

/// Travel of a deployment before the first corner is touched, mm.
const BEFORE_MM: f64 = 3.0;

/// Travel behind a step within which the wheel has left its edge, mm.
const LEFT_MM: f64 = 2.0;

/// The largest value of a transition.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Peak {
    /// When, s.
    pub time_s: f64,
    /// Where the wheel is then, mm.
    pub position_mm: f64,
    pub value: f64,
}

#[derive(Clone, Debug)]
pub(super) struct Histories {
    pub case: Case,
    /// The controller's model.
    theory: History,
    /// The ring.
    simulation: History,
    /// Four means of the virtual rig.
    means: Vec<History>,
    /// The mean of these.
    experiment: History,
    /// When the first step has been passed, s.
    pub first_passed_s: f64,
}

impl Histories {
    /// Theory and simulation of the experiment's case, and its four means.
    pub(super) fn new(experiment: &Experiment) -> Result<Self> {
        let case = experiment.case;
        let arms = Arms::of(&case)?;
        // All means are as long as the shortest log of all runs.
        let lines = experiment.runs.iter().map(|run| run.log.instants.len()).min().unwrap_or(0);
        let mean = |group: &Vec<usize>| {
            let logs: Vec<&History> = group.iter().map(|&rig| &experiment.runs[rig].log).collect();
            History::mean(&logs, lines)
        };
        let means: Vec<History> = groups().iter().map(mean).collect();
        Ok(Self {
            case,
            theory: theory::deployment(&case, &arms)?,
            simulation: simulation::deployment(&case, &arms)?,
            experiment: History::mean(&means.iter().collect::<Vec<_>>(), lines),
            means,
            first_passed_s: case.loads.rig().rig.step_positions_mm[0] / case.speed_mm_s,
        })
    }

    /// The deployment from a source; from the experiment the mean of its means.
    fn history(&self, source: Source) -> &History {
        match source {
            Source::Theory => &self.theory,
            Source::Simulation => &self.simulation,
            _ => &self.experiment,
        }
    }

    /// Values of a quantity from a source.
    pub(super) fn points(&self, quantity: Quantity, source: Source) -> Points {
        self.history(source).points(quantity)
    }

    /// Largest value in each of the three transitions. They are told apart by where the wheel
    /// is: the experiment's is slower than the case while its preload rises.
    pub(super) fn peaks(&self, quantity: Quantity, source: Source) -> [Peak; STAGES] {
        let peak = |now: &Instant| {
            let Instant { time_s, position_mm, .. } = *now;
            Peak { time_s, position_mm, value: quantity.of(now) }
        };
        let ends_mm = stage_ends_mm(&self.case);
        std::array::from_fn(|stage| {
            let from_mm = if stage == 0 { 0.0 } else { ends_mm[stage - 1] };
            let all = self.history(source).instants.iter().map(peak);
            let within = all.filter(|p| (from_mm..ends_mm[stage]).contains(&p.position_mm));
            within.fold(Peak::default(), |most, p| if p.value > most.value { p } else { most })
        })
    }

    /// The largest values of the three transitions, from each source.
    pub(super) fn peak_values(&self, quantity: Quantity) -> [[f64; STAGES]; 3] {
        SOURCES.map(|source| self.peaks(quantity, source).map(|peak| peak.value))
    }

    /// The largest value of one transition, counted from 0, from each source.
    pub(super) fn peak(&self, quantity: Quantity, stage: usize) -> [f64; 3] {
        self.peak_values(quantity).map(|peaks| peaks[stage])
    }

    /// The largest values by transition, as text.
    pub(super) fn peaks_text(&self, quantity: Quantity) -> String {
        let of = |peaks: [f64; STAGES]| peaks.map(|peak| format!("{peak:.1}")).join(", ");
        format!("{}: {}", self.case.name(), self.peak_values(quantity).map(of).join("; "))
    }

    /// Largest value after the third transition, beyond the largest before the first, over
    /// the largest of all, from each source.
    pub(super) fn left_over(&self, quantity: Quantity) -> [f64; 3] {
        // The wheel's patch behind the last edge, and the arm's ring-down.
        let after = stage_ends_mm(&self.case)[STAGES - 1] + LEAVES_MM + 0.2 * self.case.speed_mm_s;
        SOURCES.map(|source| {
            let most = |from: f64, to: f64| {
                let all = self.history(source).instants.iter();
                let within = all.filter(|now| (from..=to).contains(&now.position_mm));
                within.map(|now| quantity.of(now).abs()).fold(0.0, f64::max)
            };
            (most(after, f64::INFINITY) - most(f64::NEG_INFINITY, BEFORE_MM)).max(0.0)
                / most(f64::NEG_INFINITY, f64::INFINITY)
        })
    }

    pub(super) fn panel(&self, quantity: Quantity) -> Chart {
        let title = format!("{} {}", ["(a)", "(b)", "(c)"][quantity as usize], self.case.name());
        let means = self.means.iter().map(|mean| mean.points(quantity));
        let of = |source| Series::new(source, thin(&self.points(quantity, source)));
        let series = MODELS.map(of).into_iter().chain(Series::means(means)).collect();
        Chart::new(title, "time, s", quantity.axis(), series)
    }

    /// Clearance from the root of the first step until the centre passes it.
    pub(super) fn clearance(&self, source: Source) -> Points {
        self.history(source).clearance_until(f64::INFINITY)
    }

    /// The clearance at the first step as a plot.
    pub(super) fn clearance_panel(&self) -> Chart {
        let title = format!("Clearance (Fig. 16): {}", self.case.name());
        let shown = |source| self.clearance(source).into_iter().step_by(SHOWN_OF).collect();
        let means = self.means.iter().map(|m| m.clearance_until(self.first_passed_s - 0.2));
        let series = MODELS.map(|source| Series::new(source, shown(source)));
        let series = series.into_iter().chain(Series::means(means)).collect();
        Chart::new(title, "time, s", "root clearance, mm", series)
    }
}

/// All quantities of all cases as plots.
pub(super) fn panels(all: &[Histories]) -> Vec<Chart> {
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

/// Where the wheel has left each of the steps behind, mm.
pub(super) fn stage_ends_mm(case: &Case) -> [f64; STAGES] {
    let steps = case.loads.rig().rig.step_positions_mm;
    std::array::from_fn(|stage| steps[stage] + LEFT_MM)
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
