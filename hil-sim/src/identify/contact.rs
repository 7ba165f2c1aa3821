//! The fit of the tread, the friction, the load, the steps and the sensors: least squares
//! of compression, arm angle and drive effort over all logs at once.
//!
//! Each channel of each log is weighted by the noise of its own residuals, correlation
//! included, so that a systematic model error counts as one error and not as many
//! independent readings.

use std::cell::RefCell;
use std::ops::Range;

use nalgebra::DMatrix;

use super::IdentifyError;
use super::coordinates::{Coordinates, FRICTION, OFF, Prior};
use super::forward::{Channels, Run, Trajectory, derivatives, quotient, simulate};
use super::least_squares::{Model, NEAR, Noise, SETTLED, minimise, robust};

/// Deviations that the first fit assumes: compression, mm, angle, mrad, effort, N; ten
/// times those of the sensors, as the start may be far off.
const FIRST: [f64; 3] = [5e-3, 0.3, 0.5];
/// Least deviations: the forward model's own errors.
pub(super) const LEAST: [f64; 3] = [2e-4, 2e-2, 2e-2];
/// Length of a block of correlated values, by channel: 0.16 s, the shortest crossing.
const BLOCKS: [usize; 3] = [16, 16, 4];
/// By how much the scatter of the blocks is widened. Some nine crossings determine steps,
/// friction and wheel: Student's t with eight degrees of freedom in place of the normal
/// quantile, 1.18. And the model has an error common to all crossings, the jitter of the
/// drive's load between two counts, which raises the creep: 1.9, by the first range of
/// [`super::CALIBRATION`].
const WIDENED: f64 = 1.18 * 1.9;
/// Deviation of friction while nothing determines it, logarithm.
const HELD_LN: f64 = 0.02;
/// Derivatives are kept while a coordinate has moved by no more than this part of its deviation.
const KEPT: f64 = 0.5;

/// The result.
#[derive(Clone, Debug)]
pub(crate) struct Contact {
    /// Coordinates.
    pub x: Vec<f64>,
    pub covariance: DMatrix<f64>,
    pub trajectories: Vec<Trajectory>,
    pub residuals: Vec<Channels>,
}

struct Weighted<'a> {
    runs: &'a [Run],
    measured: Vec<Channels>,
    coordinates: &'a Coordinates,
    weights: Vec<[f64; 3]>,
    /// Where the derivatives were taken last, and those, by log.
    taken: RefCell<(Vec<f64>, Vec<Vec<Channels>>)>,
}

impl<'a> Weighted<'a> {
    fn new(runs: &'a [Run], coordinates: &'a Coordinates) -> Self {
        let measured = runs.iter().map(Run::measured).collect();
        let weights = vec![FIRST.map(|deviation| 1.0 / deviation); runs.len()];
        Self { runs, measured, coordinates, weights, taken: RefCell::default() }
    }

    /// Predicted less measured values, by log.
    fn remaining(&self, x: &[f64], at: &[Trajectory]) -> Vec<Channels> {
        let runs = self.runs.iter().zip(at).zip(&self.measured);
        runs.map(|((run, at), measured)| quotient(&run.predicted(at, x), measured, 1.0)).collect()
    }

    /// Blocks of rows whose residuals may be correlated.
    fn blocks(&self) -> Vec<Range<usize>> {
        let (mut blocks, mut from) = (Vec::new(), 0);
        for (values, length) in self.measured.iter().flat_map(|log| log.iter().zip(BLOCKS)) {
            let end = from + values.len();
            blocks.extend((from..end).step_by(length).map(|from| from..(from + length).min(end)));
            from = end;
        }
        blocks
    }

    /// Weights each channel by the noise of its residuals.
    fn reweigh(&mut self, x: &[f64], at: &[Trajectory]) {
        let weight = |values: &Vec<f64>, least: f64| 1.0 / Noise::of(values).effective().max(least);
        let of = |log: &Channels| std::array::from_fn(|i| weight(&log[i], LEAST[i]));
        self.weights = self.remaining(x, at).iter().map(of).collect();
    }

