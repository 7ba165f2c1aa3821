//! The fit to what the study publishes: three gaps, three parameters of the tread.
//!
//! Three points fit three parameters: there is neither a validation nor an interval, and
//! the fit is not exact. At one speed the ratio of two gaps hardly depends on the tread, so
//! the residual is the model's error, not noise, and one combination of the three parameters
//! is nearly undetermined. It is held to the scenario's tread within a factor of two.

use rayon::prelude::*;

use super::IdentifyError;
use super::least_squares::{Model, SETTLED, minimise};
use crate::plant::balance::Axial;
use crate::plant::crossing::{CrossingCase, cross};
use crate::plant::ring::RingParameters;
use crate::scenario::Scenario;

/// Speeds and preloads of the study's four cases under 60 N of top load: mm/s, N.
pub const CASES: [(f64, f64); 4] = [(5.0, 100.0), (5.0, 120.0), (8.0, 100.0), (3.0, 120.0)];

/// Finite-element vibration amplitude of the same, which is its contact gap, mm (its
/// Fig. 15). Stiffness, stiffening and relaxation time of the tread are fitted to these.
pub const AMPLITUDE_MM: [f64; 3] = [1.7079, 1.5567, 1.9014];

/// Elements around the ring and axial travel per step, mm: gaps within 0.1 % of the
/// converged ones.
pub(crate) const CONVERGED: (usize, f64) = (2880, 0.01);

/// Change of a logarithm for the differences.
const MOVED: f64 = 0.02;
/// The ring's own error in a gap, relative: the unit of the deviations.
const GAP_REL: f64 = 1e-3;
/// How far a parameter may lie from its start, logarithm: a factor of two.
const FREE_LN: f64 = 0.7;
/// The same of one that is held.
const HELD_LN: f64 = 1e-6;

/// The tread that shows the published gaps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tread {
    /// Relaxed stiffness, Pa/m.
    pub k_inf_pa_per_m: f64,
    pub stiffening: f64,
    /// Relaxation time, s.
    pub tau_s: f64,
    /// Its gaps less the published ones, mm.
    pub residuals_mm: [f64; 3],
}

/// The three crossings, pushed without friction.
struct Gaps<'a> {
    scenario: &'a Scenario,
    fineness: (usize, f64),
    start: [f64; 3],
    /// How far each may lie from there, logarithm.
    free: [f64; 3],
}

impl Model for Gaps<'_> {
    type At = Vec<f64>;

    /// Gaps over the published ones, less 1, for these logarithms.
    fn at(&self, x: &[f64]) -> Option<Vec<f64>> {
        let rig = &self.scenario.rig;
        let k_inf = x[0].exp();
        let ring = RingParameters {
            k_inf,
            k_0: k_inf * x[1].exp(),
            tau_s: x[2].exp(),
            ..RingParameters::of(rig, self.fineness.0)
        };
        let deviation = |case: usize| {
            let (speed_mm_s, preload_n) = CASES[case];
            let of = (speed_mm_s, preload_n, Axial::Pushed);
            let crossing = CrossingCase { ring, ..CrossingCase::of(rig, self.fineness, of) };
            cross(&crossing).ok().map(|result| result.gap_mm / AMPLITUDE_MM[case] - 1.0)
        };
        (0..3).into_par_iter().map(deviation).collect()
    }

    fn residuals(&self, x: &[f64], at: &Vec<f64>) -> Vec<f64> {
        let gaps = at.iter().map(|deviation| deviation / GAP_REL);
        let from = x.iter().zip(&self.start).map(|(x, start)| x - start);
        let held = from.zip(&self.free).map(|(from, free)| from / free);
        gaps.chain(held).collect()
    }

    fn jacobian(&self, x: &[f64], _: &Vec<f64>) -> Option<Vec<Vec<f64>>> {
        let column = |index: usize| {
            let at = |by: f64| {
                let mut x = x.to_vec();
                x[index] += by;
                self.at(&x)
            };
            let (up, down) = (at(MOVED)?, at(-MOVED)?);
            let slope = |(u, d): (&f64, &f64)| (u - d) / (2.0 * MOVED * GAP_REL);
            let held =
                (0..3).map(|other| if other == index { 1.0 / self.free[index] } else { 0.0 });
            Some(up.iter().zip(&down).map(slope).chain(held).collect())
        };
        (0..3).map(column).collect()
    }
}

impl<'a> Gaps<'a> {
    fn of(scenario: &'a Scenario, fineness: (usize, f64)) -> Self {
        let tread = &scenario.rig.tread;
        let start = [tread.k_inf_pa_per_m * 1e-9, tread.stiffening, tread.tau_s].map(f64::ln);
        Self { scenario, fineness, start, free: [FREE_LN; 3] }
    }
}

/// Fits the tread to the three published gaps by least squares of their relative
/// deviations, from the scenario's tread on; with `hold`, its stiffening is held.
pub fn fit(
    scenario: &Scenario,
    fineness: (usize, f64),
    hold: bool,
) -> Result<Tread, IdentifyError> {
    let mut gaps = Gaps::of(scenario, fineness);
    if hold {
        gaps.free[1] = HELD_LN;
    }
    let fitted = minimise(&gaps, &gaps.start, SETTLED)?;
    Ok(tread(&fitted.x, &fitted.at))
}

/// The scenario's own tread with the residuals of its gaps.
pub fn stated(scenario: &Scenario, fineness: (usize, f64)) -> Result<Tread, IdentifyError> {
    let gaps = Gaps::of(scenario, fineness);
    let at = gaps.at(&gaps.start);
    let at = at.ok_or_else(|| IdentifyError::NoFit("a crossing has no balance".into()))?;
    Ok(tread(&gaps.start, &at))
}

fn tread(x: &[f64], deviations: &[f64]) -> Tread {
    Tread {
        k_inf_pa_per_m: 1e9 * x[0].exp(),
        stiffening: x[1].exp(),
        tau_s: x[2].exp(),
        residuals_mm: std::array::from_fn(|case| AMPLITUDE_MM[case] * deviations[case]),
    }
}
