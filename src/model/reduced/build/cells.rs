//! Guesses, each a low polynomial in a cell: of the run by speed and force, and of the speed
//! by stiffness and run. One step of the solver makes them exact.

use super::least_squares::LeastSquares;
use super::polynomial::{node, value};
use super::{Start, bits};
use crate::model::effective_stiffness::Folded;
use crate::model::reduced::direction_model::{
    FAST_CELLS, FORCE_CELLS, LOWEST_OCTAVE, Pair, RunCell, STIFFNESS_CELLS, SpeedCell,
};

/// Runs, in equal ratios, and fast parts in a cell that a guess of the run is fitted at.
const RUNS: usize = 200;
const FAST_NODES: usize = 7;

/// First and last run of a fit, over the longest.
const RUN_RANGE: (f64, f64) = (0.04, 1.05);

/// Runs, and fast parts down to where the stiffness is least, that a guess of the speed is
/// fitted at.
const RUN_NODES: usize = 9;
const FAST_STEPS: usize = 96;

/// Largest force, over k_inf R^2 L, that the guess of the run has to be good for: 160 N on
/// the published wheel.
const FORCE_OF_USE: f64 = 0.0151;

/// Weight of points that only keep a guess tame: beyond that force, where no run has the
/// force, and where no speed has the stiffness.
const TAME: f64 = 1e-4;

type RunFit = LeastSquares<10, 55>;
type SpeedFit = LeastSquares<6, 21>;

impl Start<'_> {
    /// Guesses of the run; none if one does not fit its format.
    pub(super) fn run_cells(
        &self,
        stiffening: &Folded,
    ) -> Option<[[RunCell; FORCE_CELLS]; FAST_CELLS]> {
        let mut cells = [[RunCell::default(); FORCE_CELLS]; FAST_CELLS];
        for (index, row) in cells.iter_mut().enumerate() {
            let mut fits = [RunFit::new(); FORCE_CELLS];
            for k in 0..FAST_NODES {
                let u = 0.5 * node(k, FAST_NODES);
                let x = (index as f64 + 0.5 + u) / FAST_CELLS as f64;
                self.along_runs(stiffening, x, |excess, run, weight| {
                    if let Some((fit, m)) = force_cell(excess, &mut fits) {
                        fit.add(&run_terms(u, m), run, weight / (run * run));
                    }
                });
            }
            for (cell, fit) in row.iter_mut().zip(fits) {
                let found = fit.solve();
                // Neither the sum nor a row of it reaches twice the longest run.
                let most = |weights: &[f64; 10], from: usize| {
                    let terms = found.iter().zip(weights).skip(from);
                    terms.map(|(c, weight)| libm::fabs(c * weight)).sum::<f64>()
                };
                if most(&run_terms(0.5, 0.5), 0) >= 1.99 || most(&run_terms(0.5, 1.0), 4) >= 1.99 {
                    return None;
                }
                for (pair, of) in cell.iter_mut().zip(found.chunks_exact(2)) {
                    let bits = |c: f64| libm::round(c * 16_384.0) as i16;
                    *pair = Pair::new(bits(of[0]), bits(of[1]));
                }
            }
        }
        Some(cells)
    }

    /// What the force exceeds the lift on the steepest slope by, run and weight along the
    /// runs at a fast part.
    fn along_runs(&self, stiffening: &Folded, x: f64, mut at: impl FnMut(f64, f64, f64)) {
        let load = self.load_n / self.unit_n;
        let most_of_use = FORCE_OF_USE * self.formula.unit_force_n() / self.unit_n;
        let steepest = value(&self.slope, -0.5);
        let by_run = self.stiffness_by_run(stiffening, x);
        let (first, last) = RUN_RANGE;
        let ratio = libm::pow(last / first, 1.0 / (RUNS - 1) as f64);
        let (mut run, mut most) = (first, 0.0);
        for _ in 0..RUNS {
            let w = run - 0.5;
            let elastic = run * run * value(&self.force, w) * value(&by_run, w);
            let excess = elastic + load * (value(&self.slope, w) - steepest);
            if excess > most {
                let used = excess + load * steepest < most_of_use;
                at(excess, run, if used { 1.0 } else { TAME });
                most = excess;
            } else if most > 0.0 {
                break;
            }
            run *= ratio;
        }
        // On as the root of the force.
        while most > 0.0 && most < 0.25 {
            most *= ratio * ratio;
            at(most, run, TAME);
            run *= ratio;
        }
    }

    /// Guesses of the fast part; none if one does not fit its format.
    pub(super) fn speed_cells(&self, stiffening: &Folded) -> Option<[SpeedCell; STIFFNESS_CELLS]> {
        let mut fits = [SpeedFit::new(); STIFFNESS_CELLS];
        let mut add = |stiffness: f64, w: f64, x: f64, weight: f64| {
            let part = stiffness * STIFFNESS_CELLS as f64;
            if let Some(fit) = fits.get_mut(part as usize) {
                let p = part - libm::floor(part) - 0.5;
                fit.add(&[1.0, p, p * p, w, w * p, w * w], x, weight);
            }
        };
        for k in 0..RUN_NODES {
            let w = 0.5 * node(k, RUN_NODES);
            let (mut x, mut stiffness) = (1.0, self.stiffness(stiffening, 1.0, w));
            for step in (0..FAST_STEPS).rev() {
                add(stiffness, w, x, 1.0);
                let next = step as f64 / FAST_STEPS as f64;
                let less = self.stiffness(stiffening, next, w);
                if less >= stiffness {
                    break;
                }
                (x, stiffness) = (next, less);
            }
            // Towards rest below the least stiffness.
            for step in 0..FAST_STEPS {
                let part = step as f64 / FAST_STEPS as f64;
                add(part * stiffness, w, part * x, TAME);
            }
        }
        let mut cells = [[0; 6]; STIFFNESS_CELLS];
        for (cell, fit) in cells.iter_mut().zip(fits) {
            let found = fit.solve();
            // No sum exceeds the format.
            if found.iter().map(|c| libm::fabs(*c)).sum::<f64>() >= 31.0 {
                return None;
            }
            for (slot, c) in cell.iter_mut().zip(found) {
                *slot = bits(c, 26)?;
            }
        }
        Some(cells)
    }
}

/// `u^i m^j` in the order of [`RunCell`].
fn run_terms(u: f64, m: f64) -> [f64; 10] {
    let square = u * u;
    [1.0, u, square, square * u, m, m * u, m * square, m * m, m * m * u, m * m * square]
}

/// The cell of a force, and the centred mantissa in it.
fn force_cell(excess: f64, fits: &mut [RunFit; FORCE_CELLS]) -> Option<(&mut RunFit, f64)> {
    // From 1/2 to 1 times 2^exponent.
    let (part, exponent) = libm::frexp(excess);
    let zeros = 2 - exponent;
    let half = usize::from(part >= 0.75);
    let index = usize::try_from(2 * (LOWEST_OCTAVE as i32 - zeros)).ok()? + half;
    let m = 4.0 * part - if half == 1 { 3.5 } else { 2.5 };
    Some((fits.get_mut(index)?, m))
}