    /// Derivatives over the deviations, coordinate after coordinate; behind the logs' the priors'.
    fn columns(&self, by_log: &[Vec<Channels>]) -> Vec<Vec<f64>> {
        let priors = self.coordinates.priors();
        let of = |(index, own): (usize, &Prior)| {
            let logs = by_log.iter().enumerate();
            let logs = logs.flat_map(|(log, by)| self.weighted(log, &by[index]));
            let prior = |i: usize| if i == index { 1.0 / own.deviation } else { 0.0 };
            logs.chain((0..priors.len()).map(prior)).collect()
        };
        priors.iter().enumerate().map(of).collect()
    }

    /// All values of a log over their deviations.
    fn weighted<'b>(&self, log: usize, channels: &'b Channels) -> impl Iterator<Item = f64> + 'b {
        let each = channels.iter().zip(self.weights[log]);
        each.flat_map(|(values, weight)| values.iter().map(move |value| value * weight))
    }
}

impl Model for Weighted<'_> {
    type At = Vec<Trajectory>;

    fn at(&self, x: &[f64]) -> Option<Vec<Trajectory>> {
        x.iter().all(|x| x.is_finite()).then_some(())?;
        simulate(self.runs, self.coordinates, x).ok()
    }

    fn residuals(&self, x: &[f64], at: &Vec<Trajectory>) -> Vec<f64> {
        let remaining = self.remaining(x, at);
        let logs = remaining.iter().enumerate().flat_map(|(log, left)| self.weighted(log, left));
        let priors = x.iter().zip(self.coordinates.priors());
        logs.chain(priors.map(|(x, prior)| (x - prior.mean) / prior.deviation)).collect()
    }

    fn jacobian(&self, x: &[f64], at: &Vec<Trajectory>) -> Option<Vec<Vec<f64>>> {
        let mut taken = self.taken.borrow_mut();
        let mut columns = self.columns(&taken.1);
        let moved = || columns.iter().zip(x.iter().zip(&taken.0));
        let change = |row: usize| moved().map(|(by, (x, at))| by[row] * (x - at)).sum::<f64>();
        let square: f64 = (0..columns[0].len()).map(|row| change(row).powi(2)).sum();
        if taken.0.is_empty() || square > KEPT * KEPT {
            let runs = self.runs.iter().zip(at);
            let by = runs.map(|(run, at)| derivatives(run, self.coordinates, x, at));
            *taken = (x.to_vec(), by.collect::<Result<_, _>>().ok()?);
            columns = self.columns(&taken.1);
        }
        Some(columns)
    }
}

/// Fits the coordinates to the runs: coarsely, twice more with the noise that this leaves, and finely.
pub(crate) fn fit(runs: &[Run], coordinates: &Coordinates) -> Result<Contact, IdentifyError> {
    let coarse = coordinates.coarse();
    let start: Vec<f64> = coarse.priors().iter().map(|prior| prior.mean).collect();
    // Friction shows in the creep, and only once the rest is in place.
    let held = coarse.known(FRICTION, start[FRICTION], HELD_LN);
    let first = minimise(&Weighted::new(runs, &held), &start, NEAR)?;
    let near = refit(runs, &coarse, (&first.x, &first.at))?;
    refit(runs, coordinates, (&near.x, &near.trajectories))
}

/// Twice from near the fit on, a point and the trajectories there, with the noise that is left.
pub(super) fn refit(
    runs: &[Run],
    coordinates: &Coordinates,
    (x, at): (&[f64], &[Trajectory]),
) -> Result<Contact, IdentifyError> {
    let mut model = Weighted::new(runs, coordinates);
    model.reweigh(x, at);
    let second = minimise(&model, x, NEAR)?;
    model.reweigh(&second.x, &second.at);
    let fitted = minimise(&model, &second.x, SETTLED)?;
    let blocks = model.blocks();
    let mut covariance = robust(&fitted.jacobian, &fitted.residuals, &blocks, WIDENED)?;
    // What the model is off by moves what the logs weigh against it along.
    for (index, off) in OFF {
        let along = covariance.column(index) / covariance[(index, index)];
        covariance += off * off * &along * along.transpose();
    }
    let residuals = model.remaining(&fitted.x, &fitted.at);
    Ok(Contact { covariance, trajectories: fitted.at, x: fitted.x, residuals })
}
