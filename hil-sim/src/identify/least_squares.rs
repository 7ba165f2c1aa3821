//! Nonlinear least squares by Levenberg and Marquardt (MINPACK's form, by the crate of
//! that name), for models that are costly to evaluate; and the noise of the residuals: its
//! standard deviation, and how far correlation inflates the variance of a mean.

use std::ops::Range;

use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt, TerminationReason};
use nalgebra::storage::Owned;
use nalgebra::{DMatrix, DVector, Dyn};

use super::IdentifyError;

/// Relative change of the sum of squares and of the coordinates at which a fit has settled, and one whose
/// noise alone is asked for.
pub(super) const SETTLED: f64 = 1e-6;
pub(super) const NEAR: f64 = 1e-4;
/// Most evaluations, in units of the number of coordinates.
const MOST_EVALUATIONS: usize = 30;

/// What is fitted.
pub(crate) trait Model {
    /// The model's values at a point, shared by residuals and derivatives.
    type At;
    /// Evaluates the model; none where it has no value.
    fn at(&self, x: &[f64]) -> Option<Self::At>;
    /// Residuals, each over its standard deviation.
    fn residuals(&self, x: &[f64], at: &Self::At) -> Vec<f64>;
    /// Their derivatives, coordinate after coordinate.
    fn jacobian(&self, x: &[f64], at: &Self::At) -> Option<Vec<Vec<f64>>>;
}

/// The minimum.
#[derive(Clone, Debug)]
pub(crate) struct Fitted<A> {
    /// Coordinates.
    pub x: Vec<f64>,
    /// The model there.
    pub at: A,
    pub residuals: DVector<f64>,
    /// Derivatives there.
    pub jacobian: DMatrix<f64>,
}

struct Problem<'a, M: Model> {
    model: &'a M,
    x: DVector<f64>,
    at: Option<M::At>,
}

impl<M: Model> LeastSquaresProblem<f64, Dyn, Dyn> for Problem<'_, M> {
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;
    type ParameterStorage = Owned<f64, Dyn>;

    fn set_params(&mut self, x: &DVector<f64>) {
        self.x.copy_from(x);
        self.at = self.model.at(x.as_slice());
    }

    fn params(&self) -> DVector<f64> {
        self.x.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        let at = self.at.as_ref()?;
        Some(DVector::from_vec(self.model.residuals(self.x.as_slice(), at)))
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        let columns = self.model.jacobian(self.x.as_slice(), self.at.as_ref()?)?;
        let rows = columns.first()?.len();
        Some(DMatrix::from_vec(rows, columns.len(), columns.concat()))
    }
}

/// Minimises the sum of squares from `start` on, until a step changes it and the coordinates by less than
/// the part `settled`. The minimum is a local one: a coordinate whose residuals vanish with it, as a time
/// constant's do, is fitted by its logarithm.
pub(crate) fn minimise<M: Model>(
    model: &M,
    start: &[f64],
    settled: f64,
) -> Result<Fitted<M::At>, IdentifyError> {
    let problem = Problem { model, x: DVector::from_column_slice(start), at: model.at(start) };
    let solver = LevenbergMarquardt::new()
        .with_ftol(settled)
        .with_xtol(settled)
        .with_gtol(settled)
        .with_patience(MOST_EVALUATIONS);
    let (problem, report) = solver.minimize(problem);
    let settled = report.termination.was_successful()
        || matches!(report.termination, TerminationReason::NoImprovementPossible(_));
    if !settled {
        let why = match report.termination {
            TerminationReason::User(_) => {
                "the model cannot follow these logs; is their rig another one?".to_owned()
            }
            TerminationReason::LostPatience => "too many steps".to_owned(),
            other => format!("{other:?}"),
        };
        return Err(IdentifyError::NoFit(why));
    }
    match (problem.jacobian(), problem.residuals(), problem.at) {
        (Some(jacobian), Some(residuals), Some(at)) => {
            Ok(Fitted { x: problem.x.as_slice().to_vec(), at, residuals, jacobian })
        }
        _ => Err(IdentifyError::NoFit("the model has no answer at its end".into())),
    }
}

/// Covariance of the coordinates, (J'J)^-1, of residuals in standard deviations.
pub(crate) fn covariance(jacobian: &DMatrix<f64>) -> Result<DMatrix<f64>, IdentifyError> {
    let normal = jacobian.transpose() * jacobian;
    let inverse = normal.cholesky().map(|root| root.inverse());
    let why = "the logs do not determine the parameters";
    inverse.ok_or_else(|| IdentifyError::NoFit(why.into()))
}

