//! Collision, impact and vibration over the three transitions of a deployment, from all
//! three sources.

use super::case::Case;
use super::course::{Arms, Course, Points};
use super::experiment::{Experiment, Line, STAGES, groups};
use super::published::LOG_S;
use super::{simulation, theory};
use crate::figure::{Panel, Series, Source};
use crate::reference::ReferenceError;

/// Points of theory and simulation of which one is shown.
const SHOWN_OF: usize = 8;

/// Way over which its patch does, mm.
const LEAVES_MM: f64 = 8.0;

/// Way of a deployment before the first corner is touched, mm.
const BEFORE_MM: f64 = 3.0;

/// Way behind a step within which the wheel has left its edge, mm.
const LEFT_MM: f64 = 2.0;

/// What is followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Axial force of the contact beyond rolling resistance, N.
    Collision,
    /// That force over the surface that the step cuts off, at the hub, kPa.
    Impact,
    /// Deflection of the arm, um.
    Vibration,
}

impl Quantity {
    /// All three, in the order of cause and effect.
    pub const ALL: [Self; 3] = [Self::Collision, Self::Impact, Self::Vibration];

    /// Name and unit.
    #[must_use]
    pub const fn axis(self) -> &'static str {
        match self {
            Self::Collision => "collision, N",
            Self::Impact => "impact, kPa",
            Self::Vibration => "vibration, µm",
        }
    }

    /// Title of its plot for a case.
    #[must_use]
    pub fn title(self, case: &Case) -> String {
        let letter = ["(a)", "(b)", "(c)"][self.index()];
        format!("{letter} {}", case.name())
    }

    /// It in a course.
    fn of(self, course: &Course) -> &Points {
        match self {
            Self::Collision => &course.collision,
            Self::Impact => &course.impact,
            Self::Vibration => &course.vibration,
        }
    }

    const fn index(self) -> usize {
        self as usize
    }
}

/// The histories of one case.
#[derive(Clone, Debug)]
pub struct Histories {
    /// The case.
    pub case: Case,
    /// Of each quantity: reduced model, ring, and four means of the virtual rig.
    of: [(Points, Points, Vec<Points>); 3],
    /// Clearance from the root of the first step until the centre passes it: theory and
    /// simulation.
    pub clearance: (Points, Points),
    /// The same from the virtual rig, four means.
    pub clearance_means: Vec<Points>,
    /// When the first step has been passed, s.
    pub first_passed_s: f64,
}

impl Histories {
    /// Theory and simulation of the experiment's case, and its four means.
    ///
    /// # Errors
    /// [`ReferenceError`] if a crossing cannot be computed.
    pub fn new(experiment: &Experiment) -> Result<Self, ReferenceError> {
        let case = experiment.case;
        let arms = Arms::of(&case)?;
        let theory = theory::deployment(&case, &arms)?;
        let simulation = simulation::deployment(&case, &arms)?;
        let first_passed_s = case.loads.rig().rig.step_positions_mm[0] / case.speed_mm_s;
        let of = Quantity::ALL.map(|quantity| {
            let pair = (quantity.of(&theory).clone(), quantity.of(&simulation).clone());
            (pair.0, pair.1, means(experiment, |line| Some(pick(quantity, line))))
        });
        let clearance_means = means(experiment, |line| {
            line.clearance_mm.filter(|_| line.time_s < first_passed_s - 0.2)
        });
        Ok(Self {
            case,
            of,
            clearance: (theory.clearance, simulation.clearance),
            clearance_means,
            first_passed_s,
        })
    }

    /// Values of a quantity from a source; of the experiment the mean of its means.
    #[must_use]
    pub fn points(&self, quantity: Quantity, source: Source) -> Points {
        let (theory, simulation, means) = &self.of[quantity.index()];
        match source {
            Source::Theory => theory.clone(),
            Source::Simulation => simulation.clone(),
            _ => {
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
    pub fn panel(&self, quantity: Quantity, title: String) -> Panel {
        let (theory, simulation, means) = &self.of[quantity.index()];
        let mut panel = Panel::new(title, "time, s", quantity.axis());
        panel.series.push(Series::new(Source::Theory, thin(theory)));
        panel.series.push(Series::new(Source::Simulation, thin(simulation)));
        panel.series.extend(named(means));
        panel
    }

    /// The clearance at the first step as a plot.
    #[must_use]
    pub fn clearance_panel(&self, title: String) -> Panel {
        let mut panel = Panel::new(title, "time, s", "root clearance, mm");
        panel.series.push(Series::new(Source::Theory, every(&self.clearance.0)));
        panel.series.push(Series::new(Source::Simulation, every(&self.clearance.1)));
        panel.series.extend(named(&self.clearance_means));
        panel
    }
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

/// One of every few points.
fn every(points: &[(f64, f64)]) -> Points {
    points.iter().copied().step_by(SHOWN_OF).collect()
}

/// When the wheel has left each of the steps behind, s.
#[must_use]
pub fn stage_ends_s(case: &Case) -> [f64; STAGES] {
    let steps = case.loads.rig().rig.step_positions_mm;
    std::array::from_fn(|stage| (steps[stage] + LEFT_MM) / case.speed_mm_s)
}

fn named(means: &[Points]) -> impl Iterator<Item = Series> {
    means.iter().enumerate().map(|(index, points)| Series {
        name: format!("mean {}", index + 1),
        ..Series::new(Source::Experiment, points.clone())
    })
}

fn pick(quantity: Quantity, line: &Line) -> f64 {
    match quantity {
        Quantity::Collision => line.collision_n,
        Quantity::Impact => line.impact_kpa,
        Quantity::Vibration => line.vibration_um,
    }
}

/// The four means of a quantity of the log, as long as every run has it.
fn means(experiment: &Experiment, pick: impl Fn(&Line) -> Option<f64>) -> Vec<Points> {
    let runs = &experiment.runs;
    let lines = runs.iter().map(|run| run.log.len()).min().unwrap_or(0);
    let mean = |group: &Vec<usize>| {
        (0..lines)
            .filter_map(|line| {
                let values: Option<Vec<f64>> =
                    group.iter().map(|&rig| pick(&runs[rig].log[line])).collect();
                let values = values?;
                Some((line as f64 * LOG_S, values.iter().sum::<f64>() / values.len() as f64))
            })
            .collect()
    };
    groups().iter().map(mean).collect()
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
