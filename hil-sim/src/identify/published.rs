//! The fit to what the study publishes: three gaps, three parameters of the tread.
//!
//! Three points fit three parameters: nothing is left to tell how well, so there is neither
//! a validation nor an interval. Nor do they fit exactly: at one speed the ratio of two
//! gaps hardly depends on the tread, so that what is left over is the model's and no noise.

use rayon::prelude::*;

use super::IdentifyError;
use super::least_squares::{Model, minimise};
use crate::paper::published::{AMPLITUDE_MM, CASES};
use crate::plant::balance::Axial;
use crate::plant::crossing::{CrossingCase, cross};
use crate::plant::ring::RingParameters;
use crate::scenario::Scenario;

/// Change of a logarithm for the differences.
const MOVED: f64 = 0.02;

/// How finely the ring is computed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fineness {
    /// Elements around the ring.
    pub elements: usize,
    /// Axial way per step, mm.
    pub stride_mm: f64,
}

impl Fineness {
    /// The coarse ring that the presets' tread was fitted with.
    pub const STATED: Self = Self { elements: 720, stride_mm: 0.05 };
    /// Gaps within 0.1 % of the converged ones.
    pub const CONVERGED: Self = Self { elements: 5760, stride_mm: 0.005 };
}

/// The tread that shows the published gaps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tread {
    /// Relaxed stiffness, Pa/m.
    pub k_inf_pa_per_m: f64,
    /// Stiffening.
    pub stiffening: f64,
    /// Relaxation time, s.
    pub tau_s: f64,
    /// Its gaps less the published ones, mm.
    pub residuals_mm: [f64; 3],
}

/// The three crossings, pushed without friction.
struct Gaps<'a> {
    scenario: &'a Scenario,
    fineness: Fineness,
}

impl Gaps<'_> {
    /// Gaps over the published ones, less 1, for these logarithms.
    fn deviations(&self, x: &[f64]) -> Option<Vec<f64>> {
        let k_inf = x[0].exp();
        let ring = RingParameters {
            k_inf,
            k_0: k_inf * x[1].exp(),
            tau_s: x[2].exp(),
            ..RingParameters::of(&self.scenario.rig, self.fineness.elements)
        };
        let deviation = |case: usize| {
            let (speed_mm_s, preload_n) = CASES[case];
            let crossing = CrossingCase {
                ring,
                step_height_mm: self.scenario.rig.rig.step_height_mm,
                speed_mm_s,
                preload_n,
                axial: Axial::Pushed,
                stride_mm: self.fineness.stride_mm,
            };
            cross(&crossing).ok().map(|result| result.gap_mm / AMPLITUDE_MM[case] - 1.0)
        };
        (0..3).into_par_iter().map(deviation).collect()
    }
}

impl Model for Gaps<'_> {
    type At = Vec<f64>;

    fn at(&self, x: &[f64]) -> Option<Vec<f64>> {
        self.deviations(x)
    }

    fn residuals(&self, _: &[f64], at: &Vec<f64>) -> Vec<f64> {
        at.clone()
    }

    fn jacobian(&self, x: &[f64], _: &Vec<f64>) -> Option<Vec<Vec<f64>>> {
        let column = |index: usize| {
            let at = |by: f64| {
                let mut x = x.to_vec();
                x[index] += by;
                self.deviations(&x)
            };
            let (up, down) = (at(MOVED)?, at(-MOVED)?);
            Some(up.iter().zip(&down).map(|(u, d)| (u - d) / (2.0 * MOVED)).collect())
        };
        (0..3).map(column).collect()
    }
}

/// Fits the tread to the three published gaps by least squares of their relative
/// deviations, from the scenario's tread on.
///
/// # Errors
/// [`IdentifyError::NoFit`] if it does not settle.
pub fn fit(scenario: &Scenario, fineness: Fineness) -> Result<Tread, IdentifyError> {
    let tread = &scenario.rig.tread;
    let start = [tread.k_inf_pa_per_m * 1e-9, tread.stiffening, tread.tau_s].map(f64::ln);
    let fitted = minimise(&Gaps { scenario, fineness }, &start)?;
    Ok(Tread {
        k_inf_pa_per_m: 1e9 * fitted.x[0].exp(),
        stiffening: fitted.x[1].exp(),
        tau_s: fitted.x[2].exp(),
        residuals_mm: std::array::from_fn(|case| AMPLITUDE_MM[case] * fitted.at[case]),
    })
}