/// The covariance, each variance at least that of the cluster-robust estimate
/// `H^-1 (w^2 sum g g' + P) H^-1` with a block's gradient g, the normal matrix H and the
/// part P of it that is no data (White 1980, Liang and Zeger 1986). It covers correlated
/// noise and noise that differs from place to place. `blocks` are ranges of rows; rows
/// after the last block are no data. `widened` is w, for errors that no scatter shows.
pub(crate) fn robust(
    jacobian: &DMatrix<f64>,
    residuals: &DVector<f64>,
    blocks: &[Range<usize>],
    widened: f64,
) -> Result<DMatrix<f64>, IdentifyError> {
    let plain = covariance(jacobian)?;
    let data = blocks.iter().map(|block| block.end).max().unwrap_or(0);
    let rest = jacobian.rows(data, jacobian.nrows() - data);
    let mut middle = rest.transpose() * rest;
    for block in blocks {
        let rows = jacobian.rows(block.start, block.len());
        let gradient = rows.transpose() * residuals.rows(block.start, block.len());
        middle += widened * widened * &gradient * gradient.transpose();
    }
    let sandwich = &plain * middle * &plain;
    let grown = |i: usize| (sandwich[(i, i)] / plain[(i, i)]).max(1.0).sqrt();
    let n = plain.nrows();
    Ok(DMatrix::from_fn(n, n, |i, j| grown(i) * grown(j) * plain[(i, j)]))
}

/// Standard deviation about zero of residuals, and how much their correlation adds to the
/// variance of a mean.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Noise {
    /// Root mean square.
    pub deviation: f64,
    /// Variance of a mean over that of as many independent ones, at least 1.
    pub inflation: f64,
}

impl Noise {
    /// Of residuals in order of time. The inflation is the integrated autocorrelation
    /// 1 + 2 sum rho_k, summed until it no longer grows faster than a fifth of the lags
    /// summed (Sokal's window), at most a third of the residuals.
    pub(crate) fn of(residuals: &[f64]) -> Self {
        let n = residuals.len();
        let square: f64 = residuals.iter().map(|r| r * r).sum();
        if n < 3 || square == 0.0 {
            return Self { deviation: (square / n.max(1) as f64).sqrt(), inflation: 1.0 };
        }
        let mut inflation = 1.0;
        for lag in 1..n / 3 {
            let product: f64 = residuals.iter().zip(&residuals[lag..]).map(|(a, b)| a * b).sum();
            inflation += 2.0 * product / square;
            if lag as f64 >= WINDOW * inflation {
                break;
            }
        }
        Self { deviation: (square / n as f64).sqrt(), inflation: inflation.max(1.0) }
    }

    /// Standard deviation of independent residuals with the same variance of the mean.
    pub(crate) fn effective(&self) -> f64 {
        self.deviation * self.inflation.sqrt()
    }
}

/// Lags summed per integrated autocorrelation.
const WINDOW: f64 = 5.0;

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    /// y = a exp(-t / b) at t = 0, 1, ... 9, of ln a and ln b, as a quantity that must be positive
    /// is fitted, or of a and b themselves.
    struct Decay(Vec<f64>, fn(f64) -> f64);

    fn decay(a: f64, b: f64) -> Vec<f64> {
        (0..10).map(|t| a * (-f64::from(t) / b).exp()).collect()
    }

    impl Model for Decay {
        type At = Vec<f64>;

        fn at(&self, x: &[f64]) -> Option<Vec<f64>> {
            x[0].is_finite().then(|| decay(self.1(x[0]), self.1(x[1])))
        }

        fn residuals(&self, _: &[f64], at: &Vec<f64>) -> Vec<f64> {
            at.iter().zip(&self.0).map(|(a, b)| a - b).collect()
        }

        fn jacobian(&self, x: &[f64], at: &Vec<f64>) -> Option<Vec<Vec<f64>>> {
            // d ln a / dx, of x or ln a.
            let per = |x: f64| if self.1(0.0) > 0.0 { 1.0 } else { 1.0 / x };
            let by_a = at.iter().map(|y| y * per(x[0])).collect();
            let by_b = |(t, y): (usize, &f64)| y * t as f64 / self.1(x[1]) * per(x[1]);
            Some(vec![by_a, at.iter().enumerate().map(by_b).collect()])
        }
    }

    /// Relative errors of a and b, fitted from 1 and 2 on.
    fn errors(a: f64, b: f64) -> [f64; 2] {
        let fitted =
            minimise(&Decay(decay(a, b), f64::exp), &[0.0, 2.0_f64.ln()], SETTLED).unwrap();
        assert!(fitted.residuals.norm() < 1e-6, "{:?}", fitted.x);
        [fitted.x[0].exp() / a - 1.0, fitted.x[1].exp() / b - 1.0]
    }

    proptest! {
        #[test]
        fn the_parameters_of_exact_data_come_back(a in 0.5f64..5.0, b in 1.0f64..8.0) {
            prop_assert!(errors(a, b).iter().all(|error| error.abs() < 1e-6));
        }
    }

    /// Fitted by b itself, the first step goes to b = 0.001, where the residuals do not depend on
    /// b: a point where the solver has to stop. By the logarithm it comes back; and where the
    /// solver stops like that, the covariance refuses the result.
    #[test]
    fn a_fit_that_stops_where_a_parameter_has_no_effect_is_refused() {
        let (a, b) = (4.0322, 1.5215);
        assert!(errors(a, b).iter().all(|error| error.abs() < 1e-6));
        let stopped = minimise(&Decay(decay(a, b), |x| x), &[1.0, 2.0], SETTLED).unwrap();
        assert!(stopped.x[1] < 0.01, "{:?}", stopped.x);
        assert!(covariance(&stopped.jacobian).is_err());
    }

    #[test]
    fn the_covariance_of_a_mean_is_the_variance_over_the_count() {
        let jacobian = DMatrix::from_element(25, 1, 1.0 / 0.3);
        assert!((covariance(&jacobian).unwrap()[(0, 0)] - 0.09 / 25.0).abs() < 1e-12);
        let twice = DMatrix::from_element(25, 2, 1.0);
        assert!(covariance(&twice).is_err());
    }

    #[test]
    fn correlated_residuals_widen_the_covariance_and_independent_ones_do_not() {
        // A mean of 40: by tens alike, or each for itself.
        let jacobian = DMatrix::from_element(40, 1, 1.0);
        let blocks: Vec<Range<usize>> = (0..4).map(|b| 10 * b..10 * b + 10).collect();
        let alike = DVector::from_fn(40, |i, _| if i / 10 % 2 == 0 { 1.0 } else { -1.0 });
        let each = DVector::from_fn(40, |i, _| if i % 2 == 0 { 1.0 } else { -1.0 });
        let of = |residuals| robust(&jacobian, residuals, &blocks, 1.0).unwrap()[(0, 0)];
        assert!((of(&alike) - 0.25).abs() < 1e-12, "{}", of(&alike));
        assert!((of(&each) - 1.0 / 40.0).abs() < 1e-12);
    }

    #[test]
    fn a_model_without_an_answer_is_an_error() {
        assert!(minimise(&Decay(vec![1.0; 10], f64::exp), &[f64::INFINITY, 2.0], SETTLED).is_err());
    }

    /// First-order autoregression.
    fn series(part: f64, seed: u64) -> Vec<f64> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut value = 0.0;
        (0..4000)
            .map(|_| {
                value = part * value + random.random::<f64>() - 0.5;
                value
            })
            .collect()
    }

    #[test]
    fn independent_residuals_count_each() {
        let noise = Noise::of(&series(0.0, 1));
        assert!((noise.deviation / (1.0f64 / 12.0).sqrt() - 1.0).abs() < 0.05, "{noise:?}");
        assert!(noise.inflation < 1.2, "{noise:?}");
    }

    #[test]
    fn correlated_residuals_count_less() {
        // (1 + a) / (1 - a) of a first-order autoregression.
        for part in [0.5, 0.8] {
            let noise = Noise::of(&series(part, 2));
            let expected = (1.0 + part) / (1.0 - part);
            assert!((noise.inflation / expected - 1.0).abs() < 0.35, "{noise:?} {expected}");
        }
    }

    #[test]
    fn no_residuals_or_zeros_are_no_noise() {
        assert_eq!(Noise::of(&[]), Noise { deviation: 0.0, inflation: 1.0 });
        assert_eq!(Noise::of(&[0.0; 9]).effective(), 0.0);
    }
}
